"""Water that is not the same at every depth, and a hull that it presses together. Compiled, and for a record."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.compiled import inner
from sim.kernel.layout import COMPRESSIBILITY, LAYERS, LOADS, N_LAYERS, Model


@inner
def scale_by_depth(m: np.ndarray, w: np.ndarray, z: float, s: np.ndarray) -> float:
    """Scale the loads in the scratch by the density at a depth; share of the buoyancy that the hull has there.

    Between two depths the density is linear, beyond them held. The hull loses ``COMPRESSIBILITY`` of its
    volume a metre. The added mass stays that of the density the case gives.

    Parameters
    ----------
    z : Depth of the body origin [m].
    """
    count, i = w[N_LAYERS], 0
    while i < count and z >= m[LAYERS + 2 * i]:
        i += 1
    ratio = m[LAYERS + 2 * max(i - 1, 0) + 1]
    if 0 < i < count:
        at = LAYERS + 2 * (i - 1)
        ratio += (z - m[at]) / (m[at + 2] - m[at]) * (m[at + 3] - m[at + 1])
    for j in range(6):
        s[LOADS + j] *= ratio
    return ratio * (1.0 - m[COMPRESSIBILITY] * z)


def shares_at(model: Model, z: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Shares of the loads and of the buoyancy at depths, as ``scale_by_depth`` takes them.

    Parameters
    ----------
    z : (n,) depths of the body origin [m].
    """
    count = int(model.whole[N_LAYERS])
    if not count:
        return np.ones_like(z), np.ones_like(z)
    depths, ratios = model.real[LAYERS : LAYERS + 2 * count].reshape(count, 2).T
    ratio = np.interp(z, depths, ratios)
    return ratio, ratio * (1.0 - model.compressibility * z)
