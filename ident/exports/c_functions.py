"""Compiled functions of the simulator, translated to C.

The simulator's loops are written in the part of Python that numba compiles: numbers, arrays,
tuples. The same source is read here and written as C99, a function for each combination of
argument types, so that there is one description of the right-hand side and not two. What the
translation does not know stops it, with the line; it never guesses.
"""

from __future__ import annotations

from typing import Any

from ident.exports.c_statements import Body
from ident.exports.c_syntax import Function
from ident.exports.c_types import SCALARS, Kind


class Translation:
    """C functions, each written once.

    Parameters
    ----------
    holder : C type of what holds the members; every function is handed it as ``boat``.

    Attributes
    ----------
    functions : Text of each, callee before caller.
    """

    def __init__(self, holder: str) -> None:
        self.holder = holder
        self.functions: list[str] = []
        self._known: dict[Any, tuple[str, Kind | None]] = {}
        self._names: dict[str, int] = {}
        self._helpers: dict[str, str] = {}

    def function(self, function: Function, kinds: tuple[Kind, ...]) -> tuple[str, Kind | None]:
        """Name and type of the result of a function for argument types, translated when it is new.

        Raises
        ------
        Untranslatable
            Naming the function and line that cannot be translated.
        """
        python = getattr(function, "py_func", function)
        key = (python, kinds)
        if key not in self._known:
            body = Body(self, python, kinds)
            plain = f"do_{python.__name__.strip('_')}"
            count = self._names[plain] = self._names.get(plain, 0) + 1
            name = f"{plain}_{count}" if count > 1 else plain
            text, returned = body.written(name, self.holder)
            self.functions.append(text)
            self._known[key] = (name, returned)
        return self._known[key]

    def helper(self, name: str, kind: str) -> str:
        """Name of a helper of C, whose text goes before the functions."""
        full = f"{name}_{kind}"
        if full not in self._helpers:
            self._helpers[full] = _rows(full, int(kind)) if name == "add_rows" else _scalar(full, name, kind)
        return full

    @property
    def text(self) -> str:
        """Helpers and functions."""
        return "\n\n".join([*self._helpers.values(), *self.functions])


def _scalar(full: str, name: str, kind: str) -> str:
    c = SCALARS[kind]
    if name == "sign":
        return f"static inline {c} {full}({c} x)\n{{\n    return (x > 0.0) - (x < 0.0);\n}}"
    test = "b < a" if name == "least" else "b > a"
    return f"static inline {c} {full}({c} a, {c} b)\n{{\n    return {test} ? b : a;\n}}"


def _rows(full: str, count: int) -> str:
    """Sum of weighted rows of eight numbers, each times its own product."""
    given = ", ".join([*(f"int r{k}" for k in range(count)), *(f"double w{k}" for k in range(count))])
    total = " + ".join(f"w{k} * table[r{k} + j]" for k in range(count))
    return (
        f"static inline void {full}(double *out, const double *table, {given},\n"
        "    const double *product, const int *place)\n"
        "{\n    double sum[8];\n"
        f"    for (int j = 0; j < 8; ++j) {{\n        sum[j] = {total};\n    }}\n"
        "    for (int j = 0; j < 8; ++j) {\n        out[j] += sum[j] * product[place[j]];\n    }\n}"
    )
