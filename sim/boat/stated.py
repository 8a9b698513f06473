"""Numbers of a vehicle file: each with its unit and where it comes from."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from sim.files.schema import Data

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]


class Number(Data):
    """A number with its unit and where it comes from.

    Attributes
    ----------
    value : The number, in the unit.
    unit : Its unit; only the one that the key asks for is taken.
    source : Where it comes from.
    """

    value: float
    unit: str
    source: str


class Triple(Data):
    """A vector with its unit and where it comes from.

    Attributes
    ----------
    value : Three numbers along the axes of the file, in the unit.
    unit : Their unit.
    source : Where they come from.
    """

    value: Vector
    unit: str
    source: str


class Limits(Data):
    """A lower and an upper limit with unit and source.

    Attributes
    ----------
    value : The lower and the upper limit, in the unit.
    unit : Their unit.
    source : Where they come from.
    """

    value: Annotated[list[float], Field(min_length=2, max_length=2)]
    unit: str
    source: str


def in_unit(unit: str, positive: bool = False) -> AfterValidator:
    """Numbers are taken as they are: what states another unit, or a size that is none, is refused."""

    def check(given: Number | Triple | Limits) -> Number | Triple | Limits:
        if given.unit != unit:
            raise ValueError(f"unit {unit!r}, and the value in it")
        if positive and isinstance(given, Number) and not given.value > 0.0:
            raise ValueError("a value above zero")
        if isinstance(given, Limits) and not given.value[0] < given.value[1]:
            raise ValueError("the lower limit, then the upper one")
        return given

    return AfterValidator(check)


Length = Annotated[Number, in_unit("m", positive=True)]
Mass = Annotated[Number, in_unit("kg", positive=True)]
Place = Annotated[Triple, in_unit("m")]
