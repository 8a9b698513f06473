"""Which prior decides what a maneuver does: Sobol' indices of the groups of a calibration, by SALib.

Multipliers are drawn from their priors, which are independent of one another, by Saltelli's scheme on a Sobol'
sequence (Saltelli et al. 2010, Computer Physics Communications 181, 259). A channel is a function of time; its share
along the direction in which the flights differ most is what is analysed (Campbell, McKay and Williams 2006,
Reliability Engineering and System Safety 91, 1468). Errors are SALib's bootstrap at 68 %.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.calibration.problem import Problem
from sim.files.errors import InputError
from sim.files.extras import library

Array = NDArray[np.float64]

# Standard deviations from the mean at which a prior is cut.
_REACH = 5.0
# Level of the errors: one standard deviation.
_LEVEL = 0.6827


@dataclass(frozen=True)
class Share:
    """What one group contributes to the variance of one channel.

    Attributes
    ----------
    first, first_error : By itself, and the standard error.
    total, total_error : With all that it does together with others.
    """

    first: float
    first_error: float
    total: float
    total_error: float


@dataclass(frozen=True)
class Sensitivity:
    """What decides one channel of one case.

    Attributes
    ----------
    case, channel : Which.
    along : Share of the variance over the record that lies along its main direction.
    groups : Name of a group -> its shares.
    """

    case: str
    channel: str
    along: float
    groups: dict[str, Share]


def salib() -> tuple[Any, Any]:
    """Sampling and analysis of SALib.

    Raises
    ------
    InputError
        When the extra is not installed.
    """
    drawn, analyse = (library(f"SALib.{m}.sobol", "posterior", "--sensitivity") for m in ("sample", "analyze"))
    return drawn, analyse


def design(mean: Array, sigma: Array, least: Array, base: int, seed: int) -> tuple[dict[str, Any], Array]:
    """SALib's description of independent normal unknowns, and the points to fly.

    Parameters
    ----------
    mean, sigma : (k,) of each.
    least : (k,) values that none goes below; -inf for no limit.
    base : Points of the sequence, a power of two.
    seed : Of its scrambling.

    Returns
    -------
    The description, and (base (k + 2), k) points.
    """
    low = np.maximum(least, mean - _REACH * sigma)
    bounds = np.stack([low, mean + _REACH * sigma, mean, sigma], axis=1).tolist()
    names = [str(i) for i in range(len(mean))]
    described = {"num_vars": len(mean), "names": names, "bounds": bounds, "dists": ["truncnorm"] * len(mean)}
    points = salib()[0].sample(described, base, calc_second_order=False, seed=seed)
    return described, np.asarray(points, dtype=np.float64)


def indices(described: dict[str, Any], outputs: Array, seed: int) -> list[Share]:
    """Shares of each unknown in a scalar output.

    Parameters
    ----------
    described : From ``design``.
    outputs : (points,) one a point of the design.
    seed : Of the bootstrap.
    """
    level = {"conf_level": _LEVEL, "calc_second_order": False, "seed": seed}
    analysed = salib()[1].analyze(described, np.asarray(outputs), **level)
    keys = ("S1", "S1_conf", "ST", "ST_conf")
    return [Share(*(float(analysed[key][i]) for key in keys)) for i in range(described["num_vars"])]


def main_direction(outputs: Array) -> tuple[Array, float]:
    """Scores along the direction in which (points, times) outputs differ most, and its share of their variance."""
    spread = outputs - outputs.mean(axis=0)
    _, size, directions = np.linalg.svd(spread, full_matrices=False)
    total = float(np.sum(size**2))
    return spread @ directions[0], float(size[0] ** 2 / total) if total > 0.0 else 0.0


def sensitivity(
    task: Problem,
    base: int,
    seed: int = 0,
    workers: int | None = None,
    each: Callable[[str], None] = lambda text: None,
) -> list[Sensitivity]:
    """Shares of the groups in every channel of the training cases, over their priors.

    Parameters
    ----------
    task : From ``ident.calibration.problem.problem``.
    base : Points of the sequence, a power of two; base (groups + 2) flights of each case.
    seed, workers : Of the sequence and bootstrap; threads.
    each : Called with a line of text as the work goes on.

    Raises
    ------
    InputError
        For a base that is no power of two, or when the extra ``posterior`` is not installed.
    """
    if base < 2 or base & (base - 1):
        raise InputError("--sensitivity", str(base), "a power of two from 2 on, such as 64")
    described, points = design(task.mean, task.prior, task.least, base, seed)
    # Sources of one channel differ in what they are held against, not in what is flown.
    first: dict[tuple[str, str], int] = {}
    for i, c in enumerate(task.channels):
        first.setdefault((c.key[0], c.key[2]), i)
    flown = _flown(task, points, list(first.values()), workers, each)
    names = [p.group.name for p in task.chosen]
    sensitivities = []
    for (case, channel), outputs in zip(first, flown, strict=True):
        scores, along = main_direction(outputs)
        if along == 0.0:
            continue
        shares = indices(described, scores, seed)
        sensitivities.append(Sensitivity(case, channel, along, dict(zip(names, shares, strict=True))))
    return sensitivities


def _flown(
    task: Problem, points: Array, wanted: Sequence[int], workers: int | None, each: Callable[[str], None]
) -> list[Array]:
    """(points, times) of each wanted series."""
    began, done = time.monotonic(), 0
    flights = []
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        for residuals in pool.map(task.residuals, points):
            flights.append([residuals[i] for i in wanted])
            done += 1
            left = (time.monotonic() - began) / done * (len(points) - done)
            each(f"sensitivity: flight {done} of {len(points)}; about {left:.0f} s left")
    return [np.stack(series) for series in zip(*flights, strict=True)]
