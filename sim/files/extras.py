"""Libraries that only an extra installs: there, or one message that says which extra."""

from __future__ import annotations

from importlib import import_module
from itertools import accumulate
from typing import Any

from sim.files.errors import InputError


def library(module: str, extra: str, where: str, name: str = "") -> Any:
    """A module of a library that an extra installs.

    Parameters
    ----------
    module : To import.
    extra : Of this program that installs it.
    where : Option or step that asks for it, for the message.
    name : Of the library, where the module has another.

    Raises
    ------
    InputError
        When it is not installed.

    Example
    -------
    >>> library("no_such_library", "cfd", "cases")
    Traceback (most recent call last):
    sim.files.errors.InputError: cases: no_such_library is not installed (allowed: pip install 'ident-submarine[cfd]')
    """
    try:
        # Packages before what lies in them: a package that is not there hides modules that were loaded before.
        return [import_module(part) for part in accumulate(module.split("."), "{}.{}".format)][-1]
    except ImportError as error:
        missing = f"{name or module.partition('.')[0]} is not installed"
        raise InputError(where, missing, f"pip install 'ident-submarine[{extra}]'") from error
