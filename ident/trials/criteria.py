"""Criteria of IMO resolution MSC.137(76), Standards for ship manoeuvrability (2002), where they apply.

They are written for ships of 100 m and more in deep, calm water at full load and test speed; a report on
another boat quotes them for comparison.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ident.trials.maneuvers import Maneuver
from ident.trials.measure import Value


@dataclass(frozen=True)
class Criterion:
    """One criterion: the metric, its limit in the metric's unit, and whether it is met.

    ``met`` is None where value and limit are nearer than two standard errors.
    """

    metric: str
    paragraph: str
    limit: float
    value: Value

    @property
    def met(self) -> bool | None:
        """Whether the value is below the limit, beyond two standard errors."""
        away = self.limit - self.value.value
        return None if abs(away) < 2.0 * self.value.sigma else away > 0.0

    def to_dict(self) -> dict[str, Any]:
        """For a machine to read."""
        return {"metric": self.metric, "paragraph": self.paragraph, "limit": self.limit, "met": self.met}


def first_overshoot_10(length_over_speed: float) -> float:
    """Largest first overshoot of the 10/10 zigzag [deg], 5.3.3.1; L/V in seconds."""
    return float(np.interp(length_over_speed, [10.0, 30.0], [10.0, 20.0]))


def second_overshoot_10(length_over_speed: float) -> float:
    """Largest second overshoot of the 10/10 zigzag [deg], 5.3.3.2; L/V in seconds."""
    return float(np.interp(length_over_speed, [10.0, 30.0], [25.0, 40.0]))


def criteria(maneuver: Maneuver, metrics: dict[str, Value], length: float | None) -> list[Criterion]:
    """The criteria that a maneuver answers.

    Parameters
    ----------
    maneuver, metrics : What was done and measured.
    length : Length between perpendiculars [m]; without it only the 20/20 zigzag has a criterion.
    """
    limits: list[tuple[str, str, float]] = []
    angles = (maneuver.planes, maneuver.check) if maneuver.kind == "zigzag" else None
    speed = metrics.get("approach_speed_mps")
    if angles and angles[1] == 20.0 and angles[0] in (20.0, None):
        limits.append(("overshoot_1_deg", "5.3.3.3", 25.0))
    if angles and angles[1] == 10.0 and angles[0] in (10.0, None) and length and speed and speed.value > 0.0:
        ratio = length / speed.value
        limits.append(("overshoot_1_deg", "5.3.3.1", first_overshoot_10(ratio)))
        limits.append(("overshoot_2_deg", "5.3.3.2", second_overshoot_10(ratio)))
    if maneuver.kind == "turning_circle" and length:
        limits.append(("advance_90_heading_m", "5.3.1", 4.5 * length))
        limits.append(("tactical_diameter_180_heading_m", "5.3.1", 5.0 * length))
    if maneuver.kind == "stopping" and length:
        limits.append(("track_reach_m", "5.3.4", 15.0 * length))
    return [Criterion(m, p, limit, metrics[m]) for m, p, limit in limits if m in metrics]
