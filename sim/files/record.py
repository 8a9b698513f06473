"""One measured or simulated series: what it is of, over what, and how well it is known."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Written(NamedTuple):
    """A series as its file has it: (n,) values, their unit, (n,) standard errors or None."""

    value: Array
    unit: str
    sigma: Array | None


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
    as_written : The same numbers in the file's own unit and to its last digit, where that is another:
        errors are reported in it.

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
    as_written: Written | None = None

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
        return replace(
            self,
            abscissa=self.abscissa[which],
            value=self.value[which],
            sigma=_some(self.sigma, which),
            as_written=self.as_written
            and Written(self.as_written.value[which], self.as_written.unit, _some(self.as_written.sigma, which)),
        )

    @classmethod
    def read(cls, channel: str, abscissa: Array, written: Written) -> Record:
        """A series from a file: degrees become radians, once; what is SI stays as it is."""
        value, unit, sigma = written
        if not unit.startswith("deg"):
            return cls(channel, abscissa, value, unit, sigma)
        radians = None if sigma is None else np.radians(sigma)
        return cls(channel, abscissa, np.radians(value), unit.replace("deg", "rad"), radians, written)

    @property
    def shown(self) -> Written:
        """Values, unit and standard errors as the file has them."""
        return self.as_written or Written(self.value, self.unit, self.sigma)

    def in_unit(self, unit: str) -> Written:
        """Values and standard errors in ``unit``, which is that of the file or SI, or degrees for radians."""
        if unit in (self.shown.unit, self.unit):
            return self.shown if unit == self.shown.unit else Written(self.value, self.unit, self.sigma)
        if unit != self.unit.replace("rad", "deg"):
            raise ValueError(f"record {self.channel} in {unit}, which is no unit of it")
        return Written(np.degrees(self.value), unit, None if self.sigma is None else np.degrees(self.sigma))

    def less(self, offset: float) -> Record:
        """The series less a constant in the unit that it is shown in."""
        value, unit, sigma = self.shown
        return Record.read(self.channel, self.abscissa, Written(value - offset, unit, sigma))

    def moved(self, by: float) -> Record:
        """The same with ``by`` taken off the abscissa."""
        return replace(self, abscissa=self.abscissa - by)

    @property
    def rms_sigma(self) -> float | None:
        """Root mean square of the standard errors, in the unit that is shown; None where there are none."""
        sigma = self.shown.sigma
        return None if sigma is None else float(np.sqrt(np.mean(sigma**2)))


def _some(array: Array | None, which: NDArray[np.bool_] | slice) -> Array | None:
    return None if array is None else array[which]
