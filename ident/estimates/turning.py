"""Turning with forward speed: cross-flow of drift and yaw together, pure yaw, even loads.

Three things that the runs of most campaigns do not say:

* what drift and yaw do together (``cross_flow.coupling``), with a drag coefficient from the campaign's own
  runs in drift and from the literature;
* pure yaw when the boat moves ahead, where the campaign has none of its own: cross-flow again. The loads of the
  rotating arm stay what they are, and the linear part is what cross-flow leaves of them;
* loads that the mirror makes even in r. They vanish as r^2; a coefficient of u|r| that does not
  vanish with r is a load linear in |r|, which no flow about a symmetric boat has.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ident.estimates.cross_flow import Strips, coupling, drift_drag, integrals, literature_drag, strips, weighted_mean
from ident.estimates.draft import Draft, Mask, NotApplicable
from sim.files.errors import InputError

Array = NDArray[np.float64]

_EVEN = ("X_u|r|", "Z_u|r|", "M_u|r|")
# Standard errors by which a coefficient of an even load must differ from zero at r = 0.
_EVIDENT = 3.0
# Nodes of the coupling along the hull, and one beyond each end where it is a straight line.
_NODES = 24


@dataclass(frozen=True)
class Shared:
    """An error that runs have in common.

    Attributes
    ----------
    name : As the campaign says.
    relative : Size, of the load; None where ``offset`` states it.
    runs, outputs : Which share it; all of them when empty.
    offset : Output -> prime load of one standard deviation, program frame; all of one unknown.
    """

    name: str
    relative: float | None
    runs: frozenset[str]
    outputs: tuple[str, ...]
    offset: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Given:
    """What estimates need beside the rows.

    Attributes
    ----------
    speed : Run of the rotating arm -> speed ahead [m/s].
    pure_yaw : Share of pure yaw taken off by the source and its deviation; None when pure yaw was measured.
    shared : Errors that runs have in common.
    complete : Whether a published set is completed from the vehicle's lines.
    propelled : Whether loads of planes were measured with the propeller at work.
    """

    speed: dict[str, float] = field(default_factory=dict)
    pure_yaw: tuple[float, float] | None = None
    shared: tuple[Shared, ...] = ()
    complete: bool = False
    propelled: bool = False


def hull_strips(draft: Draft, vertical: bool = False) -> Strips:
    """Sections of the draft's hull; raises ``NotApplicable`` without its offsets."""
    try:
        return strips(draft.vehicle, vertical)
    except InputError as error:
        raise NotApplicable(str(error)) from error


def drag_from_drift(draft: Draft, hull: Strips, term: str, axis: str, other: str) -> list[tuple[float, float]]:
    """Cross-flow drag coefficients by the runs in drift, one a speed and depth.

    Parameters
    ----------
    draft, hull : Rows; sections across this motion.
    term, axis, other : ``Y_uvw``, ``beta``, ``alpha``, or the vertical ones.
    """
    rows = draft.rows
    angle, across = draft.axis(axis), draft.axis(other)
    chosen = draft.where([term]) & (angle != 0.0) & (across == 0.0)
    runs = rows[chosen & rows["origin"].eq("measured").to_numpy()]
    area = hull.moment_of_area(0) / draft.vehicle.particulars.length.value**2
    drags = []
    for _, group in runs.groupby(["speed_mps", "depth_m"]):
        one = drift_drag(
            np.radians(group[f"{axis}_deg"].to_numpy(float)),
            group["value"].to_numpy(float),
            group["stderr"].to_numpy(float),
        )
        if one is not None:
            drags.append((-one[0] / area, one[1] / area))
    return drags


def _add_coupling(draft: Draft, hull: Strips, drag: tuple[float, float], vertical: bool) -> None:
    """Rows of the coupling in one plane; the drag coefficient's error is shared."""
    length = draft.vehicle.particulars.length.value
    beyond = 0.1 * length
    # Rotation alone is a node: there the coupling vanishes exactly.
    sides = np.linspace(hull.x.min() - beyond, 0.0, _NODES // 2), np.linspace(0.0, hull.x.max() + beyond, _NODES // 2)
    pivots = np.unique(np.concatenate(sides))
    force, moment = coupling(hull, -pivots if vertical else pivots)
    # In the vertical plane w - x q = -(x - w/q) q: the force turns its sign, and M = -x Z turns it back.
    per_drag = {
        ("Z_cross" if vertical else "Y_cross"): (force if vertical else -force) / length**4,
        ("M_cross" if vertical else "N_cross"): -moment / length**5,
    }
    depth = float(draft.axis("D0")[draft.where(["*_uq", "*_ur"])].max()) if draft.has("N_ur", "M_uq") else 0.0
    axis = "w/q" if vertical else "v/r"
    for term, unit in per_drag.items():
        points = [{axis: float(x), "D0": depth} for x in pivots]
        new = draft.add(term, points, list(drag[0] * unit), f"cross_flow Cd {drag[0]:.2f}")
        change = np.zeros(len(new))
        change[new] = drag[1] * unit
        draft.spread(_unknown(vertical), change)


def _unknown(vertical: bool) -> str:
    return "cross_flow drag " + ("vertical" if vertical else "horizontal")


def cross_flow(draft: Draft, given: Given) -> str:
    """What cross-flow adds where drift and rotation come together, in each plane without such runs.

    Raises
    ------
    NotApplicable
        Without the hull's offsets or runs in drift, or when runs give the coupling of both planes.
    """
    said = []
    for vertical, runs, term, axis, other in (
        (False, ("Y_v|r|", "N_|v|r"), "Y_uvw", "beta", "alpha"),
        (True, ("Z_w|q|", "M_|w|q"), "Z_uvw", "alpha", "beta"),
    ):
        if draft.has(*runs) or not draft.has(term):
            continue
        hull = hull_strips(draft, vertical)
        literature, by_runs = literature_drag(hull), drag_from_drift(draft, hull, term, axis, other)
        # The Birge ratio looks at the runs alone: the literature's range is not a repeat of them.
        drag = weighted_mean([literature, weighted_mean(by_runs)]) if by_runs else literature
        _add_coupling(draft, hull, drag, vertical)
        text = f"{'vertical' if vertical else 'horizontal'} Cd {drag[0]:.2f} +- {drag[1]:.2f}"
        if by_runs:
            text += f" (runs in drift {weighted_mean(by_runs)[0]:.2f} +- {weighted_mean(by_runs)[1]:.2f}"
            text += f", literature {literature[0]:.2f} +- {literature[1]:.2f})"
        said.append(text)
        if not vertical and given.pure_yaw is not None:
            said.append(_pure_yaw(draft, hull, drag, given))
    if not said:
        raise NotApplicable("runs give drift with rotation in both planes, or there is no drift")
    return "; ".join(said)


def states(draft: Draft, chosen: Mask, given: Given, axis: str = "ur") -> tuple[Array, Array]:
    """Speed ahead and rate of rows of the rotating arm, by their runs; NaN where unknown."""
    speed = np.full(len(chosen), np.nan)
    for i in np.flatnonzero(chosen):
        known = [given.speed[r] for r in str(draft.rows["runs"].iloc[i]).split() if r in given.speed]
        if known:
            speed[i] = float(np.mean(known))
    return speed, np.abs(draft.axis(axis)) / speed


def _pure_yaw(draft: Draft, hull: Strips, drag: tuple[float, float], given: Given) -> str:
    """Pure yaw by cross-flow with forward speed, and the linear part it leaves at the rotating arm."""
    assert given.pure_yaw is not None
    length, (share, sigma) = draft.vehicle.particulars.length.value, given.pure_yaw
    whole = [float(x[0]) for x in integrals(hull, 0.0)]
    rate = draft.axis("r")
    for arm, pure, unit in (("Y_ur", "Y_r|r|", -whole[0] / length**4), ("N_ur", "N_r|r|", -whole[1] / length**5)):
        linear, still = draft.where([arm]), draft.where([pure])
        if not linear.any() or not still.any():
            continue
        speed, r = states(draft, linear, given)
        order = np.argsort(rate[still])
        turned = np.interp(r[linear], rate[still][order], draft.value[still][order])
        lever = (r * length / speed)[linear]
        change = np.zeros(len(linear))
        # The runs' totals again, as published; then what the source may have taken off; then cross-flow off.
        change[linear] = ((1.0 + share) * turned - drag[0] * unit) * lever
        draft.shift(linear, change, f"pure yaw by cross_flow Cd {drag[0]:.2f}")
        reading = np.zeros(len(linear))
        reading[linear] = sigma * turned * lever
        draft.spread("pure yaw taken off by the source", reading)
        draft.replace(still, np.full(len(still), drag[0] * unit), f"cross_flow Cd {drag[0]:.2f}")
        by_drag = np.zeros(len(linear))
        by_drag[still] = drag[1] * unit
        by_drag[linear] = -drag[1] * unit * lever
        draft.spread(_unknown(False), by_drag)
    return f"pure yaw by cross-flow, {share:.1f} +- {sigma:.1f} of pure pitch added back to the rotating arm"


def even_loads(draft: Draft, given: Given) -> str:
    """Loads linear in |r| that the mirror makes even: no load about a symmetric boat, so zero within half of them.

    Raises
    ------
    NotApplicable
        When no such load is in the rows.
    """
    said = []
    for term in _EVEN:
        chosen = draft.where([term])
        if chosen.sum() < 3:
            continue
        r = np.abs(draft.axis("ur")[chosen])
        error = draft.rows["stderr"].to_numpy(float)[chosen]
        value = draft.value[chosen]
        if np.any(error <= 0.0) or np.unique(r).size < 2:
            continue
        form = np.stack([np.ones(r.size), r], axis=1) / error[:, None]
        inverse = np.linalg.pinv(form.T @ form)
        at_rest = (inverse @ form.T @ (value / error))[0]
        if abs(at_rest) < _EVIDENT * np.sqrt(inverse[0, 0]):
            continue
        change = np.where(chosen, draft.value, 0.0)
        draft.replace(chosen, np.zeros(len(chosen)), "even_loads: zero")
        draft.spread(f"even load {term}", 0.5 * change)
        said.append(f"{term} {at_rest:.2g} at r = 0")
    if not said:
        raise NotApplicable("no even load that stays at small yaw rates")
    return "linear in |r|: " + ", ".join(said)
