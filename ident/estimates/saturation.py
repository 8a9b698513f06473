"""Lift of planes beyond the angle at which it goes on straight.

Runs on a coarse grid stall early, and a straight line never does. The angle at which lift saturates
is taken from both: experiments on control surfaces of small aspect ratio (Whicker and Fehlner 1958, David
Taylor Model Basin Report 933: beyond 20 deg at aspect ratios of 2 to 3), and the campaign's
own runs. Beyond it the load stays.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ident.estimates.draft import Draft, Mask, NotApplicable

Array = NDArray[np.float64]

# Angle of the largest lift [deg] by experiment, and by runs that show less lift per degree beyond their
# angle; each with its deviation. The runs' is the wider: the grid, and steps of 10 deg between them.
_EXPERIMENT, _RUNS = (22.0, 4.0), (10.0, 8.0)
# Lift goes on straight up to here in the runs [deg].
STRAIGHT = 10.0
_WORD = "lift_continued"


def saturation_angle() -> tuple[float, float]:
    """Mean and deviation of the angle of saturation [deg], both sources weighted by their variance."""
    weight = [1.0 / s**2 for _, s in (_EXPERIMENT, _RUNS)]
    mean = (weight[0] * _EXPERIMENT[0] + weight[1] * _RUNS[0]) / sum(weight)
    return mean, sum(weight) ** -0.5


def reached(angle: float, mean: float, sigma: float) -> float:
    """Expected lift at an angle [deg], in degrees of straight lift: E min(angle, s), s normal.

    Example
    -------
    >>> round(reached(10.0, 30.0, 1e-9), 6), round(reached(40.0, 30.0, 1e-9), 6)
    (10.0, 30.0)
    """
    z = (angle - mean) / sigma
    density, below = math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi), 0.5 * (1.0 + math.erf(z / math.sqrt(2.0)))
    return angle - sigma * (density + z * below)


def saturation(draft: Draft) -> str:
    """Saturate plane loads that the campaign carried on straight (quality ``lift_continued``).

    Measured loads beyond the straight part stay; those that were continued keep what lift reaches up to
    the angle of saturation. One unknown, that angle, is shared by all planes.

    Raises
    ------
    NotApplicable
        When no load was continued.
    """
    rows, angle = draft.rows, draft.axis("delta")
    continued = continued_rows(draft)
    if not continued.any():
        raise NotApplicable(f"no plane load beyond the runs (quality {_WORD})")
    mean, sigma = saturation_angle()
    base_of = at_straight(draft)
    change, lost = np.zeros(len(rows)), np.zeros(len(rows))
    for i in np.flatnonzero(continued):
        straight, full = abs(float(angle[i])), float(draft.value[i])
        base = base_of(int(i))
        slope = (full - base) / (straight - STRAIGHT)
        change[i] = slope * (reached(straight, mean, sigma) - straight)
        up, down = (reached(straight, mean + d, 0.5 * sigma) for d in (0.5 * sigma, -0.5 * sigma))
        lost[i] = slope * (up - down)
    draft.shift(continued, change, f"saturation at {mean:.0f} deg")
    draft.spread("angle of saturation", lost)
    return f"lift saturates at {mean:.1f} +- {sigma:.1f} deg"


def continued_rows(draft: Draft) -> Mask:
    """(n,) True for loads beyond the straight part that the campaign carried on."""
    carried_on = draft.rows["quality"].eq(_WORD).to_numpy() & (np.abs(draft.axis("delta")) > STRAIGHT)
    return draft.where(["[YZKMN]_d*"]) & carried_on


def at_straight(draft: Draft) -> Callable[[int], float]:
    """Of a row: the load of the same plane, speed and depth at the end of the straight part."""
    rows, angle = draft.rows, draft.axis("delta")
    side = np.sign(angle)
    columns = [rows[c].tolist() for c in ("coefficient", "part", "speed_mps", "depth_m")]
    keys = list(zip(*columns, side.tolist(), strict=True))
    ends = {keys[i]: i for i in reversed(np.flatnonzero(np.isclose(angle, side * STRAIGHT)).tolist())}

    def base(i: int) -> float:
        if keys[i] not in ends:
            raise NotApplicable(f"{keys[i][0]}: no run at {STRAIGHT:g} deg")
        return float(draft.value[ends[keys[i]]])

    return base
