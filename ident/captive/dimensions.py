"""Dimensionless loads, rates and accelerations of a source made dimensional, at model scale."""

from __future__ import annotations

import math
import re
from functools import cache
from importlib.resources import files

import numpy as np
import pandas as pd

from ident.captive.campaign_file import CampaignFile
from ident.captive.quantities import PRIMED
from ident.captive.source import Source
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError


@cache
def normalisations() -> pd.DataFrame:
    """Named normalisation systems of dimensionless input, one row each."""
    with (files("ident") / "data" / "normalisations.csv").open(encoding="utf-8") as stream:
        return pd.read_csv(stream, keep_default_na=False).set_index("name")


def sizes(source: Source, header: CampaignFile, where: str) -> dict[str, float]:
    """Sizes that a normalisation divides by: L, d, and A and l of ``[source.reference]``; 1 or NaN where not stated.

    Raises
    ------
    InputError
        For a normalisation by a stated area without one.
    """
    stated = source.reference
    if source.normalisation == "half_rho_A" and stated is None:
        raise InputError(where, "nothing", "a table [source.reference] with area_m2: half_rho_A needs it")
    return {
        "L": header.scale.length_m,
        "d": header.scale.draught_m or 1.0,
        "A": stated.area_m2 if stated else 1.0,
        "l": (stated.length_m or math.nan) if stated else math.nan,
    }


def product(text: str, values: dict[str, pd.Series | float]) -> pd.Series:
    """``U U/L L`` of the table as a number a run."""
    over, _, under = text.partition("/")
    number: pd.Series = pd.Series(1.0, index=values["U"].index)  # type: ignore[union-attr]
    for name in over.split():
        number = number * values[name]
    for name in under.split():
        number = number / values[name]
    return number


def dimensional(runs: pd.DataFrame, primed: set[str], source: Source, header: CampaignFile, where: str) -> pd.DataFrame:
    """Make dimensionless loads, rates and accelerations dimensional, at model scale.

    Parameters
    ----------
    runs : With U [m/s] in every run.
    primed : Quantities that are dimensionless, ``s_X`` and ``X_in`` among them.
    source : Its ``normalisation``, a row of ``data/normalisations.csv``, and ``reference``.
    header : For length, draught and density.
    where : For the error.

    Raises
    ------
    InputError
        Without a known name, a draught it needs, or a speed in a run.
    """
    if not primed:
        return runs
    table, name = normalisations(), source.normalisation
    if name not in table.index:
        wrong = repr(name) if name else f"{', '.join(sorted(primed))} dimensionless, and no normalisation"
        raise InputError(f"{where}, key source.normalisation", wrong, ", ".join(table.index))
    forms = table.loc[name]
    if header.scale.draught_m is None and "d" in f"{forms['force']} {forms['moment']}".split():
        raise InputError(f"{where}, key scale.draught_m", "nothing", f"the draught: {name} needs it")
    speed = runs["U"] if "U" in runs else pd.Series(np.nan, index=runs.index)
    still = ~(speed > 0.0)
    if still.any():
        run = runs[still].iloc[0]
        place = f"{run['file']}, row {run['row']}, column U"
        raise InputError(
            place, str(run.get("U")), f"a speed: dimensionless {', '.join(sorted(primed))} is made with it"
        )
    values: dict[str, pd.Series | float] = {"U": speed, **sizes(source, header, f"{where}, key source.reference")}
    out = runs.copy()
    for quantity in sorted(primed):
        load = quantity.removeprefix("s_").split("_")[0]
        kind = PRIMED[load]
        if "l" in re.split(r"[ /]", str(forms[kind])) and np.isnan(float(np.asarray(values["l"]))):
            text = f"the length that {load} was made dimensionless with"
            raise InputError(f"{where}, key source.reference.length_m", "nothing", text)
        scale = product(str(forms[kind]), values)
        if load in OUTPUTS:
            scale = scale * 0.5 * header.fluid.density_kgpm3 * speed**2
        out[quantity] = out[quantity] * scale
    return out
