"""What an appendage adds to the derivatives of a hull, by the lines of both, held against measured differences.

A force by yaw is measured with the model's own inertia in it: the slope is Y_ur - m', and Y_ur is the small rest when
m' is taken off. An error in per cent of that rest, as a table quotes it of one boat, is an error of the whole slope;
of a configuration whose rest is nearly zero it would be none.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sim.boat.vehicle import load_vehicle
from sim.hull.derivatives import derivatives

if TYPE_CHECKING:
    import pandas as pd

# What a configuration has beside the hull alone.
APPENDAGES = {"sail": "hull-sail", "stern planes": "hull-planes"}
HULL, FULL = "hull", "full"
DERIVATIVES = ("Y_v", "N_v", "Y_ur", "N_ur")


@dataclass(frozen=True)
class Difference:
    """One derivative of a configuration less that of the hull alone, in 1/2 rho L^n.

    Attributes
    ----------
    appendage, coefficient : What differs, and in what.
    estimated, estimated_sigma : By the lines of the two (``sim.hull.derivatives``); what hull and configuration have
        wrong together is in neither.
    measured, measured_sigma : From the two configurations' own runs; error of a force by yaw as ``slope_error`` has it.
    """

    appendage: str
    coefficient: str
    estimated: float
    estimated_sigma: float
    measured: float
    measured_sigma: float

    @property
    def score(self) -> float:
        """Difference of the two in standard errors of both."""
        return (self.estimated - self.measured) / math.hypot(self.estimated_sigma, self.measured_sigma)


def estimated(vehicle: str, hull: str) -> dict[str, tuple[float, float]]:
    """Derivatives by the lines of a vehicle less those of its hull, and their standard errors.

    Parameters
    ----------
    vehicle, hull : Names of bundled vehicles, or their files.
    """
    whole, bare = derivatives(load_vehicle(vehicle)), derivatives(load_vehicle(hull))
    gained = {}
    for name in DERIVATIVES:
        causes = whole[name].errors.keys() | bare[name].errors.keys()
        left = [whole[name].errors.get(c, 0.0) - bare[name].errors.get(c, 0.0) for c in causes]
        gained[name] = whole[name].value - bare[name].value, math.hypot(*left)
    return gained


def _values(rows: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """Coefficient -> value and standard error."""
    columns = zip(rows["coefficient"], rows["value"], rows["stderr"], strict=True)
    return {str(name): (float(value), float(error)) for name, value, error in columns}


def mass_number(vehicle: str, density: float) -> float:
    """Mass of a vehicle over 1/2 rho L^3, m'.

    Parameters
    ----------
    vehicle : Name of a bundled vehicle, or its file.
    density : Of the water its mass is stated for [kg/m^3].
    """
    sizes = load_vehicle(vehicle).particulars
    return 2.0 * sizes.mass.value / density / sizes.length.value**3


def slope_error(value: float, quoted: float, mass: float, share: float) -> float:
    """Standard error of ``Y_ur`` that was measured as the slope Y_ur - m': what is quoted, or that of the slope.

    Parameters
    ----------
    value, quoted : Of Y_ur, in 1/2 rho L^3.
    mass : m', in the same.
    share : Relative error of the slope.
    """
    return max(quoted, share * abs(value - mass))


def differences(measured: Mapping[str, pd.DataFrame], boat: str, density: float) -> list[Difference]:
    """Estimates held against the measured differences between configurations.

    Parameters
    ----------
    measured : Configuration -> database rows, with ``hull`` for the hull alone and ``full`` for the boat with all its
        appendages, of which the relative error of a measured slope by yaw is taken.
    boat : Bundled vehicles are named ``boat-configuration``, the full one ``boat``.
    density : Of the water that the masses of the vehicles are stated for [kg/m^3].

    Returns
    -------
    One entry an appendage and derivative. Errors of a configuration's measured derivatives are independent of the
    hull's.
    """
    rows = []
    value, error = _values(measured[FULL])["Y_ur"]
    share = error / abs(value - mass_number(boat, density))

    def known(configuration: str) -> dict[str, tuple[float, float]]:
        found = _values(measured[configuration])
        value, quoted = found["Y_ur"]
        mass = mass_number(f"{boat}-{configuration}", density)
        return found | {"Y_ur": (value, slope_error(value, quoted, mass, share))}

    bare = known(HULL)
    for appendage, configuration in APPENDAGES.items():
        whole = known(configuration)
        for name, (value, sigma) in estimated(f"{boat}-{configuration}", f"{boat}-{HULL}").items():
            error = math.hypot(whole[name][1], bare[name][1])
            rows.append(Difference(appendage, name, value, sigma, whole[name][0] - bare[name][0], error))
    return rows
