"""Which channel a header names, and its factor to SI: ``data/trial_channels.csv`` is the one list."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import pandas as pd

from ident.captive.quantities import factor, split
from sim.files.errors import InputError

# Spellings of units that only differ in how they are written.
_SPELLED = {"degpm": "deg/min", "degpmin": "deg/min", "degps": "deg/s", "radps": "rad/s", "kts": "knot", "kn": "knot"}
_SPELLED |= {"kt": "knot", "degrees": "deg", "degree": "deg", "grad": "deg", "radians": "rad", "metres": "m"}
_SPELLED |= {"meters": "m", "meter": "m", "metre": "m", "sec": "s", "seconds": "s", "deg.": "deg", "degc": "deg"}
# Capitals of these say another unit, or none: milli and mega, nautical mile and nanometre.
_CAPITALS_COUNT = ("nm", "mm", "ms", "m")
# A unit that the name of a column says.
_NAMED_UNIT = {"rpm": "rpm", "rps": "rps"}


@dataclass(frozen=True)
class Meaning:
    """What a column is: its channel, SI unit and factor to it, and what had to be taken for granted."""

    header: str
    channel: str
    unit: str
    factor: float
    assumed: str = ""


@cache
def table() -> pd.DataFrame:
    """The channels of a trial: SI unit, the quantity whose units they share, and their names."""
    with (files("ident") / "data" / "trial_channels.csv").open(encoding="utf-8") as stream:
        return pd.read_csv(stream, keep_default_na=False).set_index("channel")


@cache
def _words() -> dict[str, str]:
    return {word.strip(): str(c) for c, words in table()["words"].items() for word in words.split(";")}


def plain(text: str) -> str:
    """A header as words: small letters, blanks for marks, no accents."""
    bare = "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))
    return " ".join(re.split(r"[\s_.:/\-]+", bare.strip().lower())).strip()


def channel_of(name: str) -> str:
    """The channel a name stands for; empty when none."""
    known = _words()
    return known.get(name.strip()) or known.get(plain(name), "")


def unit_factor(channel: str, unit: str) -> float | None:
    """Factor from a unit to the SI unit of a channel; None when it is none of its units."""
    like = str(table().loc[channel, "like"])
    spelled = _SPELLED.get(unit.lower(), unit)
    size = factor(like, spelled) if spelled else None
    if size is None and unit.lower() not in _CAPITALS_COUNT:
        size = factor(like, _SPELLED.get(unit.lower(), unit.lower())) if unit else None
    return size


def _split(header: str) -> tuple[str, str | None]:
    """Name and unit of ``psi [deg]``, ``psi (deg)``, ``psi_deg``, ``psi / deg`` or ``psi, deg``."""
    name, unit = split(header)
    if unit is not None:
        return name, unit
    if (slashed := re.fullmatch(r"(.*\S)\s+/\s+\((.+)\)", header.strip())) is not None:
        # A unit that is a quotient, after a slash: r / (deg/s).
        return slashed[1], slashed[2]
    if channel_of(header):
        return header, _NAMED_UNIT.get(plain(header).split()[-1])
    for parts in (r"(.*\S)\s*[\s_/,]\s*(\S+)", r"([^_]+)_(\S+)"):
        parted = re.fullmatch(parts, header.strip())
        channel = channel_of(parted[1].rstrip(" _/,")) if parted else ""
        if parted and channel and unit_factor(channel, parted[2]) is not None:
            return parted[1].rstrip(" _/,"), parted[2]
    return header, None


def meaning(header: str, declared: str | None, where: str) -> Meaning | None:
    """What a column of a trial is; None for a column that names no channel, or is left out by ``"-"``.

    Parameters
    ----------
    header : As it stands in the file.
    declared : From ``[channels]``: ``psi`` or ``psi [deg]``.
    where : For the error.

    Raises
    ------
    InputError
        For an unknown declared channel, a missing unit, or one that the channel cannot have.
    """
    if declared == "-":
        return None
    name, unit = _split(header)
    place = f"{where}, column {header[:60]!r}"
    if declared is not None:
        channel, stated = split(declared)
        if channel not in table().index:
            raise InputError(f"{where}, key channels, {header!r}", f"channel {channel!r}", ", ".join(table().index))
        unit = stated if stated is not None else unit
    else:
        channel = channel_of(name)
        if not channel:
            return None
    return _with_unit(header, channel, unit, place)


def _with_unit(header: str, channel: str, unit: str | None, place: str) -> Meaning:
    row = table().loc[channel]
    if unit is None or unit == "":
        if not row["default"]:
            allowed = (
                f"a unit in the header, {header} [{_example(channel)}], or in trial.toml: [channels] {header!r} = "
            )
            raise InputError(place, f"no unit for {channel}", allowed + f'"{channel} [{_example(channel)}]"')
        unit, said = str(row["default"]), f"{header}: no unit in the header, taken as {row['default']}"
    else:
        said = ""
    scale = unit_factor(channel, unit)
    if scale is None:
        if channel == "t":
            return Meaning(header, channel, "s", 1.0, said)
        text = f"a unit of {row['like'] if channel == row['like'] else channel}, such as {_example(channel)}"
        raise InputError(place, f"unit {unit!r} for {channel}", text)
    return Meaning(header, channel, str(row["unit"]), scale, said)


def _example(channel: str) -> str:
    return {"rad": "deg", "rad/s": "deg/s", "1/s": "rpm"}.get(
        str(table().loc[channel, "unit"]), str(table().loc[channel, "unit"])
    )
