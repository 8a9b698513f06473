"""Sums over many wave components at one point, the innermost loop of the wave loads.

Few components run in double precision with the library's functions. Many run in single
precision with polynomials that the compiler puts into vector registers.
"""

from __future__ import annotations

from math import cos, exp, sin

import numpy as np
from numpy.typing import NDArray

from sim.compiled import fast, inlined
from sim.waves.linear import Waves

Array = NDArray[np.float64]
Single = NDArray[np.float32]

_FAST = {"reassoc", "contract", "nsz", "arcp"}

_HALF, _ONE, _TWO = np.float32(0.5), np.float32(1.0), np.float32(2.0)
_PER_PI, _PI, _PI_LOW = np.float32(1.0 / np.pi), np.float32(np.pi), np.float32(np.pi - float(np.float32(np.pi)))
# Taylor coefficients: sine and cosine to a quarter turn and exp to a third are exact in single precision.
_S = tuple(np.float32(c) for c in (-1 / 6, 1 / 120, -1 / 5040, 1 / 362880, -1 / 39916800))
_S1, _S2, _S3, _S4, _S5 = _S
_C = tuple(np.float32(c) for c in (-1 / 2, 1 / 24, -1 / 720, 1 / 40320, -1 / 3628800, 1 / 479001600))
_C1, _C2, _C3, _C4, _C5, _C6 = _C
_E = tuple(np.float32(c) for c in (1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720))
_E2, _E3, _E4, _E5, _E6 = _E
_SIXTY_FOURTH, _NOTHING = np.float32(1 / 64), np.float32(-20.0)


@fast(_FAST)
def sum_many(
    single: Single, sizes: Single, phases: Single, kind: int, place: Array, motion: Array, i: int, out: Array
) -> None:
    """As ``sum_few``, in single precision, eight components at a time where the machine can."""
    k, kn, ke = single[0], single[1], single[2]
    w, north, east = single[3], single[4], single[5]
    size, phase = sizes[kind], phases[kind]
    x, y, z = np.float32(place[i, 0]), np.float32(place[i, 1]), np.float32(place[i, 2])
    vx, vy, vz = np.float32(motion[i, 0]), np.float32(motion[i, 1]), np.float32(motion[i, 2])
    a0 = a1 = a2 = b0 = b1 = b2 = np.float32(0.0)
    for j in range(size.size):
        angle = kn[j] * x + ke[j] * y + phase[j]
        turns = np.floor(angle * _PER_PI + _HALF)
        r = (angle - turns * _PI) - turns * _PI_LOW
        q = r * r
        s = r * (_ONE + q * (_S1 + q * (_S2 + q * (_S3 + q * (_S4 + q * _S5)))))
        c = _ONE + q * (_C1 + q * (_C2 + q * (_C3 + q * (_C4 + q * (_C5 + q * _C6)))))
        t = max(-k[j] * z, _NOTHING) * _SIXTY_FOURTH
        e = _ONE + t * (_ONE + t * (_E2 + t * (_E3 + t * (_E4 + t * (_E5 + t * _E6)))))
        e *= e
        e *= e
        e *= e
        e *= e
        e *= e
        e *= e
        e *= size[j] * (_ONE - _TWO * (turns - _TWO * np.floor(_HALF * turns)))
        c *= e
        s *= e
        rate, decay = w[j] - kn[j] * vx - ke[j] * vy, k[j] * vz
        dc, ds = rate * s - decay * c, -rate * c - decay * s
        a0 += north[j] * c
        a1 += east[j] * c
        a2 -= s
        b0 += north[j] * dc
        b1 += east[j] * dc
        b2 -= ds
    out[0], out[1], out[2], out[3], out[4], out[5] = a0, a1, a2, b0, b1, b2


@inlined
def sum_few(w: Waves, size: Array, phase: Array, kind: int, place: Array, motion: Array, i: int, out: Array) -> None:
    """Sum over the components of size e^{-kz} (n cos, e cos, -sin)(theta) and its rate along a motion."""
    x, y, z = place[i, 0], place[i, 1], place[i, 2]
    vx, vy, vz = motion[i, 0], motion[i, 1], motion[i, 2]
    a0 = a1 = a2 = b0 = b1 = b2 = 0.0
    for j in range(w.number.size):
        k, north, east = w.number[j], w.north[j], w.east[j]
        angle = k * (north * x + east * y) + phase[kind, j]
        e = size[kind, j] * exp(-k * z)
        c, s = e * cos(angle), e * sin(angle)
        rate, decay = w.frequency[j] - k * (north * vx + east * vy), k * vz
        dc, ds = rate * s - decay * c, -rate * c - decay * s
        a0 += north * c
        a1 += east * c
        a2 -= s
        b0 += north * dc
        b1 += east * dc
        b2 -= ds
    out[0], out[1], out[2], out[3], out[4], out[5] = a0, a1, a2, b0, b1, b2
