"""How a public name is announced to go: see CONTRIBUTING.md, "What may change"."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def deprecated(since: str, instead: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Warn whoever calls a function, or makes an object of a class's method, that it will go.

    Parameters
    ----------
    since : Version that announced it.
    instead : What to use.

    Examples
    --------
    >>> @deprecated("0.3", "new()")
    ... def old():
    ...     return 1
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     old(), str(caught[0].message)
    (1, 'old is deprecated since ident 0.3: use new()')
    """

    def mark(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def warned(*arguments: P.args, **named: P.kwargs) -> R:
            text = f"{function.__name__} is deprecated since ident {since}: use {instead}"
            # The caller's line, not this one.
            warnings.warn(text, DeprecationWarning, stacklevel=2)
            return function(*arguments, **named)

        return warned

    return mark
