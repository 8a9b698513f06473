"""Rows of eight numbers at once, in the processor's vector registers.

A row of the tables holds one coefficient a load. Written as a loop it would be eight sums that
the compiler of numba does not join; these are the same sums on eight numbers together.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_WIDTH = 8
_ROW = ir.VectorType(ir.DoubleType(), _WIDTH)
_INDEX, _LONG = ir.IntType(32), ir.IntType(64)
_EMPTY = ir.Constant(_ROW, ir.Undefined)
# A product and a sum may be rounded once, where the processor can.
_FUSED = ("contract",)


def _pointer(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    return builder.gep(context.make_array(kind)(context, builder, array).data, [index])


def _row(builder: Any, pointer: Any) -> Any:
    return builder.bitcast(pointer, _ROW.as_pointer())


def _everywhere(builder: Any, number: Any) -> Any:
    first = builder.insert_element(_EMPTY, number, ir.Constant(_INDEX, 0))
    return builder.shuffle_vector(first, _EMPTY, ir.Constant(ir.VectorType(_INDEX, _WIDTH), [0] * _WIDTH))


def _add_rows(
    typing: Any,
    out: Any,
    at: Any,
    table: Any,
    rows: Any,
    weights: Any,
    products: Any,
    first: Any,
    places: Any,
    place: Any,
) -> Any:
    """``out[at:at+8] += (sum of weights[k] * table[rows[k]:rows[k]+8]) * products[first + places[place:place+8]]``.

    ``rows`` and ``weights`` are tuples of one length, whole numbers and floats.
    """
    signature = types.void(out, types.int64, table, rows, weights, products, types.int64, places, types.int64)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kinds = signature.args
        out, at, table, rows, weights, products, first, places, place = args
        total = None
        for k in range(len(kinds[3])):
            row = _pointer(context, builder, kinds[2], table, builder.extract_value(rows, k))
            weight = _everywhere(builder, builder.extract_value(weights, k))
            part = builder.fmul(weight, builder.load(_row(builder, row), align=8), flags=_FUSED)
            total = part if total is None else builder.fadd(total, part, flags=_FUSED)
        factor, start = _EMPTY, _pointer(context, builder, kinds[7], places, place)
        product = _pointer(context, builder, kinds[5], products, first)
        for j in range(_WIDTH):
            which = builder.load(builder.gep(start, [ir.Constant(_LONG, j)]))
            factor = builder.insert_element(factor, builder.load(builder.gep(product, [which])), ir.Constant(_INDEX, j))
        target = _row(builder, _pointer(context, builder, kinds[0], out, at))
        sum_ = builder.fadd(builder.load(target, align=8), builder.fmul(total, factor, flags=_FUSED), flags=_FUSED)
        builder.store(sum_, target, align=8)
        return context.get_dummy_value()

    return signature, generate


add_rows: Any = intrinsic(_add_rows)
