"""The one error a user's mistake raises: where, what was found, what is allowed."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel, ValidationError


class InputError(Exception):
    """Bad input, to be shown as one message and exit code 2.

    Parameters
    ----------
    where : File, with row and column where there is one.
    found : What was found.
    allowed : What is allowed there.

    Examples
    --------
    >>> import ident
    >>> try:
    ...     ident.read_campaign("nowhere")
    ... except ident.InputError as error:
    ...     print(error.where, "|", error.found)
    nowhere/campaign.toml | missing
    """

    def __init__(self, where: str, found: str, allowed: str) -> None:
        super().__init__(f"{where}: {found} (allowed: {allowed})")
        self.where, self.found, self.allowed = where, found, allowed

    def __reduce__(self) -> tuple[Any, ...]:
        # From one process to another with all that it says, and of whatever kind it is.
        return _again, (type(self), self.args, dict(self.__dict__))


def _again(kind: type[InputError], args: tuple[Any, ...], state: dict[str, Any]) -> InputError:
    error = kind.__new__(kind, *args)
    error.__dict__.update(state)
    return error


def _known(kind: type[BaseModel], place: tuple[int | str, ...]) -> list[str]:
    """Keys of the part of a file that a pydantic location without its last entry leads to."""
    model: type[BaseModel] | None = kind
    for part in place[:-1]:
        if isinstance(part, str) and model is not None and part in model.model_fields:
            model = _model_in(model.model_fields[part].annotation)
    return list(model.model_fields) if model is not None else []


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The model inside an annotation such as ``list[Model] | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((m for a in get_args(annotation) if (m := _model_in(a)) is not None), None)


def _shown(given: Any) -> str:
    """What was given, short: of a part of a file its plain entries."""
    if not isinstance(given, dict):
        return repr(given)[:80]
    plain = [f"{k} = {v!r}" for k, v in given.items() if isinstance(v, str | int | float) and len(repr(v)) <= 24]
    return ", ".join(plain)[:120] or repr(given)[:80]


def explain(where: str, error: ValidationError, kind: type[BaseModel]) -> InputError:
    """One problem that pydantic found, as an ``InputError``; an unknown key says more than the one it is not."""
    problems = error.errors()
    first = next((p for p in problems if p["type"] == "extra_forbidden"), problems[0])
    key = ".".join(str(k) for k in first["loc"]) or "the file"
    shown, allowed = _shown(first.get("input")), first["msg"].removeprefix("Value error, ")
    if first["type"] == "missing":
        shown, allowed = "nothing", "this key"
    elif first["type"] == "extra_forbidden":
        known = _known(kind, first["loc"])
        near = get_close_matches(str(first["loc"][-1]), known, 1)
        shown = f"unknown key, {shown}"
        allowed = (f"{near[0]}? One of " if near else "one of ") + ", ".join(known)
    more = len(problems) - 1
    rest = f"; {more} more problem{'s' if more > 1 else ''}" if more else ""
    return InputError(f"{where}, key {key}", shown, f"{allowed}{rest}")
