"""What an appendage adds to the derivatives of a hull, from its size alone, held against measured differences."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from sim.files.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    *("appendage", "configuration", "pair", "exposed_span_m", "mean_chord_m", "x_m", "hull_radius_m"),
    *("flow_share", "rel_sigma", "source"),
)
# Derivative and the power of the lever x/L that goes with it.
DERIVATIVES = {"Y_v": 0, "N_v": 1, "Y_ur": 1, "N_ur": 2}


@dataclass(frozen=True)
class Difference:
    """One derivative of a configuration less that of the hull alone, in 1/2 rho L^n.

    Attributes
    ----------
    appendage, coefficient : What differs, and in what.
    estimated, estimated_sigma : From the size of the appendage, with the error that its row states.
    measured, measured_sigma : From the two configurations' own runs.
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


def lift_slope(aspect_ratio: float) -> float:
    """Lift slope of a wing [1/rad]: Helmbold, H. B. (1942), Der unverwundene Ellipsenfluegel als tragende Flaeche.

    Examples
    --------
    >>> round(lift_slope(2.0), 3)
    2.603
    """
    return 2.0 * math.pi * aspect_ratio / (2.0 + math.sqrt(aspect_ratio**2 + 4.0))


def on_a_body(radius: float, span: float) -> float:
    """Lift of fin and body together over that of the exposed fins alone, (1 + a/s)^2.

    Slender-body theory: Pitts, W. C., Nielsen, J. N., Kaattari, G. E. (1957), *Lift and center of pressure of
    wing-body-tail combinations*, NACA Report 1307, K_W(B) + K_B(W).

    Parameters
    ----------
    radius : Of the body, a [m]. span : From the axis to the tip, s [m].
    """
    return (1.0 + radius / span) ** 2


def read_appendages(path: str | Path) -> pd.DataFrame:
    """The table of appendages; raises ``InputError`` for a missing file or column."""
    import pandas as pd

    if not Path(path).is_file():
        raise InputError(str(path), "missing", "a table of appendages: " + ", ".join(COLUMNS))
    table = pd.read_csv(path)
    for column in COLUMNS:
        if column not in table:
            raise InputError(str(path), f"column {column} missing", ", ".join(COLUMNS))
    return table


def side_force_slope(row: pd.Series, length: float) -> float:
    """Y_v in 1/2 rho L^2 that an appendage adds: -(share of q) (slope) (area) (1 + a/s)^2 / L^2.

    A pair has the aspect ratio of its two exposed halves put together, a fin on the hull as on a wall that of
    itself and its image; its area is then its own.
    """
    span, chord, radius, share = (
        float(row[k]) for k in ("exposed_span_m", "mean_chord_m", "hull_radius_m", "flow_share")
    )
    area = span * chord * (2.0 if row["pair"] == "yes" else 1.0)
    slope = lift_slope(2.0 * span / chord)
    return -share * slope * area * on_a_body(radius, radius + span) / length**2


def _values(rows: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """Coefficient -> value and standard error."""
    columns = zip(rows["coefficient"], rows["value"], rows["stderr"], strict=True)
    return {str(name): (float(value), float(error)) for name, value, error in columns}


def differences(appendages: pd.DataFrame, derivatives: dict[str, pd.DataFrame], length: float) -> list[Difference]:
    """Estimates held against the measured differences between configurations.

    Parameters
    ----------
    appendages : From ``read_appendages``.
    derivatives : Configuration -> database rows, with ``hull`` for the hull alone.
    length : L [m].

    Returns
    -------
    One entry an appendage and derivative. Errors of a configuration's derivatives are independent of the hull's.
    """
    found = []
    for _, row in appendages.iterrows():
        slope = side_force_slope(row, length)
        names = (str(row["configuration"]), "hull")
        own, bare = (_values(derivatives[c]) for c in names)
        for name, power in DERIVATIVES.items():
            # v at the appendage is v + x r, its moment x Y.
            estimated = slope * (float(row["x_m"]) / length) ** power
            measured = own[name][0] - bare[name][0]
            sigma = math.hypot(own[name][1], bare[name][1])
            found.append(
                Difference(
                    str(row["appendage"]), name, estimated, abs(estimated) * float(row["rel_sigma"]), measured, sigma
                )
            )
    return found
