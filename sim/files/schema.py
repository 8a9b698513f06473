"""What every data file shares: a strict schema, a declared frame, one way to refuse."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError

from sim.files.errors import InputError, explain
from sim.files.frames import Frame, FrameError


class Data(BaseModel):
    """A part of a data file: unknown keys and non-finite numbers are refused."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


def _named(name: str) -> str:
    if not name.strip() or name != name.strip():
        raise ValueError("a name, without blanks around it")
    if len(name.encode()) > _LONGEST_NAME:
        raise ValueError(f"a name of {_LONGEST_NAME} bytes at most")
    bad = [c for c in name if c in "/\\" or not c.isprintable()]
    if bad or not name.strip("."):
        raise ValueError("a name that can stand in the name of a file: no separators, no control characters")
    return name


_LONGEST_NAME = 100
# Cases and vehicles give files their names.
Name = Annotated[str, AfterValidator(_named)]


class FrameData(Data):
    """Declared directions of the body axes.

    Attributes
    ----------
    x : ``forward`` or ``aft``.
    y : ``starboard`` or ``port``.
    z : ``down`` or ``up``.
    """

    x: str
    y: str
    z: str

    @property
    def frame(self) -> Frame:
        """The declared frame. Raises ``FrameError`` when it is not one."""
        return Frame(self.x, self.y, self.z)

    def declared(self, where: str) -> Frame:
        """The declared frame. Raises ``InputError`` naming ``where`` when it is not one."""
        try:
            return self.frame
        except FrameError as error:
            raise InputError(where, str(error), "a right-handed frame") from error


# Larger numbers are slips of the pen, and their powers leave the floating-point range.
_LARGEST = 1e15


def _too_large(data: Any, key: str = "") -> tuple[str, str] | None:
    """The first number of parsed data that no file means, with its key."""
    if isinstance(data, dict):
        parts = ((f"{key}.{k}" if key else str(k), v) for k, v in data.items())
    elif isinstance(data, list):
        parts = ((f"{key}[{i}]", v) for i, v in enumerate(data))
    else:
        number = isinstance(data, int | float) and not isinstance(data, bool)
        return (key, str(data)[:24]) if number and abs(data) > _LARGEST else None
    return next((found for k, v in parts if (found := _too_large(v, k))), None)


Checked = TypeVar("Checked", bound=Data)


def checked(kind: type[Checked], data: dict[str, Any], where: str) -> Checked:
    """Parsed data as a checked file of a kind.

    Raises
    ------
    InputError
        Naming ``where`` and the first key that is missing, unknown or out of range.
    """
    large = _too_large(data)
    if large:
        raise InputError(f"{where}, key {large[0]}", large[1], f"a number of size {_LARGEST:g} at most")
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise explain(where, error, kind) from error
