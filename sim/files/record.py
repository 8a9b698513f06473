"""One measured or simulated series: what it is of, over what, and how well it is known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Record:
    """A series of one channel, in the program frame and in SI units (angles in radians).

    Attributes
    ----------
    channel : Name as a simulation has it: ``psi``, ``r``, ``u``, ``x``, ...
    abscissa : (n,) time [s], or path length [m], growing.
    value : (n,) in ``unit``.
    unit : SI unit: ``rad``, ``rad/s``, ``m``, ``m/s``, ``1/s``, ``kg`` or ``-``.
    sigma : (n,) standard error of each value in ``unit``, or None where nothing is known of it.

    Raises
    ------
    ValueError
        When the arrays are not of one length.

    Examples
    --------
    >>> import numpy as np
    >>> heading = Record("psi", np.array([0.0, 1.0]), np.radians([0.0, 2.0]), "rad")
    >>> heading.at(0.5).round(4).item()
    0.0175
    """

    channel: str
    abscissa: Array
    value: Array
    unit: str
    sigma: Array | None = None

    def __post_init__(self) -> None:
        sizes = {len(self.abscissa), len(self.value), *([len(self.sigma)] if self.sigma is not None else [])}
        if len(sizes) > 1:
            raise ValueError(f"record {self.channel}: arrays of {sorted(sizes)} samples")

    def __len__(self) -> int:
        return len(self.value)

    def at(self, where: Array | float) -> Array:
        """Value at places of the abscissa, linearly between the samples."""
        return np.asarray(np.interp(where, self.abscissa, self.value))

    def kept(self, which: NDArray[np.bool_] | slice) -> Record:
        """Some of the samples."""
        sigma = None if self.sigma is None else self.sigma[which]
        return replace(self, abscissa=self.abscissa[which], value=self.value[which], sigma=sigma)

    def moved(self, by: float) -> Record:
        """The same with ``by`` taken off the abscissa."""
        return replace(self, abscissa=self.abscissa - by)

    @property
    def rms_sigma(self) -> float | None:
        """Root mean square of the standard errors; None where there are none."""
        return None if self.sigma is None else float(np.sqrt(np.mean(self.sigma**2)))
