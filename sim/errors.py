"""The one error a user's mistake raises: where, what was found, what is allowed."""

from __future__ import annotations

from pydantic import ValidationError


class InputError(Exception):
    """Bad input, to be shown as one message and exit code 2.

    Parameters
    ----------
    where : File, with row and column where there is one.
    found : What was found.
    allowed : What is allowed there.
    """

    def __init__(self, where: str, found: str, allowed: str) -> None:
        super().__init__(f"{where}: {found} (allowed: {allowed})")
        self.where, self.found, self.allowed = where, found, allowed


def explain(where: str, error: ValidationError) -> InputError:
    """The first problem pydantic found, as an ``InputError``."""
    first = error.errors()[0]
    key = ".".join(str(k) for k in first["loc"]) or "the file"
    given = first.get("input")
    shown = "nothing" if first["type"] == "missing" else repr(given)[:80]
    allowed = "this key" if first["type"] == "missing" else first["msg"].removeprefix("Value error, ")
    more = error.error_count() - 1
    rest = f"; {more} more problem{'s' if more > 1 else ''}" if more else ""
    return InputError(f"{where}, key {key}", f"{shown}", f"{allowed}{rest}")
