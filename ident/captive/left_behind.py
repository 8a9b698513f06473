"""A moment point that stays while a body moves along an axis: what that adds to moments, and whether a record has it.

With the displacement A sin(theta) and a force F0 + F2 cos(2 theta), the arm adds A F0 - A F2/2 to the moment in phase,
where added inertia is, and A F2/2 to the third harmonic in phase. That one is nothing in a load that is a function of
the velocity and linear in the acceleration, so that a record with F2 beyond its noise shows which point was meant.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.captive.quantities import HARMONICS
from sim.files.frames import Frame

Array = NDArray[np.float64]

# Of a moment that has next to nothing in phase, this share of its swing counts as what it has there.
_LEAST = 0.05
# Motion -> axis, and moments with the force whose arm the displacement is and the sign of lever x force.
ARMS = {
    "surge": ("x", {"M": ("Z", -1.0), "N": ("Y", 1.0)}),
    "sway": ("y", {"N": ("X", -1.0), "K": ("Z", 1.0)}),
    "heave": ("z", {"M": ("X", 1.0), "K": ("Y", -1.0)}),
}


@dataclass(frozen=True)
class LeftBehind:
    """A moment of an oscillation along an axis whose point may have stayed.

    Attributes
    ----------
    motion, moment, force : What moves, the moment, and the force whose arm the displacement is.
    in_phase, own : What a point that stays adds to the moment in phase, and what the moment has there [N m].
    third, shown, error : What it adds to the third harmonic in phase, what the record has there, its standard error.
    """

    motion: str
    moment: str
    force: str
    in_phase: float
    own: float
    third: float
    shown: float
    error: float

    def verdict(self, errors: float) -> str:
        """``stays``, ``goes`` or ``""`` where the third harmonic is within so many errors of either."""
        if not abs(self.third) > 2.0 * errors * self.error:
            return ""
        share = self.shown / self.third
        return "stays" if abs(share - 1.0) < 0.5 else "goes" if abs(share) < 0.5 else ""


def left_behind(
    motion: str, amplitude: float, harmonics: dict[str, Array], covariance: dict[str, Array], frame: Frame
) -> tuple[LeftBehind, ...]:
    """What a moment point that stays would do to each moment of an oscillation.

    Parameters
    ----------
    motion, amplitude : Of the body [m].
    harmonics, covariance : Load -> (7,) in the phase of the displacement and (7, 7), campaign frame.
    frame : Of the campaign.
    """
    axis, arms = ARMS.get(motion, ("", {}))
    mean, second, third = (HARMONICS.index(k) for k in ("mean", "out2", "in3"))
    found = []
    for moment, (force, sense) in arms.items():
        if moment not in harmonics or force not in harmonics:
            continue
        turn, push = frame.sign(moment) * harmonics[moment], frame.sign(force) * harmonics[force]
        arm = sense * frame.sign(axis) * amplitude
        error = math.sqrt(covariance[moment][third, third] + (0.5 * arm) ** 2 * covariance[force][second, second])
        found.append(
            LeftBehind(
                motion=motion,
                moment=moment,
                force=force,
                in_phase=float(arm * (push[mean] - 0.5 * push[second])),
                own=max(abs(float(turn[1])), _LEAST * float(np.hypot(*turn[1:3]))),
                third=float(0.5 * arm * push[second]),
                shown=float(turn[third]),
                error=error,
            )
        )
    return tuple(found)
