"""What surrounds a boat beside deep, calm water: waves and a surface it can come out of. Compiled.

The right-hand side takes these as one more part of its scratch arrays; a boat in deep, calm
water has an empty tuple there and is compiled without any of it.

Where the hull is out of the water it loses buoyancy (``sim.hull.emergence``), its share of the
Froude-Krylov and mean loads, and the added mass of its emerged sections, on both sides of the
equation of motion. Left out: the momentum of the added mass that changes (slamming), and the
tables, which know the submerged boat only.

What the right-hand side needs stands in one array of floats and one of whole numbers, ``near``:
handing over the sums over the waves as well would take longer than using them.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from sim.boat.state import Z
from sim.compiled import CHOSEN, CHOSEN_INLINED, inlined, inner
from sim.hull.emergence import Cells, flat_cells, lose
from sim.waves.drift import Drift, mean_load
from sim.waves.loads import FORCE, IMPULSE, PROBES, WATER, Passage, Sea, passage
from sim.waves.passage import CURVE, fit, height, move_on, recall, rise
from sim.waves.pressure import box_top

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
Axis = tuple[float, float, float]
Mean = tuple[float, float, float, float, float, float]

# Floats: time at the start of the step, now, and of the quantities found [s], negative when that is
# not known; the span of the sums [s]; highest elevation that can come [m]; rho g [N/m^3]; volume
# [m^3] and its emerged share; decay, least depth and speed step of the mean loads; box around the boat
# and around its cells, corners [m]; state with velocities relative to the water; load of emergence; added
# mass of the left-hand side and of the wet part; mean load at the end of the span. Then the curves of the
# quantities over the span, and more by ``AT``.
START, NOW, VALUES_AT, SPAN_START, SPAN_END, CREST, SPECIFIC_WEIGHT, VOLUME, EMERGED = range(9)
DECAY, LEAST, SPEED_STEP = 9, 10, 11
BOX, CELL_BOX, FELT, LOST, ADDED, WET, MEAN, CURVES = 12, 18, 24, 36, 42, 78, 114, 120
# Whole numbers: whether there are waves and mean loads; how many quantities, those of them that are always
# wanted, stations, cells and sections; speeds, headings and depths of the mean loads; where the rest stands.
WAVES, DRIFT, WIDTH, WANTED, N_STATIONS, N_CELLS, N_SECTIONS = range(7)
SPEEDS, HEADINGS, DEPTHS = 7, 8, 9
AT_SURFACE, AT_CELLS, AT_DRIFT, AT_PARTS, AT_SECTIONS, AT_DRY = range(10, 16)
PLACES = 16
# What stands in the place of the impulse: all that the waves load the submerged boat with.
LOAD = IMPULSE
# Times of a flight that differ by less are one [s].
_SAME_TIME = 1e-9


class Near(NamedTuple):
    """What the right-hand side needs of the surroundings: floats and whole numbers."""

    a: Array
    b: Whole


class Surroundings(NamedTuple):
    """Of one boat and thread.

    sea, sums : Waves and the boat's points in them; a sea without components is calm.
    near : What the right-hand side needs.
    """

    near: Near
    sea: Sea
    sums: Passage


# Surroundings, or an empty tuple in deep, calm water: the compiler tells them apart.
Around: TypeAlias = Any


def surroundings_of(
    sea: Sea, cells: Cells, drift: Drift, added: Array, parts: Array, specific_weight: float
) -> Surroundings:
    """Surroundings with arrays of their own.

    Parameters
    ----------
    sea, cells, drift : Waves, cells of the hull and mean loads, shared by threads.
    added : (6, 6) added mass of the left-hand side. parts : (k + 1, 6, 6) what each section has of
        it, then the rest. specific_weight : rho g [N/m^3].
    """
    sums, count = passage(sea), len(parts) - 1
    volume = np.bincount(cells.section, weights=cells.volumes, minlength=count).astype(float)
    floats, places = flat_cells(cells)
    width = sums.value.shape[1]
    pieces = (np.zeros(sea.stations), floats, drift.loads, parts, volume, np.zeros(count))
    ends = CURVES + CURVE * width + np.cumsum([0, *(p.size for p in pieces)])
    a, b = np.zeros(ends[-1]), np.zeros(PLACES, dtype=np.int64)
    for start, piece in zip(ends[:-1], pieces, strict=True):
        a[start : start + piece.size] = piece.ravel()
    b[AT_SURFACE : AT_DRY + 1] = ends[:-1]
    sums = sums._replace(time=a[SPAN_START : SPAN_END + 1])
    sums.time[:] = 0.0, -1.0
    a[VALUES_AT], a[CREST], a[SPECIFIC_WEIGHT] = -1.0, sea.crest, specific_weight
    a[VOLUME] = float(sum(cells.volumes))
    a[DECAY], a[LEAST], a[SPEED_STEP] = drift.decay, drift.least, drift.speed_step
    a[BOX : BOX + 6], a[CELL_BOX : CELL_BOX + 6] = sea.box.ravel(), np.concatenate([cells.low, cells.high])
    a[ADDED : ADDED + 36] = added.ravel()
    b[[WAVES, DRIFT]] = sea.waves.amplitude.size > 0, drift.loads.shape[0] > 0
    b[[WIDTH, WANTED, N_STATIONS]] = width, width - sea.stations - 1, sea.stations
    b[[N_CELLS, N_SECTIONS]] = cells.volumes.size, count
    b[[SPEEDS, HEADINGS, DEPTHS]] = drift.loads.shape[:3]
    return Surroundings(Near(a, np.concatenate([b, places])), sea, sums)


@inner
def _wet_added_mass(a: Array, b: Whole, share: float) -> None:
    """Added mass of the wet part of every section."""
    count, parts = b[N_SECTIONS], b[AT_PARTS]
    for i in range(36):
        a[WET + i] = (1.0 - share) * a[parts + 36 * count + i]
    for k in range(count):
        # A section that owns no cell comes out with the boat as a whole.
        volume, dry = a[b[AT_SECTIONS] + k], a[b[AT_DRY] + k]
        left = 1.0 - dry / volume if volume > 0.0 else 1.0 - share
        for i in range(36):
            a[WET + i] += left * a[parts + 36 * k + i]


@inlined
def _passed(a: Array) -> float:
    """Part of the present span that has passed."""
    return (a[NOW] - a[SPAN_START]) / (a[SPAN_END] - a[SPAN_START])


@inner
def _emerge(a: Array, b: Whole, y: Array, down: Axis) -> float:
    """Emerged share of the volume; load and added mass of what is left into ``a``."""
    stations, surface, lowest = b[N_STATIONS], b[AT_SURFACE], 0.0
    if b[WAVES]:
        t, first = _passed(a), CURVES + CURVE * (b[WIDTH] - stations)
        for i in range(stations):
            a[surface + i] = height(a, first + CURVE * i, t)
            lowest = min(lowest, a[surface + i])
    if y[Z] + box_top(a, CELL_BOX, down[0], down[1], down[2]) + lowest > 0.0:
        for i in range(6):
            a[LOST + i] = 0.0
        return 0.0
    weight, dry = a[SPECIFIC_WEIGHT], b[AT_DRY]
    lost = lose(a, b[AT_CELLS], b[N_CELLS], b, PLACES, y, surface, weight, LOST, dry, b[N_SECTIONS])
    share = lost / a[VOLUME]
    if share > 0.0:
        _wet_added_mass(a, b, share)
    return share


@inner
def _mean_load(a: Array, b: Whole, y: Array) -> Mean:
    size = (b[SPEEDS], b[HEADINGS], b[DEPTHS])
    return mean_load(a, b[AT_DRIFT], size[0], size[1], size[2], a[DECAY], a[LEAST], a[SPEED_STEP], y)


@inner
def _add_mean(a: Array, b: Whole, y: Array, anew: bool, sums: Passage) -> None:
    """Add the mean second-order loads to the Froude-Krylov loads at the ends of a span.

    Their slope is that between the ends: they change as slowly as the boat moves.
    """
    ahead = _mean_load(a, b, sums.state)
    if anew:
        now = _mean_load(a, b, y)
        for i in range(6):
            a[MEAN + i] = now[i]
    for i in range(6):
        slope = (ahead[i] - a[MEAN + i]) / (a[SPAN_END] - a[SPAN_START])
        if anew:
            sums.value[0, FORCE + i] += a[MEAN + i]
            sums.slope[0, FORCE + i] += slope
        sums.value[1, FORCE + i] += ahead[i]
        sums.slope[1, FORCE + i] += slope
        a[MEAN + i] = ahead[i]


@inner
def _fit(a: Array, sums: Passage) -> None:
    """Curves of the quantities over the span, and of all that the waves load the submerged boat with."""
    span = a[SPAN_END] - a[SPAN_START]
    fit(sums.value, sums.slope, span, a, CURVES)
    for i in range(6):
        force, load = CURVES + CURVE * (FORCE + i), CURVES + CURVE * (LOAD + i)
        for k in range(1, CURVE):
            a[load + k] = a[force + k]
        for j in range(6):
            # The rate of a curve is one of a degree less.
            water, mass = CURVES + CURVE * (WATER + j), a[ADDED + 6 * i + j] / span
            for k in range(1, CURVE - 1):
                a[load + k] += mass * k * a[water + k + 1]


@inner
def _cover(a: Array, b: Whole, sea: Sea, y: Array, time: float, sums: Passage) -> None:
    """Sums and curves of the span that begins now."""
    if a[SPAN_END] > a[SPAN_START]:
        recall(a, CURVES, a[SPAN_END] - a[SPAN_START], sums.value, sums.slope)
    anew = move_on(sea, y, time, sums)
    if b[DRIFT]:
        _add_mean(a, b, y, anew, sums)
    _fit(a, sums)
    a[VALUES_AT] = -1.0


def prepare(around: Around, y: Array, time: float) -> None:
    """Make the surroundings ready for a step that starts at ``y`` [SI] and ``time`` [s]."""
    a = around.near.a
    a[START] = a[NOW] = time
    # Sums that still cover the time are left alone here: handing them over takes as long as a step.
    covered = a[SPAN_START] <= time < a[SPAN_END] - 1e-9 * (a[SPAN_END] - a[SPAN_START])
    if around.near.b[WAVES] and not covered:
        _cover(a, around.near.b, around.sea, y, time, around.sums)


def read_gauge(around: Around, state: Array, rate: Array) -> None:
    """Change depth and its rate to what the boat's depth gauge reads in the pressure of the waves.

    That is p/(rho g) at the body origin and its rate along the motion beside the depth.

    Parameters
    ----------
    around : After ``prepare``.
    state, rate : (12,) of the boat at the time of the clock; entry 8 is changed.
    """
    a, b = around.near.a, around.near.b
    if b[WAVES]:
        at, t = CURVES + CURVE * b[WANTED], _passed(a)
        state[Z] += height(a, at, t)
        rate[Z] += rise(a, at, t) / (a[SPAN_END] - a[SPAN_START])


def near_of(around: Around) -> Around:
    """What the right-hand side needs of the surroundings; empty in deep, calm water."""
    return around.near if len(around) else ()


def tick(near: Around, offset: float) -> None:
    """Set the clock to the start of the step plus ``offset`` [s]."""
    near.a[NOW] = near.a[START] + offset


def observe(near: Around, y: Array) -> None:
    """Wave quantities and relative velocities of state ``y`` at the time of the clock."""
    a, b = near.a, near.b
    a[FELT + Z] = y[Z]
    for i in range(6):
        a[FELT + i] = y[i]
    if b[WAVES]:
        # Two stages of a step are at the same time, and the next step begins where one ends.
        if abs(a[VALUES_AT] - a[NOW]) > _SAME_TIME:
            t = _passed(a)
            for i in range(LOAD, b[WANTED]):
                a[CURVES + CURVE * i] = height(a, CURVES + CURVE * i, t)
            a[VALUES_AT] = a[NOW]
        for i in range(6):
            a[FELT + i] -= a[CURVES + CURVE * (WATER + i)]


def relative(near: Around, y: Array) -> tuple[Array, int]:
    """Where a state with velocities relative to the water stands, after ``observe``: array and place."""
    return near.a, FELT


def plane_inflow(near: Around, plane: int) -> tuple[float, float, float]:
    """Velocity of the water at a plane, body axes [m/s], after ``observe``."""
    if not near.b[WAVES]:
        return 0.0, 0.0, 0.0
    k = CURVES + CURVE * (PROBES + 3 * plane)
    return near.a[k], near.a[k + CURVE], near.a[k + 2 * CURVE]


def propeller_inflow(near: Around, planes: int) -> float:
    """Velocity of the water ahead at the propeller [m/s], after ``observe``."""
    return near.a[CURVES + CURVE * (PROBES + 3 * planes)] if near.b[WAVES] else 0.0


@inner
def _add_emerged(a: Array, share: float, out: Array) -> None:
    """Loads of waves on a hull that is partly out of the water, to ``out``."""
    t, span = _passed(a), a[SPAN_END] - a[SPAN_START]
    for j in range(6):
        rate = rise(a, CURVES + CURVE * (WATER + j), t) / span
        for i in range(6):
            out[i] += a[WET + 6 * i + j] * rate
    for i in range(6):
        out[i] += (1.0 - share) * height(a, CURVES + CURVE * (FORCE + i), t)


def add_loads(near: Around, y: Array, down: Axis, out: Array) -> None:
    """Add the loads of waves and emergence, X Y Z K M N body axes [N, N m], to ``out``.

    Parameters
    ----------
    down : Vertical axis in body axes, the last row of ``sim.waves.pressure.rotation``.
    """
    a, b = near.a, near.b
    share = 0.0
    if y[Z] + box_top(a, BOX, down[0], down[1], down[2]) < a[CREST]:
        share = _emerge(a, b, y, down)
        for i in range(6):
            out[i] += a[LOST + i]
    a[EMERGED] = share
    if b[WAVES]:
        if share > 0.0:
            _add_emerged(a, share, out)
        else:
            for i in range(6):
                out[i] += a[CURVES + CURVE * (LOAD + i)]


def is_emerged(near: Around) -> bool:
    """Whether the hull is partly out of the water, after ``add_loads``."""
    return near.a[EMERGED] > 0.0


def wet_change(near: Around, i: int, j: int) -> float:
    """Added mass of the wet part less that of the left-hand side, one entry."""
    return near.a[WET + 6 * i + j] - near.a[ADDED + 6 * i + j]


# In deep, calm water none of this is compiled: the compiler chooses by the type.
def _calm_prepare(around: Around, y: Array, time: float) -> None:
    pass


def _calm_read_gauge(around: Around, state: Array, rate: Array) -> None:
    pass


def _near(around: Around) -> Around:
    return around.near


def _calm_near(around: Around) -> Around:
    return ()


def _calm_tick(near: Around, offset: float) -> None:
    pass


def _calm_observe(near: Around, y: Array) -> None:
    pass


def _calm_relative(near: Around, y: Array) -> tuple[Array, int]:
    return y, 0


def _calm_plane_inflow(near: Around, plane: int) -> tuple[float, float, float]:
    return 0.0, 0.0, 0.0


def _calm_propeller_inflow(near: Around, planes: int) -> float:
    return 0.0


def _calm_add_loads(near: Around, y: Array, down: Axis, out: Array) -> None:
    pass


def _calm_is_emerged(near: Around) -> bool:
    return False


def _calm_wet_change(near: Around, i: int, j: int) -> float:
    return 0.0


@overload(prepare, jit_options=CHOSEN_INLINED)
def _choose_prepare(around: Around, y: Array, time: float) -> object:
    return prepare if len(around) else _calm_prepare


@overload(read_gauge, jit_options=CHOSEN)
def _choose_read_gauge(around: Around, state: Array, rate: Array) -> object:
    return read_gauge if len(around) else _calm_read_gauge


@overload(near_of, inline="always")
def _choose_near(around: Around) -> object:
    return _near if len(around) else _calm_near


@overload(tick, jit_options=CHOSEN)
def _choose_tick(near: Around, offset: float) -> object:
    return tick if len(near) else _calm_tick


@overload(observe, jit_options=CHOSEN_INLINED)
def _choose_observe(near: Around, y: Array) -> object:
    return observe if len(near) else _calm_observe


@overload(relative, inline="always")
def _choose_relative(near: Around, y: Array) -> object:
    return relative if len(near) else _calm_relative


@overload(plane_inflow, jit_options=CHOSEN)
def _choose_plane_inflow(near: Around, plane: int) -> object:
    return plane_inflow if len(near) else _calm_plane_inflow


@overload(propeller_inflow, jit_options=CHOSEN)
def _choose_propeller_inflow(near: Around, planes: int) -> object:
    return propeller_inflow if len(near) else _calm_propeller_inflow


@overload(add_loads, jit_options=CHOSEN_INLINED)
def _choose_add_loads(near: Around, y: Array, down: Axis, out: Array) -> object:
    return add_loads if len(near) else _calm_add_loads


@overload(is_emerged, jit_options=CHOSEN)
def _choose_is_emerged(near: Around) -> object:
    return is_emerged if len(near) else _calm_is_emerged


@overload(wet_change, jit_options=CHOSEN)
def _choose_wet_change(near: Around, i: int, j: int) -> object:
    return wet_change if len(near) else _calm_wet_change
