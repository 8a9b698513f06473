"""What to beware of in a calibration: that it did not converge, or cannot tell what it says."""

from __future__ import annotations

import numpy as np

from ident.calibration.estimate import Estimate
from ident.calibration.posterior import Sampled
from ident.calibration.problem import Problem, contradictions
from ident.calibration.result import LeftOut

# Two multipliers whose posterior correlation is beyond this cannot be told apart.
_ALIKE = 0.9
# A multiplier whose posterior is this close to its prior was not learnt.
UNLEARNT = 0.9
# A multiplier that moves by more of its standard deviations without one source is said.
_SHIFTED = 2.0


def cautions(task: Problem, estimate: Estimate, without: list[LeftOut], drawn: Sampled | None) -> list[str]:
    """What to beware of, that it did not converge first."""
    halted = [] if estimate.converged else [f"not converged after {estimate.rounds} rounds"]
    said = halted + contradictions(task) + _shifts(task, without) + identifiability(task, estimate)
    if drawn is not None and not drawn.tells:
        said.append(f"the quadratic is not the posterior: {drawn.verdict}")
    return said


def identifiability(task: Problem, estimate: Estimate) -> list[str]:
    """Which multipliers the maneuvers cannot tell apart, and which they say nothing of."""
    names = [p.group.name for p in task.chosen]
    scale = np.outer(estimate.deviation, estimate.deviation)
    correlation = estimate.covariance / scale
    said = [
        f"{names[i]} and {names[j]} cannot be told apart: posterior correlation {correlation[i, j]:+.2f}"
        for i in range(len(names))
        for j in range(i)
        if abs(correlation[i, j]) > _ALIKE
    ]
    for name, parameter, sigma in zip(names, task.chosen, estimate.deviation, strict=True):
        if sigma > UNLEARNT * parameter.sigma:
            said.append(f"{name}: the maneuvers say next to nothing of it; it stays at its prior")
    return said


def _shifts(task: Problem, left_out: list[LeftOut]) -> list[str]:
    said = []
    for one in left_out:
        for parameter, shift in zip(task.chosen, one.shift_in_sigma, strict=True):
            if abs(shift) > _SHIFTED:
                text = f"{parameter.group.name} moves by {abs(shift):.1f} standard deviations without"
                said.append(f"contradictory data: {text} {one.case} {one.source}")
    return said
