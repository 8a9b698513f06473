"""Loads along axes that are not the body's: of the flow, or of a tank or mesh the body stands turned in."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sim.files.errors import InputError

Array = NDArray[np.float64]
GROUPS = (("X", "Y", "Z"), ("K", "M", "N"))
# Axis about which each rotation turns the body, and how.
_ABOUT = {"roll": 0, "pitch": 1, "yaw": 2}
# A share of a load below this is rounding of an angle.
_NOTHING = 1e-12


def from_flow(alpha: Array, beta: Array) -> Array:
    """Matrices (n, 3, 3) from axes along the flow to the body's.

    The first axis is along the velocity, (cos a cos b, sin b, sin a cos b) in the body; the second and
    third are the body's y and z turned with it (wind axes, Etkin and Reid 1996, section 1.4). A body that is
    towed straight and stands at pitch alpha and yaw -beta in a tank has the tank's axes there.
    """
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    nothing = np.zeros_like(ca)
    rows = [[ca * cb, -ca * sb, -sa], [sb, cb, nothing], [sa * cb, -sa * sb, ca]]
    return np.array([[np.broadcast_to(x, ca.shape) for x in row] for row in rows]).transpose(2, 0, 1)


def turned_by(motion: str, angle: Array) -> Array:
    """Matrices (n, 3, 3) from axes at rest to those of a body turned by an angle about one of them."""
    c, s = np.cos(angle), np.sin(angle)
    a, b = [(1, 2), (2, 0), (0, 1)][_ABOUT[motion]]
    turns = np.zeros((angle.size, 3, 3))
    turns[:, [0, 1, 2], [0, 1, 2]] = 1.0
    turns[:, a, a], turns[:, a, b], turns[:, b, a], turns[:, b, b] = c, s, -s, c
    return turns


def to_body(runs: pd.DataFrame, forces: pd.Series, moments: pd.Series) -> pd.DataFrame:
    """Loads of some runs turned from the axes of flow or tank to the body's.

    Parameters
    ----------
    runs : Program frame and sense of angles; every load and its standard error ``s_X``.
    forces, moments : (runs,) What they are along: ``body``, ``flow`` or ``tank``.

    Raises
    ------
    InputError
        For a run whose turned load needs one that is not measured, or a turned load that is excluded in part.
    """
    out = runs.copy()
    for group, along in zip(GROUPS, (forces, moments), strict=True):
        for words in ("flow", "tank"):
            if (along == words).any():
                _turn_group(out, runs.index[along == words], group, words)
    return out


def _turn_group(out: pd.DataFrame, rows: pd.Index, group: tuple[str, str, str], words: str) -> None:
    """Turn forces or moments of some rows in place."""
    matrix = from_flow(*(out.loc[rows, k].fillna(0.0).to_numpy(float) for k in ("alpha", "beta")))
    values = out.loc[rows, list(group)].to_numpy(float)
    whole = np.zeros_like(values)
    for i, load in enumerate(group):
        for j, other in enumerate(group):
            share = np.where(np.abs(matrix[:, i, j]) > _NOTHING, matrix[:, i, j], 0.0)
            lost = (share != 0.0) & np.isnan(values[:, j]) & ~np.isnan(values[:, i])
            if lost.any():
                run = out.loc[rows[int(np.flatnonzero(lost)[0])]]
                text = f"a number: {load} along the body's axes needs {other} along those of the {words}"
                raise InputError(f"{run['file']}, row {run['row']}, column {other}", "nothing", text)
            whole[:, i] += np.where(share == 0.0, 0.0, share * np.nan_to_num(values[:, j]))
    out.loc[rows, list(group)] = np.where(np.isnan(values), np.nan, whole)
    errors = [f"s_{o}" for o in group]
    if all(error in out for error in errors):
        squares = np.nan_to_num(out.loc[rows, errors].to_numpy(float)) ** 2
        carried = np.sqrt(np.einsum("nij,nj->ni", matrix**2, squares))
        out.loc[rows, errors] = np.where(out.loc[rows, errors].isna().to_numpy(), np.nan, carried)
    for name in out.loc[rows, "exclude"].unique():
        some = [w for w in str(name).split() if w in group]
        if some and len(some) < len(group) and _mixed(matrix[(out.loc[rows, "exclude"] == name).to_numpy()]):
            run = out.loc[rows][out.loc[rows, "exclude"] == name].iloc[0]
            text = f"{' '.join(group)} together, or none: a turned load is made of all of them"
            raise InputError(f"{run['file']}, row {run['row']}, column exclude", repr(name), text)


def _mixed(matrix: Array) -> bool:
    return bool((np.abs(matrix - np.eye(3)) > _NOTHING).any())
