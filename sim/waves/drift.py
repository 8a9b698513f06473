"""Mean second-order loads of a seaway on a boat, as a small table for the right-hand side.

Components of different frequency have no mean together, so that the mean load of a seaway is
sum a_j^2 D(omega_j, chi_j - psi, z), Newman's (1974) diagonal, with D of ``sim.waves.mean_loads``. It
is summed once into a table over heading, depth and speed; the slowly varying part that the
other pairs make is left out. What the first-order loads have of it, because they are taken
where the boat is, is not in the table: nothing counts twice (docs/waves.md).
"""

from __future__ import annotations

from math import cos, exp, floor, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.boat.state import PHI, PSI, THETA, Z
from sim.compiled import inner, outer
from sim.waves.linear import Waves

if TYPE_CHECKING:
    from sim.boat.coefficients import Coefficients
    from sim.boat.mass import Environment
    from sim.waves.mean_loads import DipoleBody

Array = NDArray[np.float64]

TWO_PI = 2.0 * np.pi
# Headings at which a wave's loads are worked out (harmonics up to half of it), and of the table.
_DIRECTIONS, _HEADINGS = 48, 72
# Frequencies at which a seaway of more components is worked out; nodes of depth and of speed.
_FREQUENCIES, _DEPTHS, _SPEEDS = 14, 41, 4
# Depths of the free surface's answer, as least depth over depth: none at infinity; nearer than
# the last, where dipoles do not see the surface right, it is held.
_SHARES = np.linspace(0.0, 0.825, 5)


class Drift(NamedTuple):
    """Mean loads over speed, heading and depth; without waves an empty table.

    loads : (speeds, headings, depths, 6) over exp(-decay z), level axes (x to the bow, y to
        starboard, z down) about the body origin [N, N m]; headings once round from north;
        depths evenly in least/z from 0 (deep) to 1. speed_step [m/s] from zero on.
    decay : Twice the longest wave's number [1/m]. least : Depth of the origin above which
        the loads are held: the highest point at the surface [m].
    """

    loads: Array
    decay: float
    least: float
    speed_step: float


def make_drift(
    coefficients: Coefficients, environment: Environment, waves: Waves, top_speed: float = 0.0, free: bool = True
) -> Drift:
    """Mean second-order loads of waves on a vehicle.

    Parameters
    ----------
    coefficients : Of the vehicle.
    environment : Water density and gravity.
    waves : Components; without any nothing of the geometry is read, and ``add_mean`` does nothing.
    top_speed : Speeds ahead up to this one have their own loads, by the encounter frequency of
        the boat's response; zero: those of zero speed throughout [m/s].
    free : Whether the boat follows the waves, or is held fixed.

    Raises
    ------
    InputError
        When the vehicle lacks what waves need.
    """
    if waves.amplitude.size == 0:
        return Drift(np.zeros((0, 0, 0, 6)), 1.0, 1.0, 1.0)
    # Only the set-up needs it, and it needs the model, which is compiled with this table.
    from sim.waves.mean_loads import dipole_body

    body = dipole_body(coefficients, environment, free)
    least = -coefficients.vehicle.needed_sail_top("the least depth in waves")[2]
    return tabulate(body, waves, least, top_speed)


def _frequencies(waves: Waves) -> Array:
    """Where the quadratic transfer functions are worked out: at each component or on a grid."""
    frequencies = np.unique(waves.frequency)
    return (
        frequencies if frequencies.size <= _FREQUENCIES else np.geomspace(frequencies[0], frequencies[-1], _FREQUENCIES)
    )


def _at_components(frequencies: Array, values: Array, waves: Waves) -> Array:
    """Values over the components from those over frequencies, a cubic spline where there are more."""
    from scipy.interpolate import CubicSpline

    if frequencies.size < _FREQUENCIES:
        return values[np.searchsorted(frequencies, waves.frequency)]
    return np.asarray(CubicSpline(np.log(frequencies), values, axis=0)(np.log(waves.frequency)), dtype=float)


def tabulate(body: DipoleBody, waves: Waves, least: float, top_speed: float = 0.0) -> Drift:
    """The table of a body in waves of one component or more.

    Parameters
    ----------
    body : As dipoles.
    waves : Components.
    least : Least depth of the origin at which the body is submerged [m]; held above it.
    top_speed : As for ``make_drift`` [m/s].
    """
    from scipy.interpolate import CubicSpline

    from sim.waves.mean_loads import mean_loads

    speeds = np.linspace(0.0, top_speed, _SPEEDS) if top_speed > 0.0 else np.zeros(1)
    decay, share = 2.0 * waves.number.min(), np.linspace(0.0, 1.0, _DEPTHS)
    depths = least / np.maximum(share, 1e-9)
    headings = TWO_PI * np.arange(_DIRECTIONS) / _DIRECTIONS
    frequencies, height = _frequencies(waves), -float(body.points[:, 2].min())
    direct, answered = [], []
    for w in frequencies:
        means = mean_loads(body, w, headings, speeds, least / _SHARES[1:])
        # Per orbital velocity squared at the highest point and wave number they hardly depend on frequency.
        size = w**4 / body.gravity * np.exp(2.0 * w**2 / body.gravity * height)
        direct.append(means.direct / size)
        answered.append(means.answered / size)
    # Harmonics over the heading: a turn of the waves is a factor, and the sum over them exact.
    harmonic = np.arange(_DIRECTIONS // 2)
    turned = np.exp(1j * np.outer(np.arctan2(waves.east, waves.north), harmonic))[:, None, :, None]
    parts = []
    for values in (direct, answered):
        each = _at_components(frequencies, np.array(values), waves)
        parts.append(np.fft.rfft(each, axis=2)[:, :, : harmonic.size] * turned)
    weight = np.exp(np.outer(depths, decay - 2.0 * waves.number) + 2.0 * height * waves.number)
    weight *= waves.amplitude**2 * waves.frequency**2 * waves.number
    near = CubicSpline(_SHARES, np.eye(_SHARES.size)[:, 1:])(np.minimum(share, _SHARES[-1]))
    total = np.einsum("zj,jsnc->szcn", weight, parts[0])
    total = total + np.einsum("zj,zd,jdnc->zcn", weight, near, parts[1], optimize=True)
    ahead = np.exp(-1j * np.outer(harmonic, TWO_PI * np.arange(_HEADINGS) / _HEADINGS))
    ahead[1:] *= 2.0
    loads = np.real(total @ ahead) / _DIRECTIONS
    step = float(speeds[1]) if speeds.size > 1 else 1.0
    return Drift(np.ascontiguousarray(loads.transpose(0, 3, 1, 2)), float(decay), least, step)


@inner
def mean_load(
    a: Array, at: int, speeds: int, headings: int, depths: int, decay: float, least: float, speed_step: float, y: Array
) -> tuple[float, float, float, float, float, float]:
    """Mean second-order load X Y Z K M N at a state, from a table that starts at ``a[at]``.

    Parameters
    ----------
    speeds, headings, depths : Of the table. decay, least, speed_step : As ``Drift``.
    """
    depth = max(y[Z], least)
    size, near = exp(-decay * depth), least / depth * (depths - 1)
    d = min(int(near), depths - 2)
    near -= d
    turn = y[PSI] / TWO_PI
    turn = (turn - floor(turn)) * headings
    h = min(int(turn), headings - 1)
    turn -= h
    after = h + 1 if h + 1 < headings else 0
    fast = min(max(y[0] / speed_step, 0.0), speeds - 1.0)
    s = min(int(fast), max(speeds - 2, 0))
    fast -= s
    x = z = yy = k = m = n = 0.0
    for corner in range(8 if speeds > 1 else 4):
        share = size * (near if corner & 1 else 1.0 - near) * (turn if corner & 2 else 1.0 - turn)
        share *= fast if corner & 4 else 1.0 - fast
        i = at + 6 * (((s + (corner >> 2)) * headings + (after if corner & 2 else h)) * depths + d + (corner & 1))
        x += share * a[i]
        yy += share * a[i + 1]
        z += share * a[i + 2]
        k += share * a[i + 3]
        m += share * a[i + 4]
        n += share * a[i + 5]
    st, ct, sf, cf = sin(y[THETA]), cos(y[THETA]), sin(y[PHI]), cos(y[PHI])
    return (
        ct * x - st * z,
        sf * (st * x + ct * z) + cf * yy,
        cf * (st * x + ct * z) - sf * yy,
        ct * k - st * n,
        sf * (st * k + ct * n) + cf * m,
        cf * (st * k + ct * n) - sf * m,
    )


@outer
def _mean(
    a: Array, speeds: int, headings: int, depths: int, decay: float, least: float, speed_step: float, y: Array
) -> tuple[float, float, float, float, float, float]:
    return mean_load(a, 0, speeds, headings, depths, decay, least, speed_step, y)


def add_mean(drift: Drift, y: Array, out: Array) -> None:
    """Add the mean second-order loads at a state; without waves nothing is done.

    Parameters
    ----------
    drift : From ``make_drift``.
    y : (12,) state; speed ahead, depth and attitude are used.
    out : (6,) or longer; X Y Z K M N about the body origin, body axes, are added [N, N m].
    """
    if drift.loads.shape[0]:
        speeds, headings, depths = drift.loads.shape[:3]
        mean = _mean(drift.loads.ravel(), speeds, headings, depths, drift.decay, drift.least, drift.speed_step, y)
        out[:6] += mean
