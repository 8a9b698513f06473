"""Guidance: what a boat should do to follow a path, from where it is."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.files.errors import InputError

Array = NDArray[np.float64]


class LineOfSight:
    """Follow a path of straight legs by looking ahead along it, the L1 law.

    The point looked at is where the path leaves a circle of radius ``ahead`` around the boat; eta is
    the angle from the velocity over ground to it. A turn of rate 2 U / ahead sin(eta) is the circle
    through boat and point that is tangent to the velocity (Park, Deyst and How 2004, Eq. (1) over U).

    Parameters
    ----------
    legs : (k, 2) corners of the path, north and east [m], two or more.
    ahead : How far it looks [m].

    Raises
    ------
    InputError
        For a path without a leg, corners that are one, or a distance that is not positive.

    References
    ----------
    Park, S., Deyst, J. and How, J. P., "A new nonlinear guidance logic for trajectory tracking",
    AIAA Guidance, Navigation and Control Conference, AIAA 2004-4900, 2004.

    Examples
    --------
    >>> import ident
    >>> import numpy as np
    >>> path = ident.LineOfSight([(0.0, 0.0), (1000.0, 0.0)], ahead=100.0)
    >>> state = np.zeros(12)
    >>> state[[0, 6, 7]] = 5.0, 200.0, 60.0  # heading north, 60 m east of the leg
    >>> round(float(path.yaw_rate(state)), 6), float(path.offset(state))
    (-0.06, 60.0)
    """

    def __init__(self, legs: ArrayLike, ahead: float) -> None:
        self.legs, self.ahead = np.asarray(legs, dtype=float), float(ahead)
        if self.legs.ndim != 2 or self.legs.shape[1:] != (2,) or len(self.legs) < 2 or not np.isfinite(self.legs).all():
            raise InputError(
                "path, legs", f"an array of shape {self.legs.shape}", "two corners or more, north and east"
            )
        if (np.abs(np.diff(self.legs, axis=0)).sum(axis=1) == 0.0).any():
            raise InputError("path, legs", "two corners in one place", "corners apart from each other")
        if not (self.ahead > 0.0 and np.isfinite(self.ahead)):
            raise InputError("path, ahead", f"{ahead}", "a positive distance [m]")

    def offset(self, state: Array) -> Array:
        """Distance from the nearest leg [m], positive to the starboard of its direction.

        Parameters
        ----------
        state : (..., 12).
        """
        return np.asarray(self._nearest(state)[1])

    def yaw_rate(self, state: Array) -> Array:
        """Yaw rate that leads back to the path and along it [rad/s], positive to starboard.

        Parameters
        ----------
        state : (..., 12).
        """
        state = np.asarray(state, dtype=float)
        point = self._point(state)
        phi, theta, psi = (state[..., k] for k in (9, 10, 11))
        u, v, w = (state[..., k] for k in (0, 1, 2))
        # Velocity through the water in the horizontal plane, Euler angles 3-2-1.
        along = np.cos(theta) * u + np.sin(theta) * (np.sin(phi) * v + np.cos(phi) * w)
        across = np.cos(phi) * v - np.sin(phi) * w
        course = psi + np.arctan2(across, along)
        bearing = np.arctan2(point[..., 1] - state[..., 7], point[..., 0] - state[..., 6])
        eta = np.remainder(bearing - course + np.pi, 2.0 * np.pi) - np.pi
        speed = np.hypot(along, across)
        # Beyond a right angle the law would turn less: it turns as fast as it can there.
        return np.asarray(2.0 * speed / self.ahead * np.sin(np.clip(eta, -0.5 * np.pi, 0.5 * np.pi)))

    def _nearest(self, state: Array) -> tuple[Array, Array, Array]:
        """Nearest leg, offset from it and length along it."""
        here = np.asarray(state, dtype=float)[..., None, 6:8]
        start, leg = self.legs[:-1], np.diff(self.legs, axis=0)
        length = np.hypot(leg[:, 0], leg[:, 1])
        unit = leg / length[:, None]
        apart = here - start
        along = np.clip((apart * unit).sum(axis=-1), 0.0, length)
        across = unit[:, 0] * apart[..., 1] - unit[:, 1] * apart[..., 0]
        gap = np.linalg.norm(apart - along[..., None] * unit, axis=-1)
        k = gap.argmin(axis=-1)

        def chosen(values: Array) -> Array:
            return np.asarray(np.take_along_axis(values, k[..., None], axis=-1)[..., 0])

        return k, chosen(across), chosen(along)

    def _point(self, state: Array) -> Array:
        """The point looked at: the last that is ``ahead`` away, on the legs from the nearest on."""
        k, offset, along = self._nearest(state)
        leg = np.diff(self.legs, axis=0)
        length = np.hypot(leg[:, 0], leg[:, 1])
        begun = np.concatenate([[0.0], np.cumsum(length)])
        reach = np.sqrt(np.maximum(self.ahead**2 - offset**2, 0.0))
        wanted = begun[k] + along + reach
        on = np.clip(np.searchsorted(begun, wanted, side="right") - 1, 0, len(leg) - 1)
        # Past its end the last leg goes on.
        return np.asarray(self.legs[on] + ((wanted - begun[on]) / length[on])[..., None] * leg[on])
