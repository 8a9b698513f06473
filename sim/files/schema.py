"""What every data file shares: a strict schema, a declared frame, one way to refuse."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from sim.files.errors import InputError, explain
from sim.files.frames import Frame, FrameError


class Data(BaseModel):
    """A part of a data file: unknown keys, non-finite numbers and text or yes and no for numbers are refused."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, strict=True)


def _named(name: str) -> str:
    if not name.strip() or name != name.strip():
        raise ValueError("a name, without blanks around it")
    if len(name.encode()) > _LONGEST_NAME:
        raise ValueError(f"a name of {_LONGEST_NAME} bytes at most")
    bad = [c for c in name if c in "/\\" or not c.isprintable()]
    if bad or not name.strip("."):
        raise ValueError("a name that can stand in the name of a file: no separators, no control characters")
    return name


Positive = Annotated[float, Field(gt=0)]
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
LARGEST = 1e15


# A file of deeper parts is none of this program's.
_DEEPEST = 20


def _too_large(data: Any) -> tuple[str, str, str] | None:
    """The first number of parsed data that no file means, or the part too deep, with its key and what is allowed."""
    left = [("", data, 0)]
    while left:
        key, part, depth = left.pop()
        if depth > _DEEPEST:
            return key[:80], f"parts in parts, {_DEEPEST} deep", "a file of this program's"
        if isinstance(part, dict):
            left += [(f"{key}.{k}" if key else str(k), v, depth + 1) for k, v in reversed(part.items())]
        elif isinstance(part, list):
            left += [(f"{key}[{i}]", v, depth + 1) for i, v in reversed(list(enumerate(part)))]
        elif isinstance(part, int | float) and not isinstance(part, bool) and abs(part) > LARGEST:
            # Python refuses to write out an integer of thousands of digits.
            shown = f"a number of {part.bit_length()} bits" if isinstance(part, int) else str(part)
            return key, shown, f"a number of size {LARGEST:g} at most"
    return None


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
        raise InputError(f"{where}, key {large[0]}", large[1], large[2])
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise explain(where, error, kind) from error
