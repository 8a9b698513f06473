"""One coefficient of a version as an array with named axes; errors, runs and source beside every value."""

from __future__ import annotations

import json
from collections.abc import Collection, Hashable
from typing import TYPE_CHECKING, Any

import numpy as np

from sim.boat import catalogue
from sim.boat.database import Version, axis_columns
from sim.boat.row_codec import correlation_matrix
from sim.files.errors import InputError
from sim.files.frames import PROGRAM

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

# What stands beside every value, by the kind of a cell without one.
_BESIDE: dict[str, Any] = {
    "stderr": np.nan,
    "worst_residual": np.nan,
    "n_runs": 0,
    "runs": "",
    "source": "",
    "quality": "",
    "origin": "",
    "calibration": "",
}
# Axes beside those of the term table, where more than one is there.
_WHOSE = ("vehicle", "part")


def value_sources(rows: pd.DataFrame, commits: dict[str, Version]) -> list[str]:
    """Where each value comes from: what the runs' own source says, with their files and rows.

    Parameters
    ----------
    rows : Database rows.
    commits : Vehicle -> the commit that wrote its rows.

    Returns
    -------
    One text a row; of a version written before runs were kept with it, the campaign's name.
    """
    known = {name: json.loads(v.metadata.get("runs", "{}")) for name, v in commits.items()}
    every = rows.to_dict("records")
    return [_source(row, known[row["vehicle"]], commits[row["vehicle"]]) for row in every]


def _source(row: dict[Hashable, Any], known: dict[str, Any], commit: Version) -> str:
    if not row["runs"]:
        return "zero by port/starboard symmetry" if row["origin"] == "symmetry" else str(row["origin"])
    if not known:
        return f"campaign {commit.metadata.get('campaign', '')}"
    places_of: dict[tuple[int, int], list[int]] = {}
    for run in row["runs"].split():
        file, place, source = known["runs"].get(run, (-1, 0, -1))
        if file >= 0:
            places_of.setdefault((source, file), []).append(place)
    texts = []
    for (source, file), places in places_of.items():
        where = f"{known['files'][file]} row {' '.join(str(p) for p in sorted(places))}"
        texts.append(f"{known['sources'][source]} ({where})" if known["sources"][source] else where)
    mirrored = "mirror image of: " if row["origin"] == "mirror" else ""
    return mirrored + "; ".join(texts)


def coefficient_array(rows: pd.DataFrame, name: str, commits: dict[str, Version]) -> xr.DataArray:
    """Every value of one coefficient over its axes.

    Parameters
    ----------
    rows : Database rows of the coefficient.
    name : Its symbol.
    commits : As of ``value_sources``.

    Returns
    -------
    Axes are the database's columns, such as ``speed_mps`` and ``beta_deg``, ascending, and
    ``part`` or ``vehicle`` where there is more than one. Points that were not tabulated are NaN.

    Raises
    ------
    InputError
        When vehicles tabulate the coefficient over different axes.
    """
    import xarray as xr

    axes = [c for c in axis_columns() if rows[c].notna().any()]
    if rows[axes].isna().to_numpy().any():
        ships = ", ".join(sorted(rows["vehicle"].unique()))
        raise InputError(f"coefficient {name}", f"different axes for {ships}", "one vehicle: version.of(name)[...]")
    axes = [*(c for c in _WHOSE if rows[c].nunique() > 1), *axes]
    labels = {a: list(dict.fromkeys(rows[a])) if a in _WHOSE else sorted(rows[a].unique()) for a in axes}
    shape = tuple(len(labels[a]) for a in axes)
    place = tuple(np.array([labels[a].index(x) for x in rows[a]], dtype=int) for a in axes)

    def grid(values: Any, blank: Any) -> Any:
        out = np.full(shape, blank, dtype=object if isinstance(blank, str) else type(blank))
        out[place if axes else ()] = values if axes else values[0]
        return out

    beside = rows.assign(source=value_sources(rows, commits))
    coordinates: dict[str, Any] = {a: (a, labels[a], {} if a in _WHOSE else _axis_attributes(a)) for a in axes}
    coordinates |= {k: (axes, grid(beside[k].to_numpy(), blank)) for k, blank in _BESIDE.items()}
    coordinates |= {k: rows[k].iloc[0] for k in _WHOSE if k not in axes}
    array = xr.DataArray(grid(rows["value"].to_numpy(), np.nan), coordinates, axes, name, _attributes(rows, name))
    array["stderr"].attrs = {"units": "1", "long_name": "standard error of the value"}
    return array


def _axis_attributes(column: str) -> dict[str, str]:
    axis = catalogue.axes()[axis_columns()[column]]
    return {"units": axis.unit, "long_name": axis.meaning}


def _attributes(rows: pd.DataFrame, name: str) -> dict[str, str]:
    equation = str(rows["equation"].iloc[0])
    every = [t for s in catalogue.SETS for t in catalogue.terms(s) if t.name == name]
    term = next((t for t in every if t.equation == equation), every[0] if every else None)
    known = {"units": "1", "long_name": f"prime coefficient {name}", "frame": str(PROGRAM), "equation": equation}
    if term is not None and term.norm:
        size = f"1/2 rho L^{term.power}" if term.norm == "rho/2 L" else f"rho D^{term.power}"
        known["load"] = f"{term.output} = {size} {name} {term.multiplier}".strip()
    return known | {"extrapolation": str(rows["extrapolation"].iloc[0])}


def row_covariance(rows: pd.DataFrame, coefficients: Collection[str]) -> pd.DataFrame:
    """Covariance of the values of some coefficients.

    Values that are one estimate (mirror images) are fully correlated; estimates of different
    vehicles are independent; values that symmetry makes zero have none.

    Parameters
    ----------
    rows : Database rows, all of each vehicle: correlations name estimates of other coefficients.
    coefficients : Symbols.

    Returns
    -------
    (n, n), rows and columns labelled by vehicle, coefficient, part and the axes that are used.
    """
    import pandas as pd

    chosen = rows[rows["coefficient"].isin(coefficients)]
    total = np.zeros((len(chosen), len(chosen)))
    for vehicle, group in chosen.groupby("vehicle", sort=False):
        places = chosen.index.get_indexer(group.index)
        total[np.ix_(places, places)] = _of_one_vehicle(group, rows[rows["vehicle"] == vehicle])
    axes = [c for c in axis_columns() if chosen[c].notna().any()]
    labels = pd.MultiIndex.from_frame(chosen[["vehicle", "coefficient", "part", *axes]])
    return pd.DataFrame(total, index=labels, columns=labels)


def _of_one_vehicle(chosen: pd.DataFrame, every: pd.DataFrame) -> np.ndarray[Any, np.dtype[np.float64]]:
    first, correlation = correlation_matrix(every)
    place = {int(e): i for i, e in enumerate(first["estimate"])}
    index = np.array([place.get(int(e), -1) for e in chosen["estimate"]])
    known = index >= 0
    # A mirror image of the other sign has the estimate's error with the sign turned.
    turned = chosen["value"].to_numpy()[known] * first["value"].to_numpy()[index[known]] < 0.0
    error = np.where(turned, -1.0, 1.0) * chosen["stderr"].to_numpy()[known]
    total = np.zeros((len(chosen), len(chosen)))
    total[np.ix_(known, known)] = np.outer(error, error) * correlation[np.ix_(index[known], index[known])]
    return total
