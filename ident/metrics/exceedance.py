"""How often a motion in irregular seas passes a level, and its extreme in N hours.

Counted in the record, and predicted by Rice (1944) for a Gaussian process of its mean, m0 and
m2. The sail top above a depth (broaching) is the depth D0 below that level.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ident.metrics.seaway import Statistics, upcrossings
from sim.files.errors import InputError

Side = Literal["above", "below"]

_EULER = 0.5772
_HOUR = 3600.0


@dataclass(frozen=True)
class Exceedance:
    """How often a channel crosses a level, outwards.

    Attributes
    ----------
    level : In the channel's unit; side : ``below`` or ``above`` it is out.
    count : Crossings counted; per_hour, per_hour_stderr : as a rate, error of a Poisson count.
    predicted, predicted_stderr : Rice's rate a hour from mean, m0 and m2, with the errors of
        mean and m0.
    share : Of the time spent beyond the level.
    """

    level: float
    side: Side
    count: int
    per_hour: float
    per_hour_stderr: float
    predicted: float
    predicted_stderr: float
    share: float


def rice_rate(of: Statistics, level: float) -> float:
    """Crossings of a level a hour in one direction, of a Gaussian process (Rice 1944, 3.3-11).

    sqrt(m2/m0)/(2 pi) exp(-(level - mean)^2 / (2 m0)), with m0 of the record and m2 of its
    spectrum. Of a narrow-band process it is also the rate of maxima beyond the level (Rayleigh).
    """
    away = (level - of.mean) / of.sigma
    return _HOUR / of.rice_period * math.exp(-0.5 * away**2)


def exceedances(of: Statistics, levels: Sequence[float], side: Side = "below") -> list[Exceedance]:
    """How often a channel goes beyond levels: counted, and predicted by Rice.

    The sail top above a depth, broaching, is D0 ``below`` the level.

    Parameters
    ----------
    of : Statistics of the channel.
    levels : In the channel's unit.
    side : Which side of the level is out.
    """
    hours = (of.end - of.start) / _HOUR
    sense = -1.0 if side == "below" else 1.0
    series = of.trend + of.deviation
    result = []
    for level in map(float, levels):
        beyond = sense * (series - level)
        count = int(upcrossings(beyond).size)
        rate = rice_rate(of, level)
        away = (level - of.mean) / of.sigma
        # d ln(rate) = away / sigma d(mean) + away^2 / sigma d(sigma).
        relative = math.hypot(away * of.mean_stderr, away**2 * of.sigma_stderr) / of.sigma
        result.append(
            Exceedance(
                level=level,
                side=side,
                count=count,
                per_hour=count / hours,
                per_hour_stderr=math.sqrt(count) / hours,
                predicted=rate,
                predicted_stderr=rate * relative,
                share=float((beyond > 0.0).mean()),
            )
        )
    return result


def extreme(of: Statistics, hours: float, side: Side = "below", risk: float = 0.01) -> dict[str, float]:
    """The extreme of N hours of a Gaussian process by Rice's rate.

    With n = hours / zero-crossing period crossings: most probable mean +- sigma sqrt(2 ln n);
    expected, further by Euler's constant / sqrt(2 ln n); and the level that is passed with
    probability ``risk`` (Poisson crossings; Ochi 1998, section 6).

    Parameters
    ----------
    of : Statistics of the channel.
    hours : Duration N [h].
    side : ``below`` gives the lowest value.
    risk : Probability, between 0 and 1.

    Raises
    ------
    InputError
        For a risk out of range, or a duration of less than three waves.
    """
    if not 0.0 < risk < 1.0:
        raise InputError("extreme, risk", f"{risk:g}", "between 0 and 1")
    n = hours * _HOUR / of.rice_period
    if not n > 3.0:
        raise InputError("extreme, hours", f"{hours:g}", f"more than {3.0 * of.rice_period / _HOUR:.2g}")
    sense = -1.0 if side == "below" else 1.0
    root = math.sqrt(2.0 * math.log(n))
    reduced = {"most_probable": root, "expected": root + _EULER / root}
    reduced["at_risk"] = math.sqrt(2.0 * math.log(max(n / -math.log1p(-risk), 1.0)))
    return {k: of.mean + sense * of.sigma * v for k, v in reduced.items()} | {"hours": hours, "risk": risk}
