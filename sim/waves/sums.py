"""Sums over wave components at points, the innermost loop of the wave loads.

Few components run in double precision with the library's functions. Many run in single
precision with polynomials that the compiler puts into vector registers.
"""

from __future__ import annotations

from collections.abc import Callable
from math import factorial

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from numpy.typing import NDArray

from sim.compiled import fast, inlined, merged
from sim.waves.linear import Waves

Array = NDArray[np.float64]
Single = NDArray[np.float32]

_FAST = {"reassoc", "contract", "nsz", "arcp"}
# Components are filled up to a multiple of this with some of no height: what fills no register takes as long.
LANES = 16

_HALF, _ONE, _QUARTER, _TURN = np.float32(0.5), np.float32(1.0), np.float32(0.25), np.float32(2.0 * np.pi)
_TWO_PI = 2.0 * np.pi


def _even(function: Callable[[Array], Array], degree: int) -> tuple[float, ...]:
    """Coefficients in x^2 of an even function of half an angle of x turns, to half a turn, by Chebyshev's points."""
    line = Chebyshev.interpolate(lambda q: function(np.pi * np.sqrt(q)), degree, (0.0, 0.25))
    return tuple(float(c) for c in line.convert(kind=Polynomial, domain=(-1, 1), window=(-1, 1)).coef)


def _cardinal(x: Array) -> Array:
    return np.asarray(np.pi * np.sinc(x / np.pi))


# In single precision, to 5e-8, and in double, to 2e-15.
_S0, _S1, _S2, _S3, _S4 = (np.float32(c) for c in _even(_cardinal, 4))
_C0, _C1, _C2, _C3, _C4 = (np.float32(c) for c in _even(np.cos, 4))
_SINE, _COSINE = _even(_cardinal, 7), _even(np.cos, 8)
# exp(t) as the 16th power of a Taylor series in t/16, to 2e-7 of the value at t = 0; as the 64th, to 5e-16.
_E2, _E3, _E4, _E5 = (np.float32(c) for c in (1 / 2, 1 / 6, 1 / 24, 1 / 120))
_TAYLOR = tuple(1.0 / factorial(n) for n in range(9))
_SIXTEENTH, _NOTHING = np.float32(1 / 16), np.float32(-20.0 / 16)
_SIXTY_FOURTH, _NONE = 1.0 / 64.0, -40.0 / 64.0


@inlined
def _series(c: tuple[float, ...], x: float) -> float:
    """A polynomial of degree 7, or 8 where there are nine coefficients."""
    tail = c[7] + x * c[8] if len(c) > 8 else c[7]
    return c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * (c[5] + x * (c[6] + x * tail))))))


@merged
def _decay(t: np.float32) -> np.float32:
    """exp(16 t) of t <= 0 in single precision."""
    t = max(t, _NOTHING)
    e = _ONE + t * (_ONE + t * (_E2 + t * (_E3 + t * (_E4 + t * _E5))))
    e *= e
    e *= e
    e *= e
    return e * e


@fast(_FAST)
def fill_many(
    w: Waves, north: float, east: float, time: float, top: float, angle: Array, sizes: Single, phases: Single
) -> None:
    """Sizes of ``sum_many`` at a depth, and phases in turns at a place and time.

    Parameters
    ----------
    north, east, top : Of the place [m], where the water that carries the waves is.
    angle : (n,) scratch. sizes, phases : (3, n) of the kinds of ``sim.waves.loads``.
    """
    for j in range(w.number.size):
        angle[j] = w.number[j] * (w.north[j] * north + w.east[j] * east) - w.frequency[j] * time + w.phase[j]
    for j in range(w.number.size):
        turns = angle[j] / _TWO_PI
        phases[1, j] = turns - np.floor(turns)
    for j in range(w.number.size):
        phases[0, j] = phases[2, j] = phases[1, j] - _QUARTER
    z = np.float32(top) * _SIXTEENTH
    for j in range(w.number.size):
        sizes[1, j] = _decay(-np.float32(w.number[j]) * z) * np.float32(w.amplitude[j] * w.frequency[j])
    for j in range(w.number.size):
        sizes[0, j] = sizes[1, j] * np.float32(w.frequency[j])
    for j in range(w.number.size):
        sizes[2, j] = np.float32(w.amplitude[j])


@fast(_FAST)
def sum_many(
    single: Single,
    sizes: Single,
    phases: Single,
    kind: int,
    place: Array,
    motion: Array,
    first: int,
    last: int,
    sums: Array,
) -> None:
    """As ``sum_few``, in single precision, sixteen components at a time where the machine can.

    Sine and cosine are those of twice half the angle, for which a turn more or less makes no difference.

    Parameters
    ----------
    single : (6, n) k [1/m], k cos chi and k sin chi in turns [1/m], omega, cos chi, sin chi.
    phases : In turns.
    """
    k, kn, ke = single[0], single[1], single[2]
    w, north, east = single[3], single[4], single[5]
    size, phase = sizes[kind], phases[kind]
    for i in range(first, last):
        x, y, z = np.float32(place[i, 0]), np.float32(place[i, 1]), _SIXTEENTH * np.float32(place[i, 2])
        vx, vy, vz = _TURN * np.float32(motion[i, 0]), _TURN * np.float32(motion[i, 1]), np.float32(motion[i, 2])
        a0 = a1 = a2 = b0 = b1 = b2 = np.float32(0.0)
        for j in range(size.size):
            turns = kn[j] * x + ke[j] * y + phase[j]
            r = turns - np.floor(turns + _HALF)
            q = r * r
            s = r * (_S0 + q * (_S1 + q * (_S2 + q * (_S3 + q * _S4))))
            c = _C0 + q * (_C1 + q * (_C2 + q * (_C3 + q * _C4)))
            e = _decay(-k[j] * z) * size[j]
            twice = (e + e) * s
            s, c = twice * c, e - twice * s
            rate, decay = w[j] - kn[j] * vx - ke[j] * vy, k[j] * vz
            dc, ds = rate * s - decay * c, -rate * c - decay * s
            a0 += north[j] * c
            a1 += east[j] * c
            a2 -= s
            b0 += north[j] * dc
            b1 += east[j] * dc
            b2 -= ds
        sums[i, 0], sums[i, 1], sums[i, 2], sums[i, 3], sums[i, 4], sums[i, 5] = a0, a1, a2, b0, b1, b2


@fast(_FAST)
def sum_few(
    w: Waves,
    size: Array,
    phase: Array,
    place: Array,
    motion: Array,
    first: int,
    last: int,
    scratch: tuple[Array, Array, Array, Array],
    sums: Array,
) -> None:
    """Sum over the components of size e^{-kz} (n cos, e cos, -sin)(theta) and its rate along a motion.

    Loops over the points, each with one result, which the compiler puts into vector registers.

    Parameters
    ----------
    size, phase : (n,). place, motion : (points, 3) [m], [m/s].
    first, last : Points. scratch : (points,) each. sums : (points, 6) results.
    """
    turned, decayed, sine, cosine = scratch
    for i in range(first, last):
        for j in range(6):
            sums[i, j] = 0.0
    for j in range(size.size):
        k, north, east, frequency = w.number[j], w.north[j], w.east[j], w.frequency[j]
        kn, ke, kz, start, high = k * north, k * east, _SIXTY_FOURTH * k, phase[j], size[j]
        for i in range(first, last):
            turns = (kn * place[i, 0] + ke * place[i, 1] + start) / _TWO_PI
            turned[i] = turns - np.floor(turns + 0.5)
        for i in range(first, last):
            e = _series(_TAYLOR, max(-kz * place[i, 2], _NONE))
            e *= e
            e *= e
            e *= e
            e *= e
            e *= e
            decayed[i] = high * e * e
        for i in range(first, last):
            sine[i] = turned[i] * _series(_SINE, turned[i] * turned[i])
        for i in range(first, last):
            cosine[i] = _series(_COSINE, turned[i] * turned[i])
        for i in range(first, last):
            twice = 2.0 * decayed[i] * sine[i]
            c, s = decayed[i] - twice * sine[i], twice * cosine[i]
            rate = frequency - kn * motion[i, 0] - ke * motion[i, 1]
            decay = k * motion[i, 2]
            dc, ds = rate * s - decay * c, -rate * c - decay * s
            sums[i, 0] += north * c
            sums[i, 1] += east * c
            sums[i, 2] -= s
            sums[i, 3] += north * dc
            sums[i, 4] += east * dc
            sums[i, 5] -= ds
