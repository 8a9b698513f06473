"""Lift of fins of small aspect ratio grows faster than their angle: cross-flow about their tips.

Whicker and Fehlner (1958, David Taylor Model Basin Report 933, Eq. [1]) measured it on a family of all-movable
surfaces::

    CL = 0.9 (2 pi) a / (cos S sqrt(a^2 / cos^4 S + 4) + 1.8) alpha + (C / a) alpha^2

with a the effective aspect ratio, S the sweep of the quarter chord, here taken for zero, and C the drag of the tip
across the flow, 0.1 + 0.7 t for a faired and 0.1 + 1.6 t for a square tip at the taper ratio t. A campaign that carries
the load of its runs at 10 deg on straight leaves the second term out. Both formulas are second-hand: the first as
public programs carry it, the second by Prestero (2001), Eq. (4.9), for faired tips, and a public program for square
ones.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ident.estimates.carry_over import FinShape
from ident.estimates.draft import Draft, NotApplicable
from ident.estimates.plane_loads import planes_of
from ident.estimates.saturation import STRAIGHT, at_straight, continued_rows
from sim.files.constants import constant

Array = NDArray[np.float64]

_SECTION, _TIP = constant("fin_section_lift"), constant("fin_tip_drag_least")
_FAIRED, _SQUARE = constant("fin_tip_drag_faired"), constant("fin_tip_drag_square")


def lift_slope(aspect: float) -> float:
    """Slope of the lift of an unswept fin at no incidence, on its area [1/rad]; Whicker and Fehlner's.

    Example
    -------
    >>> round(lift_slope(1.0), 3)
    1.401
    """
    two = 2.0 * math.pi * _SECTION
    return two * aspect / (math.sqrt(aspect**2 + 4.0) + two / math.pi)


def tip_drag(taper: float) -> tuple[float, float]:
    """Cross-flow drag of a tip of unknown form: between a faired and a square one, uniform."""
    least, most = _TIP + _FAIRED * taper, _TIP + _SQUARE * taper
    return 0.5 * (least + most), (most - least) / math.sqrt(12.0)


def bend(fin: FinShape) -> tuple[float, float]:
    """Second over first term of the lift [1/rad], and its deviation by the form of the tip."""
    mean, sigma = (x / fin.aspect / lift_slope(fin.aspect) for x in tip_drag(fin.taper))
    return mean, sigma


def grown(angle: Array | float, curved: float, straight: float = STRAIGHT) -> Array | float:
    """Lift at an angle [deg], in degrees of the straight line through the lift at ``straight``.

    Example
    -------
    >>> grown(10.0, 0.3), round(float(grown(20.0, 0.0)), 6)
    (10.0, 20.0)
    """
    return angle * (1.0 + curved * np.radians(angle)) / (1.0 + curved * np.radians(straight))


def fin_lift(draft: Draft) -> str:
    """Bend plane loads that the campaign carried on straight (quality ``lift_continued``).

    Raises
    ------
    NotApplicable
        When no load was continued, or the planes' geometry is not known.
    """
    continued = continued_rows(draft)
    if not continued.any():
        raise NotApplicable("no plane load beyond the runs (quality lift_continued)")
    planes = planes_of(draft)
    angle, base_of = np.abs(draft.axis("delta")), at_straight(draft)
    said = []
    for fin, of in ((planes.stern_fin, draft.vehicle.stern_planes), (planes.sail_fin, draft.vehicle.forward_planes)):
        chosen = continued & draft.where(["*"], [p.name for p in of])
        curved, sigma = bend(fin)
        change, by_tip = np.zeros(len(angle)), np.zeros(len(angle))
        for i in np.flatnonzero(chosen).tolist():
            slope = (draft.value[i] - base_of(i)) / (angle[i] - STRAIGHT)
            change[i] = slope * (grown(angle[i], curved) - angle[i])
            by_tip[i] = slope * (grown(angle[i], curved + 0.5 * sigma) - grown(angle[i], curved - 0.5 * sigma))
        if chosen.any():
            draft.shift(chosen, change, f"fin_lift x{grown(20.0, curved) / 20.0:.3f} at 20 deg")
            draft.spread("form of the planes' tips", by_tip)
            said.append(f"aspect ratio {fin.aspect:.2f}: x{grown(20.0, curved) / 20.0:.3f} at 20 deg")
    return "; ".join(said)
