"""How a public name is announced to go: see CONTRIBUTING.md, "What may change"."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ParamSpec, TypeVar

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


def gathered(
    since: str,
    kinds: Mapping[str, type[Any]],
    places: Sequence[str] = (),
    **into: str | tuple[str, str, Callable[[Any], Any] | None],
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Go on to take keywords that now are fields of an option class, with a warning.

    Parameters
    ----------
    since : Version that announced it.
    kinds : Parameter -> its frozen dataclass. A value that is none is taken for the first field of it.
    places : What could follow by its place, before only its name was taken; in that order.
    **into : Keyword -> parameter that has a field of that name; or parameter, field, and what makes one of the other.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Sea:
    ...     height: float = 0.0
    >>> @gathered("0.3", {"sea": Sea}, height="sea")
    ... def fly(sea=Sea()):
    ...     return sea.height
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     fly(height=2.0), str(caught[0].message)
    (2.0, 'fly(height=...) is deprecated since ident 0.3: use sea=Sea(height=...)')
    """

    def mark(function: Callable[P, R]) -> Callable[P, R]:
        parameters = inspect.signature(function).parameters
        usual = {name: p.default for name, p in parameters.items()}
        go_on: Callable[..., R] = function
        by_place = sum(p.kind is p.POSITIONAL_OR_KEYWORD for p in parameters.values())

        @functools.wraps(function)
        def taken(*arguments: P.args, **named: P.kwargs) -> R:
            first, further = arguments[:by_place], arguments[by_place:]
            if len(further) > len(places) or set(places[: len(further)]) & set(named):
                return function(*arguments, **named)
            if further:
                said = ", ".join(places[: len(further)])
                text = f"{function.__name__}(..., {said}) by place is deprecated since ident {since}: give names"
                warnings.warn(text, DeprecationWarning, stacklevel=2)
                named.update(zip(places, further, strict=False))
            for old in [name for name in named if name in into]:
                where = into[old]
                parameter, field, made = (where, old, None) if isinstance(where, str) else where
                kind, value = kinds[parameter], named.pop(old)
                call = f"{function.__name__}({old}=...)"
                use = f"{parameter}={kind.__name__}({field}=...)"
                warnings.warn(f"{call} is deprecated since ident {since}: use {use}", DeprecationWarning, stacklevel=2)
                now = named.get(parameter, usual[parameter])
                now = now if isinstance(now, kind) else kind(now)
                named[parameter] = dataclasses.replace(now, **{field: made(value) if made else value})
            return go_on(*first, **named)

        return taken

    return mark
