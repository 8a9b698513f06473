"""Compiled functions as they are written in Python: their syntax trees."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable
from typing import Any

from ident.exports.c_types import Kind, Several

Function = Callable[..., Any]

_parsed: dict[Function, ast.FunctionDef] = {}


def parsed(function: Function) -> ast.FunctionDef:
    """The syntax tree of a function."""
    if function not in _parsed:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
        assert isinstance(tree, ast.FunctionDef)
        _parsed[function] = tree
    return _parsed[function]


def statements(function: Function) -> list[ast.stmt]:
    """Statements of a function without its docstring and ``pass``."""
    kept = [s for s in parsed(function).body if not isinstance(s, ast.Pass)]
    return [s for s in kept if not (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant))]


def calm_form(function: Function, kinds: tuple[Kind, ...]) -> Function:
    """The function that stands for another in deep, calm water, where surroundings are an empty tuple."""
    if kinds and kinds[0] == Several(()):
        return function.__globals__.get(f"_calm_{function.__name__}", function)
    return function
