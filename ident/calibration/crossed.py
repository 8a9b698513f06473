"""Cross-validation of a calibration: each maneuver predicted by what the others teach.

Evidence asks what the training maneuvers need; this asks what is of use to one that was not trained on. A maneuver is
left out with all of its sources, for two records of one maneuver tell of one another (leave-one-group-out; Stone 1974,
Journal of the Royal Statistical Society B 36, 111).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ident.calibration.estimate import Estimate, left_out
from ident.calibration.problem import Channel, Problem
from sim.files.errors import InputError


@dataclass(frozen=True)
class CrossedSeries:
    """One training series, predicted by a calibration on the other maneuvers.

    Attributes
    ----------
    case, source, channel : Of the reference.
    uncalibrated : RMSE with every multiplier at its prior mean, in the unit of the reference.
    left_out : RMSE with the multipliers that the other maneuvers give.
    trained : RMSE of the calibration on all of them.

    Examples
    --------
    >>> import ident
    >>> ident.CrossedSeries("zigzag", "TRIAL", "psi", uncalibrated=2.0, left_out=1.0, trained=0.5).gain
    0.5
    """

    case: str
    source: str
    channel: str
    uncalibrated: float
    left_out: float
    trained: float

    @property
    def gain(self) -> float:
        """Error of the prediction on that without any calibration; below one where the other maneuvers help."""
        return self.left_out / self.uncalibrated


def mean_gains(crossed: Iterable[CrossedSeries]) -> dict[tuple[str, str], float]:
    """Geometric mean of the gains by case and source, then over all series (key of two empty texts).

    Example
    -------
    >>> one = CrossedSeries("zigzag", "TRIAL", "psi", 2.0, 1.0, 0.5)
    >>> mean_gains([one])
    {('zigzag', 'TRIAL'): 0.5, ('', ''): 0.5}
    """
    series = list(crossed)
    gains: dict[tuple[str, str], list[float]] = {}
    for one in series:
        gains.setdefault((one.case, one.source), []).append(one.gain)
    gains["", ""] = [one.gain for one in series]
    return {key: float(np.exp(np.mean(np.log(found)))) for key, found in gains.items()}


def maneuvers(task: Problem) -> list[str]:
    """Names of the maneuvers that a problem trains on; raises ``InputError`` where there are not two to cross."""
    names = list(dict.fromkeys(c.key[0] for c in task.channels))
    if len(names) < 2:
        raise InputError("--cross-validate", f"training on {names[0]} alone", "a file that trains on two maneuvers")
    return names


def cross_validated(
    task: Problem,
    whole: Estimate,
    workers: int | None = None,
    each: Callable[[str], None] = lambda text: None,
) -> list[CrossedSeries]:
    """Calibrate without each maneuver in turn and fly what was left out.

    Parameters
    ----------
    task, whole : A problem of two maneuvers or more, and its optimum.
    workers : Threads; all cores when None. The result does not depend on it.
    each : Called with a line of text before each maneuver.

    Returns
    -------
    One a training series, in their order.

    Raises
    ------
    InputError
        For a problem of one maneuver.
    """
    before = task.rms(task.mean)
    found: dict[tuple[str, str, str], float] = {}
    for name in maneuvers(task):

        def dropped(channel: Channel, name: str = name) -> bool:
            return channel.key[0] == name

        each(f"cross-validation: without {name}")
        found |= left_out(task, whole, dropped, workers)[1]
    return [CrossedSeries(*key, before[key], found[key], whole.rms[key]) for key in before]
