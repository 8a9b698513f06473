"""Surroundings that many boats use in turn: what each of them has of its own is put in before it moves, and kept after.

The mean loads of a seaway alone are half a megabyte, the same for every boat; of its own a boat has the sums over
the waves along its path, and perhaps the phases of the waves.
"""

from __future__ import annotations

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from sim.boat.state import N_STATES
from sim.compiled import CHOSEN
from sim.waves.passage import CURVE
from sim.waves.surroundings import CURVES, WIDTH, Around

Array = NDArray[np.float64]

# Of a passage, beside the predicted state: velocities before.
_BEFORE = 6


def kept_size(around: Around) -> int:
    """How many numbers a boat keeps of its surroundings; none in deep, calm water."""
    if not len(around):
        return 0
    return CURVES + CURVE * int(around.near.b[WIDTH]) + N_STATES + _BEFORE


def put_in(around: Around, kept: Array, phases: Array) -> None:
    """Make the surroundings those of a boat.

    Parameters
    ----------
    kept : (``kept_size``,) what ``take_out`` left. phases : Of the wave components [rad].
    """
    a, sums, size = around.near.a, around.sums, kept.size - N_STATES - _BEFORE
    for i in range(size):
        a[i] = kept[i]
    for i in range(N_STATES):
        sums.state[i] = kept[size + i]
    for i in range(_BEFORE):
        sums.before[i] = kept[size + N_STATES + i]
    for i in range(phases.size):
        around.sea.waves.phase[i] = phases[i]


def take_out(around: Around, kept: Array) -> None:
    """Keep what a boat has of its own in the surroundings."""
    a, sums, size = around.near.a, around.sums, kept.size - N_STATES - _BEFORE
    for i in range(size):
        kept[i] = a[i]
    for i in range(N_STATES):
        kept[size + i] = sums.state[i]
    for i in range(_BEFORE):
        kept[size + N_STATES + i] = sums.before[i]


def _calm_put_in(around: Around, kept: Array, phases: Array) -> None:
    pass


def _calm_take_out(around: Around, kept: Array) -> None:
    pass


@overload(put_in, jit_options=CHOSEN)
def _choose_put_in(around: Around, kept: Array, phases: Array) -> object:
    return put_in if len(around) else _calm_put_in


@overload(take_out, jit_options=CHOSEN)
def _choose_take_out(around: Around, kept: Array) -> object:
    return take_out if len(around) else _calm_take_out
