"""An angle and its measured rate taken together, the scale and the offset of the rate unknown.

A rate regressed on the rate of a smooth path reads too small a slope, because that path has errors of its own
(Fuller 1987, Measurement Error Models, section 1.1). Scale and offset are therefore unknowns beside the path,
and what they are known to is an error that all samples share.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.timeseries.noise import Samples, product
from ident.timeseries.smoothing import SmoothPath, smooth

Array = NDArray[np.float64]


def smooth_with_rate(angle: Samples, rate: Samples, scale_sigma: float) -> SmoothPath:
    """The path through an angle and its rate: a * rate - b is the rate of the path, with a and b unknown.

    Parameters
    ----------
    angle : Samples of the path, with their standard error.
    rate : Samples of its rate as measured, with their standard error.
    scale_sigma : What a is known to beforehand, about 1; b is not known.

    Returns
    -------
    SmoothPath through ``angle`` and the rate at the likeliest a and b, with the errors of both among ``shared``.

    Examples
    --------
    >>> t = np.linspace(0.0, 60.0, 241)
    >>> angle = Samples(t, np.sin(t / 5.0), 0, 0.01)
    >>> rate = Samples(t, 0.2 * np.cos(t / 5.0) + 0.03, 1, 0.001)
    >>> path = smooth_with_rate(angle, rate, 0.02)
    >>> bool(abs(path(30.0, 1) - 0.2 * np.cos(6.0)) < 0.005)
    True
    """
    as_measured = smooth([angle, rate])
    ones = replace(rate, value=np.ones_like(rate.value))
    # The path is linear in what is measured: of the angle, of the rate, and of a constant rate.
    parts = (
        (replace(angle, value=angle.value - as_measured.centre), replace(rate, value=np.zeros_like(rate.value))),
        (replace(angle, value=np.zeros_like(angle.value)), rate),
        (replace(angle, value=np.zeros_like(angle.value)), replace(ones, value=-ones.value)),
    )
    right, solved = zip(*(as_measured.response(part) for part in parts), strict=True)
    left = np.array(
        [
            [sum(map(product, p, q)) - float(r @ s) for q, s in zip(parts, solved, strict=True)]
            for p, r in zip(parts, right, strict=True)
        ]
    )
    precision = left[1:, 1:] + np.diag([scale_sigma**-2.0, 0.0])
    covariance = np.linalg.inv(precision)
    a, b = covariance @ (np.array([scale_sigma**-2.0, 0.0]) - left[1:, 0])
    path = smooth([angle, replace(rate, value=a * rate.value - b)])
    factor = np.linalg.cholesky(covariance)
    away = np.array([path.response(part)[1] for part in parts[1:]])
    return replace(path, shared=tuple(factor.T @ away))
