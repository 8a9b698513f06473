"""TOML files: those that come with the program by their name, a user's own by path."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

from sim.files import inputs
from sim.files.errors import InputError


def bundled(kind: str) -> list[str]:
    """Names of the bundled ``vehicles`` or ``cases``."""
    return sorted(p.name[:-5] for p in (files("sim") / kind).iterdir() if p.name.endswith(".toml"))


def read_toml(name: str | Path, kind: str, named_in: str = "") -> tuple[dict[str, Any], str]:
    """A bundled name or a path to a TOML file, as data and the name to report.

    Parameters
    ----------
    name : The name or path.
    kind : ``vehicles`` or ``cases``; empty where none are bundled.
    named_in : File and key that name it, for the message.

    Raises
    ------
    InputError
        When neither a bundled file nor a readable TOML file of that name exists.
    """
    path = Path(name)
    if kind and path.suffix != ".toml" and str(name) in bundled(kind):
        return tomllib.loads((files("sim") / kind / f"{name}.toml").read_text("utf-8")), str(name)
    try:
        there = path.is_file()
    except OSError:
        there = False
    if not there:
        missing, text = "no such file", "a path to a .toml file"
        if kind:
            missing, text = "no such file or bundled name", f"one of {', '.join(bundled(kind))}, or a path"
            if str(name).endswith(".toml") and str(name)[:-5] in bundled(kind):
                missing = f"no such file here; the bundled one is called {str(name)[:-5]}, without .toml"
        if named_in:
            raise InputError(named_in, f"{str(name)[:200]!r}: {missing}", text)
        raise InputError(str(name)[:200], missing, text)
    raw = inputs.statements(path)
    try:
        return tomllib.loads(raw.decode("utf-8")), str(path)
    except (ValueError, RecursionError) as error:
        raise InputError(str(path), f"not TOML: {error}", "a TOML file in UTF-8") from error
