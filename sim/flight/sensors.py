"""What instruments on board read: the plant's channels with bias and noise."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sim.files.errors import InputError
from sim.flight.plant import Plant


class Sensors:
    """Readings of a plant.

    Parameters
    ----------
    noise : Channel -> standard deviation of a reading, white from reading to reading [SI, rad].
    bias : Channel -> what is added to every reading [SI, rad].
    seed : Of the noise; the same seed gives the same readings.

    Raises
    ------
    InputError
        For a standard deviation that is negative or not finite, or a bias that is not finite.

    Examples
    --------
    >>> import ident
    >>> sensors = ident.Sensors(noise={"psi": 0.002, "z": 0.1}, bias={"z": 0.05}, seed=1)
    >>> sensors.channels
    ('psi', 'z')
    """

    def __init__(
        self, noise: Mapping[str, float], bias: Mapping[str, float] | None = None, seed: int | None = None
    ) -> None:
        for name, size in noise.items():
            if not (np.isfinite(size) and size >= 0.0):
                raise InputError(f"sensors, noise of {name}", f"{size}", "a standard deviation, zero or more")
        for name, size in (bias or {}).items():
            if not np.isfinite(size):
                raise InputError(f"sensors, bias of {name}", f"{size}", "a finite number")
        self._noise, self._bias = dict(noise), dict(bias or {})
        self._generator = np.random.default_rng(seed)

    @property
    def channels(self) -> tuple[str, ...]:
        """What is read."""
        return tuple(dict.fromkeys((*self._noise, *self._bias)))

    def read(self, plant: Plant) -> dict[str, float]:
        """One reading of every channel. Raises ``KeyError`` for a channel that the plant does not have."""
        readings = {}
        for name in self.channels:
            shown = plant[name] + self._bias.get(name, 0.0)
            readings[name] = shown + self._noise.get(name, 0.0) * float(self._generator.standard_normal())
        return readings
