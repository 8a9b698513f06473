"""Wave spectra and seeded realisations of them.

A realisation has components of equal energy: the spectrum is cut into n bins that each
hold m0/n, and each bin becomes one component whose frequency is the bin's root mean square.
So m0 and m2 of the realisation are the spectrum's whatever n is, short waves do not waste
components, and the frequencies are incommensurate: the sea does not repeat. Phases are
uniform, from the seed (Longuet-Higgins 1952; deterministic amplitudes as in DNV-RP-C205).
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from sim.files.errors import InputError
from sim.hull.integral import trapezoid
from sim.waves.linear import Waves, calm, make_waves

Array = NDArray[np.float64]

# Band of a spectrum in peak frequencies: below it no energy, above it 1e-5 of m0.
_BAND = (0.3, 20.0)
_GRID = 20001


@dataclass(frozen=True)
class SeaState:
    """Nominal significant height [m] and peak period [s] of a sea state."""

    height: float
    period: float
    source: str


def sea_state(number: int) -> SeaState:
    """A row of ``sim/data/sea_states.csv`` (Kim 2021, Table 2).

    Raises
    ------
    InputError
        When the table has no such sea state.
    """
    with (files("sim") / "data" / "sea_states.csv").open(encoding="utf-8") as f:
        rows = {int(r["sea_state"]): r for r in csv.DictReader(f)}
    if number not in rows:
        raise InputError("sea state", repr(number), ", ".join(map(str, rows)))
    row = rows[number]
    return SeaState(float(row["significant_height_m"]), float(row["peak_period_s"]), row["source"])


def bretschneider(frequency: Array, height: float, peak: float) -> Array:
    """Energy density S(omega), Eq. (8) of Kim (2021) [m^2 s].

    Parameters
    ----------
    frequency : omega [rad/s], positive.
    height : Significant height [m].
    peak : Peak frequency omega_s [rad/s].
    """
    ratio = (peak / np.asarray(frequency, dtype=float)) ** 4
    return 5.0 / 16.0 * height**2 * ratio / frequency * np.exp(-1.25 * ratio)


def jonswap(frequency: Array, height: float, peak: float, gamma: float = 3.3) -> Array:
    """Energy density S(omega) of JONSWAP with the given significant height [m^2 s].

    Peak enhancement gamma^exp(-(omega/omega_p - 1)^2 / (2 sigma^2)), sigma 0.07 below the
    peak and 0.09 above (Hasselmann et al. 1973), scaled so that m0 = Hs^2 / 16.

    Parameters
    ----------
    frequency, height, peak : As for ``bretschneider``.
    gamma : Peak enhancement; 1 gives ``bretschneider``.
    """

    def shape(w: Array) -> Array:
        sigma = np.where(w <= peak, 0.07, 0.09)
        return bretschneider(w, 1.0, peak) * gamma ** np.exp(-0.5 * ((w / peak - 1.0) / sigma) ** 2)

    grid = _grid(peak)
    scale = height**2 / 16.0 / trapezoid(shape(grid), grid)
    return scale * shape(np.asarray(frequency, dtype=float))


def _grid(peak: float) -> Array:
    return peak * np.geomspace(*_BAND, _GRID)


def moments(frequency: Array, density: Array, orders: tuple[int, ...] = (0, 1, 2)) -> Array:
    """Spectral moments m_n = int omega^n S d(omega) by the trapezoidal rule on a fine grid."""
    return np.array([trapezoid(frequency**n * density, frequency) for n in orders])


@dataclass(frozen=True)
class Spectrum:
    """A sea by name and parameters.

    Attributes
    ----------
    kind : ``bretschneider`` or ``jonswap``.
    height : Significant height [m]; zero is calm.
    period : Peak period [s].
    direction : Mean direction the waves travel to, clockwise from north [rad].
    spreading : s of cos^2s((chi - mean)/2) (Longuet-Higgins et al. 1963); 0 is long-crested.
    gamma : Of JONSWAP.
    """

    kind: str
    height: float
    period: float
    direction: float = 0.0
    spreading: float = 0.0
    gamma: float = 3.3

    def density(self, frequency: Array) -> Array:
        """S(omega) [m^2 s].

        Raises
        ------
        InputError
            For an unknown kind.
        """
        peak = 2.0 * np.pi / self.period
        if self.kind == "bretschneider":
            return bretschneider(frequency, self.height, peak)
        if self.kind == "jonswap":
            return jonswap(frequency, self.height, peak, self.gamma)
        raise InputError("wave spectrum", repr(self.kind), "bretschneider, jonswap")


def _directions(spreading: float, mean: float, count: int, draw: np.random.Generator) -> Array:
    """One direction a component: stratified quantiles of cos^2s, in random order of frequency."""
    from scipy.special import betaincinv

    if spreading == 0.0:
        return np.full(count, mean)
    share = (draw.permutation(count) + draw.uniform(size=count)) / count
    # sin^2 of half the angle follows a beta distribution, on either side alike.
    half = np.arcsin(np.sqrt(betaincinv(0.5, spreading + 0.5, np.abs(2.0 * share - 1.0))))
    return mean + 2.0 * np.sign(share - 0.5) * half


def realise(spectrum: Spectrum, components: int, seed: int, density: float, gravity: float) -> Waves:
    """Waves of a spectrum, reproducible by the seed.

    Parameters
    ----------
    spectrum : The sea.
    components : How many, at least one.
    seed : Of phases and directions; the same seed gives the same waves.
    density, gravity : Of the water and the place [kg/m^3], [m/s^2].

    Returns
    -------
    Waves without components when the height is zero.

    Raises
    ------
    InputError
        For fewer than one component, a negative height or spreading, or a period that is not positive.
    """
    if components < 1:
        raise InputError("wave components", str(components), "one or more")
    if spectrum.height < 0.0 or spectrum.period <= 0.0 or spectrum.spreading < 0.0:
        raise InputError("wave spectrum", str(spectrum), "height and spreading zero or more, period above zero")
    grid = _grid(2.0 * np.pi / spectrum.period)
    s = spectrum.density(grid)
    steps = np.diff(grid)

    def running(values: Array) -> Array:
        return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * steps)])

    energy, second = running(s), running(grid**2 * s)
    draw = np.random.default_rng(seed)
    phase = draw.uniform(0.0, 2.0 * np.pi, components)
    direction = _directions(spectrum.spreading, spectrum.direction, components, draw)
    if spectrum.height == 0.0:
        return calm(density, gravity)
    edges = np.interp(energy[-1] * np.arange(components + 1) / components, energy, grid)
    edges[[0, -1]] = grid[[0, -1]]
    m0, m2 = np.diff(np.interp(edges, grid, energy)), np.diff(np.interp(edges, grid, second))
    return make_waves(np.sqrt(2.0 * m0), np.sqrt(m2 / m0), direction, phase, density, gravity)
