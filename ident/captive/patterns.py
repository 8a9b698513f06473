"""Regular expressions that a campaign states, matched in a time that grows with the text and no faster."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

# Characters of an expression, and steps of its program, each of which a character may have to be held against.
LONGEST = 1000
_STEPS = 3000
SYNTAX = "the syntax of RE2: no look-around, no back-references"


@lru_cache(maxsize=256)
def compiled(text: str) -> Any:
    r"""An expression with the methods ``search`` and ``fullmatch`` of ``re``, by the engine RE2.

    Its automata read every character once, where the engine of Python may try more ways through a line
    than there are seconds (Cox 2007, *Regular expression matching can be simple and fast*).

    Parameters
    ----------
    text : The expression.

    Raises
    ------
    ValueError
        When it is no expression of RE2, or too large a one.

    Examples
    --------
    >>> compiled(r"beta(?P<beta_deg>\d+)").search("drift_beta12.csv")["beta_deg"]
    '12'
    """
    import re2

    if len(text) > LONGEST:
        raise ValueError(f"a regular expression of {LONGEST} characters at most")
    options = re2.Options()
    options.log_errors = False
    try:
        expression = re2.compile(text, options)
    except (re2.error, UnicodeError) as error:
        said = error.args[0] if error.args else ""
        shown = said.decode("utf-8", "replace") if isinstance(said, bytes) else str(said)
        raise ValueError(f"a regular expression in {SYNTAX}; {shown}") from error
    if expression.programsize > _STEPS:
        raise ValueError(f"a smaller regular expression: this one has {expression.programsize} steps, {_STEPS} at most")
    return expression


def search(text: str, line: str) -> Any:
    """The first place of a line that an expression fits, None without one.

    Parameters
    ----------
    text : The expression.
    line : Bytes of a path that are no text count as question marks.

    Returns
    -------
    A match with ``groupdict`` and ``start`` (of a group's number), as that of ``re``.

    Raises
    ------
    ValueError
        As ``compiled``.
    """
    return compiled(text).search(line.encode("utf-8", "replace").decode("utf-8"))
