"""Pitch alone when the boat moves ahead: cross-flow in the place of runs without forward speed.

Pure pitch is turned in still water: each section meets the water square, and its flow separates as that of
a cylinder. Moving ahead the same section meets it at a few degrees, with the drag of a body at incidence (Allen and
Perkins 1951), which the campaign's own runs in heave show (``cross_flow.drag_from_drift``). The loads of runs with
forward speed stay what they are: the linear part takes what the change of the other leaves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.estimates.cross_flow import integrals, literature_drag, weighted_mean
from ident.estimates.draft import Draft, NotApplicable
from ident.estimates.turning import Given, drag_from_drift, hull_strips, states

Array = NDArray[np.float64]


def pure_pitch(draft: Draft, given: Given) -> str:
    """Pure pitch with forward speed by cross-flow, where runs have it without.

    Half of the difference to the runs without forward speed is one standard deviation of it, beside that of the
    drag coefficient: a boat that slows down comes back to those runs.

    Raises
    ------
    NotApplicable
        Without runs in pure pitch, runs in heave, or the hull's offsets.
    """
    if not draft.has("M_q|q|") or not draft.has("Z_uvw"):
        raise NotApplicable("no pure pitch, or no runs in heave to take a drag coefficient from")
    hull = hull_strips(draft, vertical=True)
    by_runs = drag_from_drift(draft, hull, "Z_uvw", "alpha", "beta")
    literature = literature_drag(hull)
    drag = weighted_mean([literature, weighted_mean(by_runs)]) if by_runs else literature
    length = draft.vehicle.particulars.length.value
    force, moment = (float(x[0]) for x in integrals(hull, 0.0))
    # w - x q = -x q: the force turns its sign.
    for pure, arm, unit in (("Z_q|q|", "Z_uq", force / length**4), ("M_q|q|", "M_uq", -moment / length**5)):
        _by_cross_flow(draft, given, pure, arm, drag, unit)
    text = f"Cd {drag[0]:.2f} +- {drag[1]:.2f}"
    if by_runs:
        runs = weighted_mean(by_runs)
        text += (
            f" (runs in heave {runs[0]:.2f} +- {runs[1]:.2f}, literature {literature[0]:.2f} +- {literature[1]:.2f})"
        )
    return text


def _by_cross_flow(draft: Draft, given: Given, pure: str, arm: str, drag: tuple[float, float], unit: float) -> None:
    """One load of pure pitch, and the linear part that keeps the totals of the runs with forward speed."""
    still, linear = draft.where([_plain(pure)]), draft.where([arm])
    if not still.any():
        return
    rate, before = draft.axis("q"), draft.value.copy()
    word = f"pure_pitch Cd {drag[0]:.2f}"
    gap = np.where(still, before - drag[0] * unit, 0.0)
    draft.replace(still, np.full(len(still), drag[0] * unit), word)
    draft.spread("pure_pitch drag", np.where(still, drag[1] * unit, 0.0))
    draft.spread("pure_pitch with forward speed", 0.5 * gap)
    speed, q = states(draft, linear, given, "uq")
    known = linear & np.isfinite(speed)
    if known.any():
        order = np.argsort(rate[still])
        signed = np.sign(draft.axis("uq")) * q
        turned = np.interp(signed[known], rate[still][order], gap[still][order])
        change = np.zeros(len(linear))
        change[known] = turned * (q * draft.vehicle.particulars.length.value / speed)[known]
        draft.shift(known, change, word)


def _plain(name: str) -> str:
    """A coefficient's name as a shell pattern that matches it alone."""
    return "".join(f"[{c}]" if c in "*?[" else c for c in name)
