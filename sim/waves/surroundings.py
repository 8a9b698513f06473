"""What surrounds a boat beside deep, calm water: waves and a surface it can come out of. Compiled.

The right-hand side takes these as one more part of its scratch arrays; a boat in deep, calm
water has an empty tuple there and is compiled without any of it.

Where the hull is out of the water it loses buoyancy (``sim.hull.emergence``), its share of the
Froude-Krylov and mean loads, and the added mass of its emerged sections, on both sides of the
equation of motion. Left out: the momentum of the added mass that changes (slamming), and the
tables, which know the submerged boat only.
"""

from __future__ import annotations

from math import cos, sin
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numba.extending import overload
from numpy.typing import NDArray

from sim.hull.emergence import Cells, lost_buoyancy
from sim.waves import passage as wave_passage
from sim.waves.drift import Drift, add_mean
from sim.waves.loads import FORCE, PROBES, WATER, Passage, Sea
from sim.waves.passage import WATER_RATE
from sim.waves.pressure import box_top

Array = NDArray[np.float64]


class Surroundings(NamedTuple):
    """Of one boat and thread.

    sea, sums : Waves and the boat's points in them; a sea without components is calm.
    waves : Whether it has any. time, value, slope : Of ``sums``, at hand: every access to a
        tuple of many arrays costs what it holds.
    cells : Of the hull, for emergence. box : (2, 3) corners of a box around it [m]. crest :
        Highest elevation that can come [m].
    drift : Mean second-order loads of the waves.
    added : (6, 6) added mass of the left-hand side. parts : (k + 1, 6, 6) what each section
        has of it, then the rest. volume : (k,) volume of the cells of each section [m^3].
    specific_weight : rho g [N/m^3].
    clock : (3,) time at the start of the step, now, and of ``found`` [s]; the last negative
        when that is not known.
    found : (n,) wave quantities now, in the layout of ``sim.waves.passage.interpolate``.
    felt : (12,) state with velocities relative to the water. lost : (6,) load of emergence
        [N, N m]. dry : (k,) emerged volume by section [m^3]. wet : (6, 6) added mass of the wet
        part. mean : (6,) second-order loads [N, N m]. emerged : (1,) emerged share of the volume.
    """

    sea: Sea
    sums: Passage
    waves: bool
    time: Array
    value: Array
    slope: Array
    cells: Cells
    box: Array
    crest: float
    drift: Drift
    added: Array
    parts: Array
    volume: Array
    specific_weight: float
    clock: Array
    found: Array
    felt: Array
    lost: Array
    dry: Array
    wet: Array
    mean: Array
    emerged: Array


# Surroundings, or an empty tuple in deep, calm water: the compiler tells them apart.
Around: TypeAlias = Any


@njit(cache=True, error_model="numpy")
def _wet_added_mass(a: Surroundings, share: float) -> None:
    """Added mass of the wet part of every section, into ``a.wet``."""
    count = a.volume.size
    a.wet[:] = (1.0 - share) * a.parts[count]
    for k in range(count):
        # A section that owns no cell comes out with the boat as a whole.
        left = 1.0 - a.dry[k] / a.volume[k] if a.volume[k] > 0.0 else 1.0 - share
        for i in range(6):
            for j in range(6):
                a.wet[i, j] += left * a.parts[k, i, j]


@njit(cache=True, error_model="numpy")
def _emerge(a: Surroundings, y: Array) -> float:
    """Emerged share of the volume; load and added mass of what is left into ``a``."""
    surface = a.found[a.found.size - a.cells.stations.size :]
    share = lost_buoyancy(a.cells, y, surface, a.specific_weight, a.lost, a.dry)
    if share > 0.0:
        _wet_added_mass(a, share)
    return share


def add_loads(around: Around, y: Array, out: Array) -> None:
    """Add the loads of waves and emergence, X Y Z K M N body axes [N, N m], to ``out``."""
    share = 0.0
    st, ct = sin(y[10]), cos(y[10])
    if y[8] + box_top(around.box[0], around.box[1], -st, ct * sin(y[9]), ct * cos(y[9])) < around.crest:
        share = _emerge(around, y)
        for i in range(6):
            out[i] += around.lost[i]
    around.emerged[0] = share
    if around.waves:
        added = around.wet if share > 0.0 else around.added
        around.mean[:] = 0.0
        add_mean(around.drift, y, around.mean)
        for i in range(6):
            load = (1.0 - share) * (around.found[FORCE + i] + around.mean[i])
            for j in range(6):
                load += added[i, j] * around.found[WATER_RATE + j]
            out[i] += load


def prepare(around: Around, y: Array, time: float) -> None:
    """Make the surroundings ready for a step that starts at ``y`` [SI] and ``time`` [s]."""
    around.clock[0] = around.clock[1] = time
    around.clock[2] = -1.0
    if around.waves:
        wave_passage.advance(around.sea, y, time, around.sums)


def tick(around: Around, offset: float) -> None:
    """Set the clock to the start of the step plus ``offset`` [s]."""
    around.clock[1] = around.clock[0] + offset


def observe(around: Around, y: Array) -> None:
    """Wave quantities and relative velocities of state ``y`` at the time of the clock."""
    for i in range(12):
        around.felt[i] = y[i]
    if around.waves:
        # Two stages of a step are at the same time.
        if around.clock[2] != around.clock[1]:
            wave_passage.interpolate(around.time, around.value, around.slope, around.clock[1], around.found)
            around.clock[2] = around.clock[1]
        for i in range(6):
            around.felt[i] -= around.found[WATER + i]


def relative(around: Around, y: Array) -> Array:
    """State ``y`` with velocities relative to the water, after ``observe``."""
    return np.asarray(around.felt)


def plane_inflow(around: Around, plane: int) -> tuple[float, float, float]:
    """Velocity of the water at a plane, body axes [m/s], after ``observe``."""
    if not around.waves:
        return 0.0, 0.0, 0.0
    k = PROBES + 3 * plane
    return around.found[k], around.found[k + 1], around.found[k + 2]


def propeller_inflow(around: Around, planes: int) -> float:
    """Velocity of the water ahead at the propeller [m/s], after ``observe``."""
    return float(around.found[PROBES + 3 * planes]) if around.waves else 0.0


def read_gauge(around: Around, state: Array, rate: Array) -> None:
    """Change depth and its rate to what the boat's depth gauge reads in the pressure of the waves.

    Parameters
    ----------
    around : After ``prepare``.
    state, rate : (12,) of the boat at the time of the clock; entry 8 is changed.
    """
    if around.waves:
        head, change = wave_passage.gauge(around.sea, around.sums, around.clock[1])
        state[8] += head
        rate[8] += change


# In deep, calm water none of this is compiled: the compiler chooses by the type of ``around``.
def _calm_add_loads(around: Around, y: Array, out: Array) -> None:
    pass


def _calm_prepare(around: Around, y: Array, time: float) -> None:
    pass


def _calm_tick(around: Around, offset: float) -> None:
    pass


def _calm_observe(around: Around, y: Array) -> None:
    pass


def _calm_read_gauge(around: Around, state: Array, rate: Array) -> None:
    pass


def _calm_relative(around: Around, y: Array) -> Array:
    return y


def _calm_plane_inflow(around: Around, plane: int) -> tuple[float, float, float]:
    return 0.0, 0.0, 0.0


def _calm_propeller_inflow(around: Around, planes: int) -> float:
    return 0.0


def _felt(around: Around, y: Array) -> Array:
    return around.felt


def _wave_propeller_inflow(around: Around, planes: int) -> float:
    return around.found[PROBES + 3 * planes] if around.waves else 0.0


@overload(relative)
def _choose_relative(around: Around, y: Array) -> object:
    return _felt if len(around) else _calm_relative


@overload(plane_inflow)
def _choose_plane_inflow(around: Around, plane: int) -> object:
    return plane_inflow if len(around) else _calm_plane_inflow


@overload(propeller_inflow)
def _choose_propeller_inflow(around: Around, planes: int) -> object:
    return _wave_propeller_inflow if len(around) else _calm_propeller_inflow


@overload(read_gauge)
def _choose_read_gauge(around: Around, state: Array, rate: Array) -> object:
    return read_gauge if len(around) else _calm_read_gauge


@overload(add_loads)
def _choose_add_loads(around: Around, y: Array, out: Array) -> object:
    return add_loads if len(around) else _calm_add_loads


@overload(prepare)
def _choose_prepare(around: Around, y: Array, time: float) -> object:
    return prepare if len(around) else _calm_prepare


@overload(tick)
def _choose_tick(around: Around, offset: float) -> object:
    return tick if len(around) else _calm_tick


@overload(observe)
def _choose_observe(around: Around, y: Array) -> object:
    return observe if len(around) else _calm_observe
