"""What a flight gives: time histories by name.

Light to import: a process that only draws a flight has no need of what flies it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sim.flight.trim import Trim
    from sim.waves.linear import Waves

Array = NDArray[np.float64]

# Channels a reference may hold, with the unit of the simulation.
CHANNELS = dict.fromkeys(("u", "v", "w", "U"), "m/s") | dict.fromkeys(("p", "q", "r"), "rad/s")
CHANNELS |= dict.fromkeys(("x", "y", "z", "D0"), "m") | dict.fromkeys(("phi", "theta", "psi"), "rad")
CHANNELS |= {"u_over_U0": "-", "dz_over_L0": "-", "n": "1/s", "ballast": "kg", "trim_tank": "m"}
TANKS = ("ballast", "trim_tank")
# What a simulation gives beside the columns of its record.
DERIVED = ("U", "D0", "s", "u_over_U0", "dz_over_L0")


@dataclass(frozen=True)
class Simulation:
    """Time histories of one maneuver, program frame, SI and radians.

    Attributes
    ----------
    columns : Names of the columns of ``record``: t, the 12 states, planes, n, ballast and
        trim_tank when in use, dV, dH.
    record : (rows, columns).
    executes : (k, 2) time [s] and command [rad] of each zigzag execute.
    trim : The initial equilibrium, or None.
    depth_offset : D0 = z + depth_offset.
    length : Reference length L [m].
    steps : (k, 3) time [s], axis (dV, dH, n, run) and number of each programme step that ended.
    end : (13,) time [s] and state at the end of the run, which an event may place between
        two records.
    waves : Of the run; None in deep, calm water.

    Examples
    --------
    >>> import ident
    >>> flight = ident.validate("my-boat/zigzag.toml", db="coeff_db").simulation
    >>> flight.columns[:4]
    ('t', 'u', 'v', 'w')
    >>> flight["psi"].shape == flight["D0"].shape == flight["t"].shape
    True
    """

    columns: tuple[str, ...]
    record: Array
    executes: Array
    trim: Trim | None
    depth_offset: float
    length: float
    steps: Array
    end: Array
    waves: Waves | None = None

    def __repr__(self) -> str:
        return f"Simulation({len(self.record)} records of {len(self.columns)} columns to t = {self.end[0]:g} s)"

    def __getitem__(self, column: str) -> Array:
        """One column by name; those of ``DERIVED``, are computed.

        ``s`` is the length of the path over ground, in the horizontal plane [m].
        """
        if column == "U":
            return np.sqrt(self["u"] ** 2 + self["v"] ** 2 + self["w"] ** 2)
        if column == "D0":
            return self["z"] + self.depth_offset
        if column == "s":
            return np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(self["x"]), np.diff(self["y"])))])
        if column == "u_over_U0":
            return self["u"] / self["U"][0]
        if column == "dz_over_L0":
            return (self["z"] - self["z"][0]) / self.length
        return self.record[:, self.columns.index(column)]
