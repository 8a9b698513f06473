"""Types of the values that compiled functions handle, as they are written in C.

What is known before the program runs is a part of a type: the shape of an array, the member that
holds it, a number that never changes. C then needs neither headers of arrays nor arguments for them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

# How a scalar is written in C; "b" is a truth value, which C keeps in an int.
SCALARS = {"d": "double", "f": "float", "i": "int", "b": "int"}
_RANK = "bifd"


class Untranslatable(Exception):
    """A construct of Python, or a combination of types, that the translation does not know."""


@dataclass(frozen=True)
class Number:
    """A scalar: kind as in ``SCALARS``, and its value where it never changes."""

    kind: str
    value: Any = None


@dataclass(frozen=True)
class Block:
    """An array.

    Attributes
    ----------
    kind : As in ``SCALARS``. shape : Of the array.
    member : How C reaches it without an argument, or None. fixed : Whether it is never written.
    """

    kind: str
    shape: tuple[int, ...]
    member: str | None = None
    fixed: bool = False

    @property
    def size(self) -> int:
        """Number of elements."""
        return math.prod(self.shape)

    @property
    def pointer(self) -> str:
        """Type of a pointer to it."""
        return f"{'const ' if self.fixed else ''}{SCALARS[self.kind]} *"


@dataclass(frozen=True)
class Several:
    """A tuple; with names a named tuple."""

    items: tuple[Kind, ...]
    names: tuple[str, ...] = ()


Kind = Number | Block | Several


@dataclass(frozen=True)
class Value:
    """An expression of C: its text and type; a tuple has parts and no text."""

    text: str
    kind: Kind
    parts: tuple[Value, ...] = ()


def is_static(kind: Kind) -> bool:
    """Whether everything about a value is known, so that it needs no variable."""
    if isinstance(kind, Several):
        return all(map(is_static, kind.items))
    return kind.member is not None if isinstance(kind, Block) else kind.value is not None


def literal(value: Any, kind: str) -> str:
    """A number as C writes it, to its last digit."""
    if kind in "ib":
        return str(int(value))
    number = float(value)
    if math.isnan(number):
        return "NAN"
    if math.isinf(number):
        return "INFINITY" if number > 0.0 else "(-INFINITY)"
    text = repr(number) if kind == "d" else f"{np.float32(value)!s}"
    text += "" if any(c in text for c in ".en") else ".0"
    text += "f" if kind == "f" else ""
    return f"({text})" if number < 0.0 else text


def constant(value: Any) -> Value:
    """A value of Python that never changes."""
    if isinstance(value, tuple):
        parts = tuple(map(constant, value))
        return Value("", Several(tuple(p.kind for p in parts), getattr(type(value), "_fields", ())), parts)
    if isinstance(value, bool | np.bool_):
        kind = "b"
    elif isinstance(value, int | np.integer):
        kind = "i"
    elif isinstance(value, np.float32):
        kind = "f"
    elif isinstance(value, float):
        kind = "d"
    else:
        raise Untranslatable(f"a constant of type {type(value).__name__}")
    return Value(literal(value, kind), Number(kind, value))


def static_value(kind: Kind) -> Value:
    """The expression of a value about which everything is known."""
    if isinstance(kind, Several):
        return Value("", kind, tuple(map(static_value, kind.items)))
    if isinstance(kind, Block):
        return Value(str(kind.member), kind)
    return Value(literal(kind.value, kind.kind), kind)


def joined(first: Kind | None, second: Kind) -> Kind:
    """The type of a variable that is given values of both."""
    if first is None or first == second:
        return second
    if isinstance(first, Number) and isinstance(second, Number):
        return Number(max(first.kind, second.kind, key=_RANK.index))
    if (
        isinstance(first, Block)
        and isinstance(second, Block)
        and (first.kind, first.shape)
        == (
            second.kind,
            second.shape,
        )
    ):
        return Block(first.kind, first.shape, None, first.fixed or second.fixed)
    if isinstance(first, Several) and isinstance(second, Several) and len(first.items) == len(second.items):
        return Several(tuple(map(joined, first.items, second.items)), first.names)
    raise Untranslatable(f"a variable that is {first} and {second}")


def loosened(kind: Kind) -> Kind:
    """A type as that of an argument: numbers may change, but for those inside a named tuple."""
    if isinstance(kind, Number):
        return replace(kind, value=None)
    if isinstance(kind, Several) and not kind.names:
        return Several(tuple(map(loosened, kind.items)))
    return kind
