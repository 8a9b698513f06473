"""What a reader meets in every room: functions of seven parameters at most, of a screen below what is said of them."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILES = sorted([*(ROOT / "ident").rglob("*.py"), *(ROOT / "sim").rglob("*.py")])
# The options of a command are its parameters; compiled functions take flat arrays (docs/architecture.md).
FREE = ("click.command", "njit", "compiled", "inner", "outer", "making", "inlined", "merged", "fast", "intrinsic")


def functions(path):
    tree = ast.parse(path.read_text("utf-8"))
    # Compiled where it is assigned: name = intrinsic(function).
    assigned = {
        arg.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and ast.unparse(node.func) in FREE
        for arg in node.args
        if isinstance(arg, ast.Name)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name not in assigned:
            yield node


def is_free(function):
    return any(ast.unparse(one).split("(")[0] in FREE for one in function.decorator_list)


def parameters(function):
    given = function.args
    named = [a.arg for a in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    return [name for name in named if name not in ("self", "cls")]


@pytest.mark.parametrize("room", sorted({path.relative_to(ROOT).parts[:2] for path in FILES}), ids="/".join)
def test_no_function_has_more_than_seven_parameters_or_sixty_lines(room):
    count = 0
    for path in FILES:
        if path.relative_to(ROOT).parts[:2] != room:
            continue
        for function in functions(path):
            count += 1
            place = f"{path.relative_to(ROOT)}:{function.lineno} {function.name}"
            assert is_free(function) or len(parameters(function)) <= 7, f"{place}{tuple(parameters(function))}"
            told = function.body[0].end_lineno - function.lineno if ast.get_docstring(function) else 0
            assert function.end_lineno - function.lineno - told < 60 or is_free(function), place
    assert count or room[-1] in ("__init__.py", "options.py")


def test_test_modules_import_no_test_module():
    for path in sorted((ROOT / "tests").glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [one.name for one in node.names] if isinstance(node, ast.Import) else []
            assert not any(name.split(".")[-1].startswith("test_") for name in names), f"{path.name}: {names}"


def test_files_stay_about_four_hundred_lines():
    for path in [*FILES, *sorted((ROOT / "tests").glob("*.py"))]:
        assert len(path.read_text("utf-8").splitlines()) <= 450, path.relative_to(ROOT)
