"""Statements of compiled functions, translated to C."""

from __future__ import annotations

import ast
import re
from typing import Any

import numpy as np

from ident.exports.c_expressions import Expressions, Translator
from ident.exports.c_syntax import Function, parsed, statements
from ident.exports.c_types import SCALARS, Block, Kind, Number, Several, Value, is_static, joined, loosened
from ident.exports.c_values import bare, c_name, flattened, named

_INDENT = "    "
# Types settle in a few readings of a function.
_READINGS = 5


class Body(Expressions):
    """A function, for argument types, as a function of C."""

    def __init__(self, translation: Translator, function: Function, kinds: tuple[Kind, ...]) -> None:
        tree = parsed(function)
        names = [a.arg for a in tree.args.args]
        super().__init__(translation, function, {})
        self.arguments = dict(zip(names, kinds, strict=True))
        self.stores = _stores(tree)
        self.returned: Kind | None = None
        self.lines: list[str] = []
        self.depth = 1

    def read(self) -> None:
        """Read the function until the types of its variables no longer change."""
        for _ in range(_READINGS):
            known = dict(self.variables), self.returned
            self.bound = {n: named(c_name(n), k) for n, k in self.arguments.items() if n not in self.stores}
            for name, kind in self.arguments.items():
                if name in self.stores:
                    self.variables[name] = joined(self.variables.get(name), loosened(kind))
            self.lines, self.before, self.temporaries, self.used = [], [], 0, set()
            self._block(statements(self.python))
            if known == (self.variables, self.returned):
                return
        raise self.fail(parsed(self.python), "types that do not settle")

    def written(self, name: str, holder: str) -> tuple[str, Kind | None]:
        """Text of the function of C, and the type of its result."""
        self.read()
        results = self.returned
        given = [f"{holder} *boat"]
        unused = ["boat"] if not any("boat" in line for line in self.lines) else []
        for argument, kind in self.arguments.items():
            leaves = [v for v in flattened(named(c_name(argument), kind)) if not is_static(v.kind)]
            given += [_declared(v) for v in leaves]
            unused += [v.text for v in leaves if not _appears(v.text, self.lines)]
        head = "void"
        if isinstance(results, Number):
            head = SCALARS[results.kind]
        elif isinstance(results, Several):
            given += [_declared(Value(f"*{v.text}", v.kind)) for v in self._results(results)]
        variables = [
            leaf
            for variable, kind in self.variables.items()
            if variable not in self.arguments
            for leaf in flattened(named(c_name(variable), kind))
            if not is_static(leaf.kind) and _appears(leaf.text, self.lines)
        ]
        lines = [f"{_INDENT}{_declared(v)} = 0;" for v in variables]
        lines += [f"{_INDENT}{SCALARS[b.kind]} {n}[{max(b.size, 1)}];" for n, b in self.arrays.items()]
        lines += [f"{_INDENT}(void){u};" for u in unused]
        said = (ast.get_docstring(parsed(self.python)) or "").split("\n\n")[0].replace("\n", " ")
        text = [f"/* {said} */"] if said else []
        return "\n".join([*text, f"static {head} {name}({', '.join(given)})", "{", *lines, *self.lines, "}"]), results

    def _results(self, results: Several) -> list[Value]:
        return [v for v in flattened(named("out", results)) if not is_static(v.kind)]

    def _say(self, text: str) -> None:
        for line in self.before:
            self.lines.append(_INDENT * self.depth + line)
        self.before = []
        if text:
            self.lines.append(_INDENT * self.depth + text)

    def _block(self, nodes: list[ast.stmt]) -> None:
        for node in nodes:
            translate: Any = getattr(self, f"_do_{type(node).__name__.lower()}", None)
            if translate is None:
                raise self.fail(node, f"{type(node).__name__} is not translated")
            translate(node)

    def _do_pass(self, node: ast.Pass) -> None:
        pass

    def _do_expr(self, node: ast.Expr) -> None:
        value = self.value(node.value)
        self._say(f"{value.text};" if value.text else "")

    def _do_break(self, node: ast.Break) -> None:
        self._say("break;")

    def _do_continue(self, node: ast.Continue) -> None:
        self._say("continue;")

    def _do_annassign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self._assign(node.target, self.value(node.value))

    def _do_assign(self, node: ast.Assign) -> None:
        value = self._array(node) or self.value(node.value)
        for target in node.targets:
            self._assign(target, value)

    def _array(self, node: ast.Assign) -> Value | None:
        """An array, or several, that the function makes for itself."""
        target = node.targets[0]
        if isinstance(node.value, ast.Tuple) and isinstance(target, ast.Tuple):
            pairs = list(zip(target.elts, node.value.elts, strict=True))
            if any(self._is_made(v) for _, v in pairs):
                parts = [self._made(t, v) if self._is_made(v) else self.value(v) for t, v in pairs]
                return Value("", Several(tuple(p.kind for p in parts)), tuple(parts))
        return self._made(target, node.value) if self._is_made(node.value) else None

    def _is_made(self, node: ast.expr) -> bool:
        return isinstance(node, ast.Call) and self._called(node) in (np.empty, np.zeros)

    def _called(self, node: ast.Call) -> Any:
        if isinstance(node.func, ast.Attribute) and isinstance(node.func.value, ast.Name):
            return getattr(self.python.__globals__.get(node.func.value.id), node.func.attr, None)
        return None

    def _made(self, target: ast.expr, node: ast.expr) -> Value:
        assert isinstance(node, ast.Call)
        shape = self.value(node.args[0])
        sizes = tuple(v.kind.value for v in flattened(shape) if isinstance(v.kind, Number))
        if not isinstance(target, ast.Name) or self.stores[target.id] != 1 or None in sizes:
            raise self.fail(node, "an array whose size is not known, or whose name stands for others too")
        name = c_name(target.id)
        kind = self.arrays[name] = Block("d", sizes, name)
        if self._called(node) is np.zeros:
            self._say(f"memset({name}, 0, sizeof {name});")
        return Value(name, kind)

    def _assign(self, target: ast.expr, value: Value) -> None:
        if isinstance(target, ast.Tuple):
            self._assign_several(target, value)
        elif isinstance(target, ast.Name):
            self._assign_name(target, value)
        elif isinstance(target, ast.Subscript):
            place = self.value(target)
            self._say(f"{place.text} = {bare(value.text)};")
        else:
            raise self.fail(target, "a target that is not translated")

    def _assign_name(self, target: ast.Name, value: Value) -> None:
        once = self.stores[target.id] == 1
        kind = value.kind if once else _plain(value.kind)
        self.variables[target.id] = joined(self.variables.get(target.id), kind)
        for place, one in zip(flattened(self.variable(target.id)), flattened(value), strict=True):
            if is_static(place.kind):
                continue
            self._say(f"{place.text} = {bare(one.text)};" if place.text != one.text else "")

    def _assign_several(self, target: ast.Tuple, value: Value) -> None:
        if len(value.parts) != len(target.elts):
            raise self.fail(target, "as many targets as values are wanted")
        parts = list(value.parts)
        places = [_root(t) for t in target.elts]
        if any(
            _appears(place, [p.text for v in parts[i + 1 :] for p in flattened(v)]) for i, place in enumerate(places)
        ):
            parts = [self._kept(p) for p in parts]
        for one, part in zip(target.elts, parts, strict=True):
            self._assign(one, part)

    def _kept(self, value: Value) -> Value:
        """A number as it is before others change."""
        if is_static(value.kind) or not isinstance(value.kind, Number):
            return value
        self.temporaries += 1
        name = f"got{self.temporaries}"
        self.variables[name] = value.kind
        self._say(f"{name} = {bare(value.text)};")
        return Value(name, value.kind)

    def _do_augassign(self, node: ast.AugAssign) -> None:
        load = ast.parse(ast.unparse(node.target), mode="eval").body
        result = self.value(ast.copy_location(ast.BinOp(load, node.op, node.value), node))
        if isinstance(node.target, ast.Name):
            self._assign_name(node.target, result)
        else:
            self._assign(node.target, result)

    def _do_return(self, node: ast.Return) -> None:
        if node.value is None:
            self._say("return;")
            return
        value = self.value(node.value)
        kind = _plain(value.kind)
        self.returned = joined(self.returned, kind)
        if isinstance(self.returned, Several):
            for place, one in zip(self._results(self.returned), flattened(value), strict=True):
                if not isinstance(place.kind, Number):
                    raise self.fail(node, "an array as a result")
                self._say(f"*{place.text} = {bare(one.text)};")
            self._say("return;")
        else:
            self._say(f"return {bare(value.text)};")

    def _do_if(self, node: ast.If) -> None:
        test = self.number(node.test)
        assert isinstance(test.kind, Number)
        if test.kind.value is not None:
            self._block(node.body if test.kind.value else node.orelse)
            return
        self._say(f"if ({bare(test.text)}) {{")
        self._inside(node.body)
        if node.orelse:
            self._say("} else {")
            self._inside(node.orelse)
        self._say("}")

    def _inside(self, nodes: list[ast.stmt]) -> None:
        self.depth += 1
        self._block(nodes)
        self.depth -= 1

    def _do_while(self, node: ast.While) -> None:
        before = len(self.before)
        test = self.number(node.test)
        if len(self.before) != before:
            raise self.fail(node, "a call that gives a tuple, where it may not be made")
        self._say(f"while ({bare(test.text)}) {{")
        self._inside(node.body)
        self._say("}")

    def _do_for(self, node: ast.For) -> None:
        if isinstance(node.iter, ast.Call) and isinstance(node.iter.func, ast.Name) and node.iter.func.id == "range":
            self._count(node)
            return
        items = self.value(node.iter)
        targets = node.target.elts if isinstance(node.target, ast.Tuple) else [node.target]
        for item in items.parts:
            parts = item.parts if isinstance(node.target, ast.Tuple) else (item,)
            kept = dict(self.bound)
            for target, part in zip(targets, parts, strict=True):
                assert isinstance(target, ast.Name)
                self.bound[target.id] = part
            self._block(node.body)
            self.bound = kept

    def _count(self, node: ast.For) -> None:
        assert isinstance(node.iter, ast.Call)
        assert isinstance(node.target, ast.Name)
        bounds = [self.number(a) for a in node.iter.args]
        start = bounds[0].text if len(bounds) > 1 else "0"
        end = bounds[min(1, len(bounds) - 1)].text
        step = bounds[2].kind.value if len(bounds) > 2 and isinstance(bounds[2].kind, Number) else 1
        if step not in (1, -1):
            raise self.fail(node, "a step other than one")
        if _outlives(node, node.target.id, parsed(self.python)):
            raise self.fail(node, "a counter that is used after its loop, or changed in it")
        name = c_name(node.target.id)
        kept = dict(self.bound)
        self.bound[node.target.id] = Value(name, Number("i"))
        sign, change = ("<", "++") if step == 1 else (">", "--")
        self._say(f"for (int {name} = {bare(start)}; {name} {sign} {end}; {change}{name}) {{")
        self._inside(node.body)
        self._say("}")
        self.bound = kept


def _plain(kind: Kind) -> Kind:
    """A type of which no number is known beforehand."""
    if isinstance(kind, Several):
        return Several(tuple(map(_plain, kind.items)), kind.names)
    return loosened(kind)


def _declared(value: Value) -> str:
    if isinstance(value.kind, Block):
        return f"{value.kind.pointer}{value.text}"
    assert isinstance(value.kind, Number)
    return f"{SCALARS[value.kind.kind]} {value.text}"


def _appears(name: str, lines: list[str]) -> bool:
    pattern = re.compile(rf"(?<![\w>.]){re.escape(name)}(?!\w)")
    return any(pattern.search(line) for line in lines)


def _root(node: ast.expr) -> str:
    while isinstance(node, ast.Subscript | ast.Attribute):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def _outlives(loop: ast.For, name: str, tree: ast.FunctionDef) -> bool:
    """Whether a counter is changed in its loop, or read after it before it is given another value."""
    inside = {id(n) for n in ast.walk(loop)}
    named_so = [n for n in ast.walk(tree) if isinstance(n, ast.Name) and n.id == name]
    if any(id(n) in inside and isinstance(n.ctx, ast.Store) and n is not loop.target for n in named_so):
        return True
    later = sorted(
        (n for n in named_so if id(n) not in inside and n.lineno > (loop.end_lineno or 0)),
        key=lambda n: (n.lineno, isinstance(n.ctx, ast.Load), n.col_offset),
    )
    return bool(later) and isinstance(later[0].ctx, ast.Load)


def _stores(tree: ast.FunctionDef) -> dict[str, int]:
    """How often each name is given a value, other than as a counter or as an item of a loop."""
    counters = {
        id(name)
        for loop in ast.walk(tree)
        if isinstance(loop, ast.For)
        for name in ast.walk(loop.target)
        if isinstance(name, ast.Name)
    }
    stores: dict[str, int] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and id(node) not in counters:
            stores[node.id] = stores.get(node.id, 0) + 1
        elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            stores[node.target.id] = stores.get(node.target.id, 0) + 1
    return stores
