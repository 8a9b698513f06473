"""Expressions of compiled functions, translated to C."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from ident.exports.c_syntax import Function, calm_form, parsed, statements
from ident.exports.c_types import (
    SCALARS,
    Block,
    Kind,
    Number,
    Several,
    Untranslatable,
    Value,
    constant,
    is_static,
    joined,
    loosened,
)
from ident.exports.c_values import bare, c_name, chosen, flattened, handed, named
from sim.kernel.rows import add_rows

_OPERATIONS: dict[type[ast.operator], tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", operator.add),
    ast.Sub: ("-", operator.sub),
    ast.Mult: ("*", operator.mul),
    ast.LShift: ("<<", operator.lshift),
    ast.RShift: (">>", operator.rshift),
    ast.BitAnd: ("&", operator.and_),
}
_COMPARISONS: dict[type[ast.cmpop], tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Eq: ("==", operator.eq),
    ast.NotEq: ("!=", operator.ne),
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
}
_MATH: dict[Any, str] = {
    **{getattr(math, name): name for name in ("sin", "cos", "exp", "sqrt", "asin", "atan2", "floor", "atan", "tan")},
    np.floor: "floor",
}
# Arrays up to this long are handed over, longer ones known by name.
_SHORT = 16
_TYPES = {np.float64: "d", np.float32: "f", float: "d", int: "i"}


class Translator(Protocol):
    """What expressions ask of the translation as a whole."""

    def function(self, function: Function, kinds: tuple[Kind, ...]) -> tuple[str, Kind | None]:
        """Name and result of a function for argument types."""

    def helper(self, name: str, kind: str) -> str:
        """Name of a helper of C for a kind of number."""


class Expressions:
    """Expressions of one function, for argument types.

    Parameters
    ----------
    translation : Of all functions. function : Of Python. bound : Names that stand for expressions.
    """

    def __init__(self, translation: Translator, function: Function, bound: dict[str, Value]) -> None:
        self.translation, self.python = translation, function
        self.bound = dict(bound)
        self.variables: dict[str, Kind] = {}
        self.arrays: dict[str, Block] = {}
        self.used: set[str] = set()
        self.before: list[str] = []
        self.temporaries = 0

    def fail(self, node: ast.AST, text: str) -> Untranslatable:
        """An exception that names function and line."""
        line = getattr(node, "lineno", 0)
        return Untranslatable(f"{self.python.__module__}.{self.python.__name__}, line {line}: {text}")

    def value(self, node: ast.expr) -> Value:
        """An expression.

        Raises
        ------
        Untranslatable
            For a construct that is not known.
        """
        translate: Callable[[Any], Value] | None = getattr(self, f"_{type(node).__name__.lower()}", None)
        if translate is None:
            raise self.fail(node, f"{type(node).__name__} is not translated")
        return translate(node)

    def number(self, node: ast.expr) -> Value:
        """An expression that is a number."""
        value = self.value(node)
        if not isinstance(value.kind, Number):
            raise self.fail(node, "a number is wanted")
        return value

    def variable(self, name: str) -> Value:
        """A variable; a tuple is one variable an item."""
        return named(c_name(name), self.variables[name])

    def _constant(self, node: ast.Constant) -> Value:
        return constant(node.value)

    def _name(self, node: ast.Name) -> Value:
        if node.id in self.bound:
            self.used.add(node.id)
            return self.bound[node.id]
        if node.id in self.variables:
            self.used.add(node.id)
            return self.variable(node.id)
        if node.id in self.python.__globals__:
            return constant(self.python.__globals__[node.id])
        raise self.fail(node, f"{node.id} is not known here")

    def _tuple(self, node: ast.Tuple) -> Value:
        parts: list[Value] = []
        for item in node.elts:
            parts += self.value(item.value).parts if isinstance(item, ast.Starred) else [self.value(item)]
        return Value("", Several(tuple(p.kind for p in parts)), tuple(parts))

    def _attribute(self, node: ast.Attribute) -> Value:
        if isinstance(node.value, ast.Name) and node.value.id not in self.bound and node.value.id not in self.variables:
            thing = getattr(self.python.__globals__.get(node.value.id), node.attr, None)
            if thing is not None:
                return constant(thing)
        owner = self.value(node.value)
        if isinstance(owner.kind, Several) and node.attr in owner.kind.names:
            return owner.parts[owner.kind.names.index(node.attr)]
        if isinstance(owner.kind, Block) and node.attr == "size":
            return constant(owner.kind.size)
        if isinstance(owner.kind, Block) and node.attr == "shape":
            return constant(owner.kind.shape)
        raise self.fail(node, f"attribute {node.attr}")

    def _subscript(self, node: ast.Subscript) -> Value:
        owner = self.value(node.value)
        indices = [self.number(i) for i in (node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice])]
        if isinstance(owner.kind, Several):
            return self._item(node, owner, indices[0])
        if not isinstance(owner.kind, Block) or len(indices) > len(owner.kind.shape):
            raise self.fail(node, "an index into what is no array of so many dimensions")
        shape, place = owner.kind.shape, indices[0]
        for size, index in zip(shape[1:], indices[1:], strict=False):
            place = self.sum(self.times(place, size), index)
        rest = shape[len(indices) :]
        if rest:
            place = self.times(place, math.prod(rest))
            return Value(f"({owner.text} + {place.text})", Block(owner.kind.kind, rest, None, owner.kind.fixed))
        return Value(f"{owner.text}[{bare(place.text)}]", Number(owner.kind.kind))

    def _item(self, node: ast.AST, owner: Value, index: Value) -> Value:
        assert isinstance(index.kind, Number)
        if index.kind.value is not None:
            return owner.parts[index.kind.value]
        kinds = {p.kind.kind for p in owner.parts if isinstance(p.kind, Number)}
        if len(kinds) != 1:
            raise self.fail(node, "a tuple of unlike items with an index that changes")
        (kind,) = kinds
        items = ", ".join(p.text for p in owner.parts)
        return Value(f"((const {SCALARS[kind]}[]){{{items}}})[{index.text}]", Number(kind))

    def times(self, value: Value, factor: int) -> Value:
        """A whole number times a constant."""
        if isinstance(value.kind, Number) and value.kind.value is not None:
            return constant(value.kind.value * factor)
        return value if factor == 1 else Value(f"{value.text} * {factor}", Number("i"))

    def sum(self, first: Value, second: Value) -> Value:
        """Sum of whole numbers."""
        assert isinstance(first.kind, Number)
        assert isinstance(second.kind, Number)
        if first.kind.value is not None and second.kind.value is not None:
            return constant(first.kind.value + second.kind.value)
        return Value(f"({first.text} + {second.text})", Number("i"))

    def _binop(self, node: ast.BinOp) -> Value:
        a, b = self.number(node.left), self.number(node.right)
        assert isinstance(a.kind, Number)
        assert isinstance(b.kind, Number)
        fixed = a.kind.value is not None and b.kind.value is not None
        kind = joined(loosened(a.kind), loosened(b.kind))
        assert isinstance(kind, Number)
        if isinstance(node.op, ast.Div):
            if fixed:
                return constant(a.kind.value / b.kind.value)
            whole = kind.kind in "ib"
            return Value(f"({'(double)' if whole else ''}{a.text} / {b.text})", Number("d") if whole else kind)
        if isinstance(node.op, ast.Pow):
            if b.kind.value != 2:
                raise self.fail(node, "a power other than two")
            return Value(f"({a.text} * {a.text})", kind)
        if isinstance(node.op, ast.Mod):
            if kind.kind != "i":
                raise self.fail(node, "a remainder of what is no whole number")
            # That of Python has the sign of the divisor.
            return Value(f"((({a.text} % {b.text}) + {b.text}) % {b.text})", kind)
        if type(node.op) not in _OPERATIONS:
            raise self.fail(node, f"{type(node.op).__name__} is not translated")
        sign, operation = _OPERATIONS[type(node.op)]
        if fixed:
            return constant(operation(a.kind.value, b.kind.value))
        return Value(f"({a.text} {sign} {b.text})", Number("i") if kind.kind == "b" else kind)

    def _unaryop(self, node: ast.UnaryOp) -> Value:
        value = self.number(node.operand)
        assert isinstance(value.kind, Number)
        if isinstance(node.op, ast.Not):
            if value.kind.value is not None:
                return constant(not value.kind.value)
            return Value(f"!{value.text}", Number("b"))
        if not isinstance(node.op, ast.USub):
            raise self.fail(node, f"{type(node.op).__name__} is not translated")
        if value.kind.value is not None:
            return constant(-value.kind.value)
        return Value(f"(-{value.text})", value.kind)

    def _boolop(self, node: ast.BoolOp) -> Value:
        either = isinstance(node.op, ast.Or)
        parts = []
        for item in node.values:
            value = self._undisturbed(item)
            assert isinstance(value.kind, Number)
            if value.kind.value is None:
                parts.append(value.text)
            elif bool(value.kind.value) is either:
                if not parts:
                    return constant(either)
                parts.append(str(int(either)))
                break
        if not parts:
            return constant(not either)
        return Value(f"({(' || ' if either else ' && ').join(parts)})", Number("b"))

    def _undisturbed(self, node: ast.expr) -> Value:
        """A number that is not always asked for, and so may need no statement before it."""
        before = len(self.before)
        value = self.number(node)
        if len(self.before) != before:
            raise self.fail(node, "a call that gives a tuple, where it may not be made")
        return value

    def _compare(self, node: ast.Compare) -> Value:
        values = [self.number(n) for n in (node.left, *node.comparators)]
        parts = []
        for a, b, op in zip(values, values[1:], node.ops, strict=False):
            sign, comparison = _COMPARISONS[type(op)]
            assert isinstance(a.kind, Number)
            assert isinstance(b.kind, Number)
            if a.kind.value is not None and b.kind.value is not None:
                if not comparison(a.kind.value, b.kind.value):
                    return constant(False)
                continue
            parts.append(f"({a.text} {sign} {b.text})")
        if not parts:
            return constant(True)
        return Value(f"({' && '.join(parts)})" if len(parts) > 1 else parts[0], Number("b"))

    def _ifexp(self, node: ast.IfExp) -> Value:
        test = self.number(node.test)
        assert isinstance(test.kind, Number)
        if test.kind.value is not None:
            return self.value(node.body if test.kind.value else node.orelse)
        before = len(self.before)
        either = chosen(test.text, self.value(node.body), self.value(node.orelse))
        if len(self.before) != before:
            raise self.fail(node, "a call that gives a tuple, where it may not be made")
        return either

    def _call(self, node: ast.Call) -> Value:
        if node.keywords:
            raise self.fail(node, "arguments by name")
        if isinstance(node.func, ast.Attribute) and node.func.attr == "reshape":
            return self._reshaped(node)
        target = self._target(node.func)
        if target is add_rows:
            return self._add_rows(node)
        arguments = [self.value(a) for a in node.args]
        if target in (min, max):
            return self._extreme(target, arguments)
        if target is len and isinstance(arguments[0].kind, Several):
            return constant(len(arguments[0].parts))
        if target is abs:
            whole = isinstance(arguments[0].kind, Number) and arguments[0].kind.kind == "i"
            return Value(f"{'abs' if whole else 'fabs'}({bare(arguments[0].text)})", loosened(arguments[0].kind))
        if target is np.sign:
            name = self.translation.helper("sign", "d")
            return Value(f"{name}({bare(arguments[0].text)})", Number("d"))
        if target in _TYPES:
            kind = _TYPES[target]
            return Value(f"(({SCALARS[kind]}){arguments[0].text})", Number(kind))
        if target in _MATH:
            single = all(isinstance(a.kind, Number) and a.kind.kind == "f" for a in arguments)
            texts = ", ".join(bare(a.text) for a in arguments)
            return Value(f"{_MATH[target]}{'f' if single else ''}({texts})", Number("f" if single else "d"))
        if not callable(target) or not hasattr(getattr(target, "py_func", target), "__code__"):
            raise self.fail(node, f"a call of {ast.unparse(node.func)}")
        return self.called(node, getattr(target, "py_func", target), arguments)

    def _target(self, node: ast.expr) -> Any:
        """What is called."""
        names = self.python.__globals__
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            return getattr(names.get(node.value.id), node.attr, None)
        if isinstance(node, ast.Name):
            return names.get(node.id, getattr(__import__("builtins"), node.id, None))
        raise self.fail(node, "a call of what is not named")

    def _extreme(self, target: Any, arguments: list[Value]) -> Value:
        extreme = arguments[0]
        for other in arguments[1:]:
            assert isinstance(extreme.kind, Number)
            assert isinstance(other.kind, Number)
            kind = joined(loosened(extreme.kind), loosened(other.kind))
            assert isinstance(kind, Number)
            name = self.translation.helper("least" if target is min else "largest", kind.kind)
            extreme = Value(f"{name}({bare(extreme.text)}, {bare(other.text)})", kind)
        return extreme

    def _reshaped(self, node: ast.Call) -> Value:
        assert isinstance(node.func, ast.Attribute)
        owner = self.value(node.func.value)
        sizes = [a.kind.value for a in map(self.number, node.args) if isinstance(a.kind, Number)]
        if not isinstance(owner.kind, Block) or None in sizes or math.prod(sizes) != owner.kind.size:
            raise self.fail(node, "a new shape that is not known")
        return Value(owner.text, replace(owner.kind, shape=tuple(sizes)))

    def _add_rows(self, node: ast.Call) -> Value:
        """``sim.kernel.rows.add_rows``, whose vector registers are the business of the compiler of C."""
        out, at, table, rows, weights, products, first, places, place = map(self.value, node.args)
        count = len(rows.parts)
        name = self.translation.helper("add_rows", str(count))
        given = (
            *(f"{out.text} + {at.text}", table.text, *(r.text for r in rows.parts)),
            *(*(w.text for w in weights.parts), f"{products.text} + {first.text}", f"{places.text} + {place.text}"),
        )
        return Value(f"{name}({', '.join(bare(g) for g in given)})", Several(()))

    def called(self, node: ast.AST, function: Function, arguments: list[Value]) -> Value:
        """A call of another compiled function."""
        function = calm_form(function, tuple(a.kind for a in arguments))
        steps = statements(function)
        names = [a.arg for a in parsed(function).args.args]
        if not steps:
            return Value("", Several(()))
        if len(steps) == 1 and isinstance(steps[0], ast.Return) and steps[0].value is not None:
            inlined = Expressions(self.translation, function, dict(zip(names, arguments, strict=True)))
            value = inlined.value(steps[0].value)
            if not isinstance(value.kind, Number) or is_static(value.kind):
                return value
        kinds = tuple(self._handed(a.kind) for a in arguments)
        name, returned = self.translation.function(function, kinds)
        texts = [text for a, kind in zip(arguments, kinds, strict=True) for text in handed(a, kind)]
        if returned is None:
            return Value(f"{name}({', '.join(['boat', *texts])})", Several(()))
        if isinstance(returned, Number):
            return Value(f"{name}({', '.join(['boat', *texts])})", returned)
        self.temporaries += 1
        result = named(f"got{self.temporaries}", returned)
        self.variables[f"got{self.temporaries}"] = returned
        leaves = [v for v in flattened(result) if not is_static(v.kind)]
        self.before.append(f"{name}({', '.join(['boat', *texts, *(f'&{v.text}' for v in leaves)])});")
        return result

    def _handed(self, kind: Kind) -> Kind:
        """The type of an argument: an array of this function is known to another by its address only.

        So is a short one, such as a state, for one function of C to serve all of them.
        """
        kind = loosened(kind)
        if isinstance(kind, Block) and (kind.member in self.arrays or kind.size <= _SHORT):
            return replace(kind, member=None)
        return kind
