"""Errors of coefficients beyond the rates of their runs, growing with the distance in the logarithm.

A coefficient that holds its last value beyond the runs is wrong by what its trend goes on to change. The trend
over the runs, in the logarithm of the rate, continued to the rates of a maneuver, is taken as one standard
deviation; but no more than half of the value, for a damping load does not turn its sign.
"""

from __future__ import annotations

import numpy as np

from ident.estimates.draft import Draft, NotApplicable
from sim.boat.catalogue import Term
from sim.boat.parts import vehicle_terms

# Rates of a tight maneuver over speed and length, and speed across over speed.
_RATE, _ACROSS = 0.5, 0.2
# Largest error relative to the value.
_MOST = 0.5


def reach(axis: str, speed: float, length: float) -> float | None:
    """Largest value of a rate axis in a tight maneuver; None for another axis.

    Parameters
    ----------
    axis : ``p``, ``q``, ``r``, or a product with a speed such as ``ur`` or ``wq``.
    speed, length : Of the boat [m/s], [m].
    """
    rate = _RATE * speed / length
    if axis in ("p", "q", "r"):
        return rate
    if len(axis) == 2 and axis[0] in "uvw" and axis[1] in "pqr":
        return rate * speed * (1.0 if axis[0] == "u" else _ACROSS)
    return None


def trend_error(x: np.ndarray, value: np.ndarray, far: float) -> float:
    """What the trend of a coefficient over ln x changes from its last run to ``far``, at most half of the last value.

    Example
    -------
    >>> float(round(trend_error(np.array([1.0, np.e]), np.array([1.0, 1.1]), np.e**3), 6))
    0.2
    """
    if far <= x.max() or np.unique(x).size < 2:
        return 0.0
    slope = np.polyfit(np.log(x), value, 1)[0]
    last = float(np.mean(value[np.isclose(x, x.max())]))
    return float(min(abs(slope) * np.log(far / x.max()), _MOST * abs(last)))


def _axis(term: Term, speed: float, length: float) -> tuple[str, float] | None:
    for axis in term.axes:
        far = reach(axis, speed, length)
        if far is not None:
            return axis, far
    return None


def extrapolation(draft: Draft) -> str:
    """Errors of the outermost values of coefficients over a rate.

    Raises
    ------
    NotApplicable
        When no coefficient is tabulated over a rate, or all reach far enough.
    """
    length = draft.vehicle.particulars.length.value
    speed = float(np.nanmax(draft.axis("U"))) if np.isfinite(draft.axis("U")).any() else np.nan
    said = []
    for term in vehicle_terms(draft.vehicle):
        reached = _axis(term, speed, length) if np.isfinite(speed) else None
        if reached is None or not draft.has(term.name):
            continue
        chosen = draft.where([_escaped(term.name)])
        axis, far = reached
        place = np.abs(draft.axis(axis))
        inside = chosen & (place > 0.0)
        if not inside.any():
            continue
        error = trend_error(place[inside], draft.value[inside], far)
        if error <= 0.0:
            continue
        outermost = inside & np.isclose(place, place[inside].max())
        draft.spread(f"beyond the runs {term.name}", np.where(outermost, error, 0.0))
        said.append(term.name)
    if not said:
        raise NotApplicable("no coefficient over a rate that ends before the rates of a maneuver")
    return ", ".join(said)


def _escaped(name: str) -> str:
    """A coefficient's name as a shell pattern that matches it alone."""
    return "".join(f"[{c}]" if c in "*?[" else c for c in name)
