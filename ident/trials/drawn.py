"""The channels of a record on one time grid: the most likely ones, or a draw from their posterior."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.trials.body import yaw_rate

Array = NDArray[np.float64]
Channels = dict[str, Array]
Metrics = dict[str, float | None]


@dataclass(frozen=True)
class Drawn:
    """Channels on one time grid from the execute on: the most likely ones, or a draw.

    Attributes
    ----------
    time : (n,) [s].
    values, rates : Channels and their rates, SI.
    base : Course or pitch that angles count from [rad]; None for that of the path at the execute.
    origin : North and east of the execute [m] where they are stated; None for those of the path.
    """

    time: Array
    values: Channels
    rates: Channels
    base: float | None
    origin: tuple[float, float] | None = None

    def angle(self, name: str) -> Array:
        """An angle from its base [rad]."""
        return self.values[name] - (float(self.values[name][0]) if self.base is None else self.base)

    @property
    def course(self) -> float:
        """Course at the execute: of the heading, else of the track [rad]."""
        if self.base is not None:
            return self.base
        if "psi" in self.values:
            return float(self.values["psi"][0])
        if "north" in self.values:
            return math.atan2(float(self.rates["east"][0]), float(self.rates["north"][0]))
        return 0.0

    def track(self) -> tuple[Array, Array]:
        """Along and across the course at the execute, from the place there [m]."""
        north, east = self.values["north"], self.values["east"]
        first = (float(north[0]), float(east[0])) if self.origin is None else self.origin
        dn, de = north - first[0], east - first[1]
        c, s = math.cos(self.course), math.sin(self.course)
        return c * dn + s * de, c * de - s * dn

    def horizontal(self, execute: float) -> Channels:
        """Channels ``t`` from the execute, ``psi r``, ``x y s`` of the track, and the others as they are."""
        channels: Channels = {"t": self.time - execute}
        if "psi" in self.values:
            channels |= {"psi": self.angle("psi"), "r": yaw_rate(self.values, self.rates)}
        if "north" in self.values:
            channels["x"], channels["y"] = self.track()
            steps = np.hypot(np.diff(self.values["north"]), np.diff(self.values["east"]))
            channels["s"] = np.concatenate([[0.0], np.cumsum(steps)])
        for name in ("u", "U", "phi", "theta", "z"):
            if name in self.values:
                channels[name] = self.values[name]
        return channels
