"""Published harmonics of depth and pitch in regular waves, and flights beside them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ident.seakeeping import Harmonics
from sim.errors import InputError

_COLUMNS = ("source", "channel", "D0_m", "value", "unit", "sigma")


def read_published(path: str | Path) -> pd.DataFrame:
    """Published harmonics: source, channel, D0_m, value, unit, sigma.

    Channels: ``dz1_over_aw`` [-], first harmonic of depth over wave amplitude; ``theta1``
    [deg], first harmonic of pitch.

    Raises
    ------
    InputError
        For a missing file or column, an unknown channel or unit, or a number that is none.
    """
    where = str(path)
    if not Path(path).is_file():
        raise InputError(where, "no such file", f"a CSV file: {', '.join(_COLUMNS)}")
    table = pd.read_csv(path, dtype=str)
    for column in _COLUMNS:
        if column not in table:
            raise InputError(where, f"column {column} missing", ", ".join(_COLUMNS))
    units = {"dz1_over_aw": "-", "theta1": "deg"}
    for i, row in table.iterrows():
        place = f"{where}, row {int(str(i)) + 2}"
        if units.get(row["channel"]) != row["unit"]:
            text = "; ".join(f"{k} in {v}" for k, v in units.items())
            raise InputError(place, f"{row['channel']} in {row['unit']}", text)
        for column in ("D0_m", "value", "sigma"):
            number = pd.to_numeric(row[column], errors="coerce")
            if not np.isfinite(number):
                raise InputError(f"{place}, column {column}", repr(row[column]), "a finite number")
    return table.astype({"D0_m": float, "value": float, "sigma": float})[list(_COLUMNS)]


def as_published(found: Mapping[str, Harmonics]) -> dict[str, tuple[float, float]]:
    """``dz1_over_aw`` [-] and ``theta1`` [deg] with standard errors, of depth (D0 or z) and pitch."""
    own: dict[str, tuple[float, float]] = {}
    depth = found.get("D0", found.get("z"))
    if depth is not None:
        own["dz1_over_aw"] = depth.transfer
    if "theta" in found:
        pitch = found["theta"]
        own["theta1"] = math.degrees(pitch.amplitude[0]), math.degrees(pitch.amplitude_stderr[0])
    return own


def against_published(flown: Mapping[float, Mapping[str, Harmonics]], reference: pd.DataFrame) -> list[dict[str, Any]]:
    """Flown harmonics beside each published value at the same depth.

    Parameters
    ----------
    flown : Depth of the sail top D0 [m] -> harmonics.
    reference : From ``read_published``.

    Returns
    -------
    One row a published value that has a flight: source, channel, D0_m, unit, published,
    sigma, flown, flown_stderr, ratio (flown over published).
    """
    rows = []
    for depth, found in sorted(flown.items()):
        own = as_published(found)
        at = reference[np.isclose(reference["D0_m"], depth, rtol=0.0, atol=0.05)]
        for row in at.to_dict("records"):
            if row["channel"] not in own:
                continue
            value, error = own[row["channel"]]
            rows.append(
                {"source": row["source"], "channel": row["channel"], "D0_m": depth, "unit": row["unit"]}
                | {"published": row["value"], "sigma": row["sigma"], "flown": value, "flown_stderr": error}
                | {"ratio": value / row["value"]}
            )
    return rows
