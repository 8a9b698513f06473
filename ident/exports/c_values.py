"""Values of an expression as C has them: names, arguments, choices."""

from __future__ import annotations

from ident.exports.c_types import Kind, Several, Value, is_static, joined, loosened, static_value

# Words of C, and what every function is handed.
_TAKEN = frozenset({"boat", "double", "float", "int", "char", "const", "long", "short", "signed", "static", "void"})


def c_name(name: str) -> str:
    """A name of Python as one of C."""
    return f"{name}_" if name in _TAKEN else name


def flattened(value: Value) -> list[Value]:
    """The numbers and arrays of a value."""
    if isinstance(value.kind, Several):
        return [leaf for part in value.parts for leaf in flattened(part)]
    return [value]


def handed(value: Value, kind: Kind) -> list[str]:
    """Texts of the arguments that C needs for a value of a type."""
    if is_static(kind):
        return []
    if isinstance(kind, Several):
        return [t for part, one in zip(value.parts, kind.items, strict=True) for t in handed(part, one)]
    return [bare(value.text)]


def named(name: str, kind: Kind) -> Value:
    """A variable or argument of a type, a tuple as one an item."""
    if is_static(kind):
        return static_value(kind)
    if isinstance(kind, Several):
        return Value("", kind, tuple(named(f"{name}_{i}", one) for i, one in enumerate(kind.items)))
    return Value(name, kind)


def chosen(test: str, first: Value, second: Value) -> Value:
    """One of two values by a condition, a tuple item by item."""
    if isinstance(first.kind, Several):
        parts = tuple(chosen(test, a, b) for a, b in zip(first.parts, second.parts, strict=True))
        return Value("", Several(tuple(p.kind for p in parts)), parts)
    kind = joined(loosened(first.kind), loosened(second.kind))
    return Value(f"({test} ? {first.text} : {second.text})", kind)


def bare(text: str) -> str:
    """An expression without the brackets around the whole of it."""
    if not (text.startswith("(") and text.endswith(")")):
        return text
    depth = 0
    for place, letter in enumerate(text):
        depth += (letter == "(") - (letter == ")")
        if depth == 0 and place < len(text) - 1:
            return text
    return text[1:-1]
