"""What every data file shares: a strict schema, a declared frame, one way to refuse."""

from __future__ import annotations

from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from sim.errors import InputError, explain
from sim.frames import Frame, FrameError


class Data(BaseModel):
    """A part of a data file: unknown keys and non-finite numbers are refused."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class FrameData(Data):
    """Declared directions of the body axes."""

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


Checked = TypeVar("Checked", bound=Data)


def checked(kind: type[Checked], data: dict[str, Any], where: str) -> Checked:
    """Parsed data as a checked file of a kind.

    Raises
    ------
    InputError
        Naming ``where`` and the first key that is missing, unknown or out of range.
    """
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise explain(where, error) from error
