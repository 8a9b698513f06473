"""The reference of the public API: every name, field, method and parameter is on the page and in a docstring."""

from __future__ import annotations

import dataclasses
import inspect
import re
from pathlib import Path

import pytest

import ident

PAGE = (Path(__file__).parents[1] / "docs" / "api.md").read_text("utf-8")
CLASSES = [name for name in ident.__all__ if inspect.isclass(getattr(ident, name))]
FUNCTIONS = [name for name in ident.__all__ if inspect.isfunction(getattr(ident, name))]
# A call that nobody can read.
MOST = 7


def methods(kind):
    """Public methods and properties that a class defines itself, with ``__getitem__``."""
    fields = {f.name for f in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else set()
    for name, member in vars(kind).items():
        if name in fields or (name.startswith("_") and name != "__getitem__"):
            continue
        if isinstance(member, property):
            member = member.fget
        member = getattr(member, "func", getattr(member, "__func__", member))
        if inspect.isfunction(member):
            yield name, member


def parameters(function):
    return [name for name in inspect.signature(function).parameters if name not in ("self", "cls")]


def listed(name):
    """What the page lists of a class; everything where ``:members:`` names none."""
    block = re.search(rf"^\.\. autoclass:: {name}\n((?:   .*\n)*)", PAGE, re.MULTILINE)[1]
    members = re.search(r":members:(.*)", block)
    special = re.search(r":special-members:(.*)", block)
    every = members is not None and not members[1].strip()
    names = {n.strip() for found in (members, special) if found for n in found[1].split(",")}
    return every, names


def test_every_public_name_stands_once_on_the_page():
    names = re.findall(r"^\.\. auto(?:function|class):: (\w+)$", PAGE, re.MULTILINE)
    assert sorted(names) == sorted(ident.__all__)
    assert set(CLASSES) | set(FUNCTIONS) == set(ident.__all__)


@pytest.mark.parametrize("name", CLASSES)
def test_every_field_of_a_class_is_described(name):
    kind = getattr(ident, name)
    fields = [f.name for f in dataclasses.fields(kind)] if dataclasses.is_dataclass(kind) else []
    described = re.findall(r"^(\w[\w, ]*) : ", inspect.getdoc(kind), re.MULTILINE)
    known = {one.strip() for names in described for one in names.split(",")}
    assert {f for f in fields if not f.startswith("_")} <= known


@pytest.mark.parametrize("name", CLASSES)
def test_every_method_is_listed_and_says_what_it_takes(name):
    every, names = listed(name)
    for method, function in methods(getattr(ident, name)):
        text = inspect.getdoc(function)
        assert text, method
        assert method in names or (every and not method.startswith("_")), method
        assert [p for p in parameters(function) if not re.search(rf"\b{p}\b", text)] == [], method


@pytest.mark.parametrize("name", ident.__all__)
def test_nothing_takes_more_than_can_be_read(name):
    public = getattr(ident, name)
    called = [public] if inspect.isfunction(public) else [function for _, function in methods(public)]
    assert all(len(parameters(function)) <= MOST for function in called)
