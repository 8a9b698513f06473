"""Nothing at all is no path: it would be the working folder, which nobody meant."""

from __future__ import annotations

import os

import click
import pytest
from click.testing import CliRunner

from ident.cli import main
from ident.commands.shared import PathType

_PATHS = [
    (name, parameter)
    for name, command in main.commands.items()
    for parameter in command.params
    if isinstance(parameter.type, PathType)
]


@pytest.mark.parametrize(("name", "parameter"), _PATHS, ids=[f"{n} {p.name}" for n, p in _PATHS])
def test_an_empty_path_is_refused_and_nothing_written(tmp_path, monkeypatch, name, parameter):
    monkeypatch.chdir(tmp_path)
    others = [p for p in main.commands[name].params if isinstance(p, click.Argument) and p is not parameter]
    given = [""] if isinstance(parameter, click.Argument) else [parameter.opts[0], ""]
    done = CliRunner().invoke(main, [name, *(["x"] * len(others)), *given])
    assert done.exit_code == 2, done.output
    assert "''" in done.output
    assert os.listdir(tmp_path) == []


def test_every_command_that_takes_a_path_is_looked_at():
    assert {"export", "fit", "validate", "trial", "report"} <= {name for name, _ in _PATHS}
    for name, command in main.commands.items():
        for parameter in command.params:
            assert not isinstance(parameter.type, click.Path) or isinstance(parameter.type, PathType), name
