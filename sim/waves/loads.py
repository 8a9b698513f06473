"""Loads of waves on a submerged boat and the water's velocity where it is felt, compiled.

Three linear functions of one wave field, over points fixed in the boat:

* Froude-Krylov force, rho dv/dt summed over the volume points of ``sim.waves.pressure``;
* the added-mass impulse of the sections of Eqs. (36)-(41), I = sum J_i^T c_i m_i v_wave(r_i)
  with J = [1, -[r]x], and nu_water, the rigid motion with the same impulse: what the drift,
  rotation and rotating-arm tables see as the water's motion. The added-mass load of the waves
  is A d(nu_water)/dt with the A of the left-hand side, so that both sides make one
  -A d(nu - nu_water)/dt whatever the sections' own sum is, and a boat in long waves is
  carried like the water;
* the water's velocity at planes and propeller.

The rate follows the sections as they move (encounter frequency), less Omega x v, because
the tables hold the Munk and centripetal parts for the relative motion.

The same sums give the elevation of the surface over stations of the boat, when it is near
enough to come out of the water.

Sums of many components run in single precision (1e-6 of the load) on phases reduced in double
precision. ``sim.waves.passage`` makes them along a path, once in a while.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, floor, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.boat.state import PHI, PSI, THETA, X, Y, Z
from sim.compiled import inlined, outer
from sim.waves.linear import Waves
from sim.waves.pressure import Quadrature, box_top, fill_rotation
from sim.waves.sums import sum_few, sum_many

Array = NDArray[np.float64]
Single = NDArray[np.float32]

# Layout of the vector of wave quantities: then three velocities a probe, the head of the wave's
# pressure at the depth gauge, one elevation a station.
FORCE, IMPULSE, WATER, PROBES = 0, 6, 12, 18
# From this many components on, single precision in vector registers is faster.
MANY = 8
TWO_PI, HALF_PI = 2.0 * np.pi, 0.5 * np.pi
# A crest higher than this many standard deviations of the elevation does not come.
_HIGHEST = 6.0


class Sea(NamedTuple):
    """Waves and the boat's points in them; shared by threads.

    waves : Components; a sea without components is calm and must not be evaluated.
    single : (6, n) k, k cos chi, k sin chi, omega, cos chi, sin chi in single precision.
    points : (v + s + p + 1 + e, 3) volume points, section centres, probes, the depth gauge,
        stations over which the elevation is wanted, in the body frame [m].
    masses : (v,) rho V of the volume points [kg].
    sections : (s, 3) c m in x, y, z of the sections [kg].
    compliance : (6, 6) inverse of the added mass; zero where there is none.
    stations : e. box : (2, 3) corners of a box around the boat [m]. crest : Highest elevation
        that can come [m].
    span : Time between sums [s]. reach : Largest miss of a predicted point that is accepted [m].
    """

    waves: Waves
    single: Single
    points: Array
    masses: Array
    sections: Array
    compliance: Array
    stations: int
    box: Array
    crest: float
    span: float
    reach: float


class Passage(NamedTuple):
    """Sums before and after the present and scratch arrays; one a thread.

    time : (2,) of the sums [s]; time[1] < time[0] before the first.
    value, slope : (2, n) quantities in the layout FORCE, IMPULSE, WATER, PROBES and their rates.
    state : (12,) predicted for time[1]. before : (6,) velocities at time[0].
    """

    time: Array
    value: Array
    slope: Array
    state: Array
    before: Array
    size: Array
    phase: Array
    single_size: Single
    single_phase: Single
    place: Array
    motion: Array
    sums: Array
    body: Array
    matrix: Array


def section_added_mass(centre: Array, mass: Array) -> Array:
    """J^T diag(c m) J with J = [1, -[r]x], Eqs. (36)-(41): what a section adds about the origin.

    Parameters
    ----------
    centre, mass : (3,) r [m] and c m in x, y, z [kg].

    Returns
    -------
    (6, 6) [kg, kg m, kg m^2].
    """
    x, y, z = centre
    motion = np.hstack([np.eye(3), -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])])
    return np.asarray(motion.T @ (mass[:, None] * motion))


@dataclass(frozen=True)
class Summing:
    """How often wave components are summed along a boat's path.

    Attributes
    ----------
    span : Time between sums [s]; the error of the loads falls with its fourth power.
    reach : Largest accepted miss of a predicted point before the sum is done again [m].
    """

    span: float = 0.4
    reach: float = 0.05


SUMMING = Summing()


@dataclass(frozen=True)
class Gauges:
    """Where the elevation of the surface is wanted.

    Attributes
    ----------
    stations : (e,) x [m].
    box : (2, 3) corners of a box around the boat [m].
    """

    stations: Array
    box: Array


def make_sea(
    waves: Waves,
    volume: Quadrature,
    centres: Array,
    masses: Array,
    probes: Array,
    summing: Summing = SUMMING,
    gauges: Gauges | None = None,
) -> Sea:
    """Waves and a boat in them.

    Parameters
    ----------
    waves : Components.
    volume : Volume points of the hull.
    centres, masses : (s, 3) section centres [m] and c m in x, y, z [kg], Table 6.
    probes : (p, 3) where the water's velocity is wanted: planes, then propeller [m].
    summing : How often the components are summed.
    gauges : Where the elevation is wanted; nowhere when None.

    Raises
    ------
    ValueError
        For a span that is not positive.
    """
    if not summing.span > 0.0:
        raise ValueError("span must be positive")
    centres, masses, probes = (np.reshape(np.asarray(a, dtype=float), (-1, 3)) for a in (centres, masses, probes))
    added = np.zeros((6, 6))
    for r, m in zip(centres, masses, strict=True):
        added += section_added_mass(r, m)
    along = np.asarray(gauges.stations, dtype=float) if gauges else np.zeros(0)
    over = np.column_stack([along, np.zeros((along.size, 2))])
    gauge = np.zeros((1, 3))
    k, w, a = waves.number, waves.frequency, waves.amplitude
    single = np.stack([k, k * waves.north, k * waves.east, w, waves.north, waves.east])
    return Sea(
        waves,
        np.ascontiguousarray(single, dtype=np.float32),
        np.concatenate([volume.points, centres, probes, gauge, over]),
        waves.density * volume.volumes,
        masses,
        np.asarray(np.linalg.pinv(added, rcond=1e-12, hermitian=True), dtype=float),
        along.size,
        np.asarray(gauges.box, dtype=float) if gauges else np.zeros((2, 3)),
        float(min(a.sum(), _HIGHEST * np.sqrt(0.5 * a @ a))),
        float(summing.span),
        float(summing.reach),
    )


def passage(sea: Sea) -> Passage:
    """Empty sums for one thread."""
    n, points = sea.waves.amplitude.size, len(sea.points)
    felt = 1 + sea.stations
    width = PROBES + 3 * (points - len(sea.masses) - len(sea.sections) - felt) + felt
    return Passage(
        time=np.array([0.0, -1.0]),
        value=np.zeros((2, width)),
        slope=np.zeros((2, width)),
        state=np.zeros(12),
        before=np.zeros(6),
        size=np.zeros((3, n)),
        phase=np.zeros((3, n)),
        single_size=np.zeros((3, n), dtype=np.float32),
        single_phase=np.zeros((3, n), dtype=np.float32),
        place=np.zeros((points, 3)),
        motion=np.zeros((points, 3)),
        sums=np.zeros(6),
        body=np.zeros(6),
        matrix=np.zeros((3, 3)),
    )


@inlined
def _place(sea: Sea, y: Array, time: float, pas: Passage) -> None:
    """Points and their velocities from the shallowest one, in earth axes; phases and sizes there."""
    m, w = pas.matrix, sea.waves
    fill_rotation(y[PHI], y[THETA], y[PSI], m)
    top, gauge = np.inf, sea.points.shape[0] - sea.stations - 1
    for i in range(sea.points.shape[0]):
        a, b, c = sea.points[i, 0], sea.points[i, 1], sea.points[i, 2]
        u = y[0] + y[4] * c - y[5] * b
        v = y[1] + y[5] * a - y[3] * c
        d = y[2] + y[3] * b - y[4] * a
        for k in range(3):
            pas.place[i, k] = m[k, 0] * a + m[k, 1] * b + m[k, 2] * c
            pas.motion[i, k] = m[k, 0] * u + m[k, 1] * v + m[k, 2] * d
        # Above the calm surface the waves keep the values they have there.
        pas.place[i, 2] = max(y[Z] + pas.place[i, 2], 0.0)
        if i < gauge:
            top = min(top, pas.place[i, 2])
    for i in range(gauge):
        pas.place[i, 2] -= top
    for i in range(gauge + 1, sea.points.shape[0]):
        pas.place[i, 2] = pas.motion[i, 2] = 0.0
    # Where the boat is in the water that carries the waves.
    north, east = y[X] - w.flow_north * time, y[Y] - w.flow_east * time
    for j in range(w.amplitude.size):
        angle = w.number[j] * (w.north[j] * north + w.east[j] * east) - w.frequency[j] * time + w.phase[j]
        angle -= TWO_PI * floor(angle / TWO_PI)
        size = w.amplitude[j] * w.frequency[j] * exp(-w.number[j] * top)
        # Acceleration is the velocity a quarter period earlier times the frequency.
        pas.size[0, j], pas.phase[0, j] = size * w.frequency[j], angle - HALF_PI
        pas.size[1, j], pas.phase[1, j] = size, angle
        # -sin a quarter period earlier is the cosine of the elevation.
        pas.size[2, j], pas.phase[2, j] = w.amplitude[j], angle - HALF_PI
        for kind in range(3):
            pas.single_size[kind, j] = pas.size[kind, j]
            pas.single_phase[kind, j] = pas.phase[kind, j]


@inlined
def _to_body(sums: Array, m: Array, y: Array, body: Array) -> None:
    """Earth vector and rate to body axes; the rate is that of the body-axis components."""
    for k in range(3):
        body[k] = m[0, k] * sums[0] + m[1, k] * sums[1] + m[2, k] * sums[2]
        body[3 + k] = m[0, k] * sums[3] + m[1, k] * sums[4] + m[2, k] * sums[5]
    body[3] -= y[4] * body[2] - y[5] * body[1]
    body[4] -= y[5] * body[0] - y[3] * body[2]
    body[5] -= y[3] * body[1] - y[4] * body[0]


@inlined
def _add(points: Array, i: int, fx: float, fy: float, fz: float, out: Array, at: int) -> None:
    """Add a vector acting at a point and its moment about the origin."""
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    out[at] += fx
    out[at + 1] += fy
    out[at + 2] += fz
    out[at + 3] += y * fz - z * fy
    out[at + 4] += z * fx - x * fz
    out[at + 5] += x * fy - y * fx


@inlined
def _near(sea: Sea, y: Array, matrix: Array) -> bool:
    """Whether a crest can reach the boat before the next sums; ``matrix`` turns body to earth."""
    rise = sea.span * sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2])
    return y[Z] + box_top(sea.box.reshape(6), 0, matrix[2, 0], matrix[2, 1], matrix[2, 2]) - rise <= sea.crest


@outer
def evaluate(sea: Sea, y: Array, time: float, pas: Passage, value: Array, slope: Array) -> None:
    """Every wave quantity at a state, exactly, with its rate along the present motion.

    Parameters
    ----------
    sea : With at least one component.
    y : (12,) state.
    time : [s].
    pas : Scratch arrays.
    value, slope : (n,) results, body axes about the body origin: FORCE Froude-Krylov load
        [N, N m], IMPULSE [kg m/s, kg m^2/s], WATER u v w p q r [m/s, rad/s], PROBES three
        velocities each [m/s], head of the wave's pressure at the gauge [m], elevation over each
        station [m, up], zero where no crest comes near the boat; and their rates. The rate of
        IMPULSE is the added-mass load.
    """
    _place(sea, y, time, pas)
    sums, body, many = pas.sums, pas.body, sea.waves.amplitude.size >= MANY
    n, s = sea.masses.size, sea.sections.shape[0]
    gauge = sea.points.shape[0] - sea.stations - 1
    for i in range(value.size):
        value[i] = slope[i] = 0.0
    for i in range(sea.points.shape[0] if _near(sea, y, pas.matrix) else gauge + 1):
        kind = 0 if i < n else (1 if i < gauge else 2)
        if many:
            sum_many(sea.single, pas.single_size, pas.single_phase, kind, pas.place, pas.motion, i, sums)
        else:
            sum_few(sea.waves, pas.size, pas.phase, kind, pas.place, pas.motion, i, sums)
        if i >= gauge:
            value[PROBES + 3 * (gauge - n - s) + i - gauge] = sums[2]
            slope[PROBES + 3 * (gauge - n - s) + i - gauge] = sums[5]
            continue
        _to_body(sums, pas.matrix, y, body)
        if i < n:
            m = sea.masses[i]
            _add(sea.points, i, m * body[0], m * body[1], m * body[2], value, FORCE)
            _add(sea.points, i, m * body[3], m * body[4], m * body[5], slope, FORCE)
        elif i < n + s:
            m0, m1, m2 = sea.sections[i - n, 0], sea.sections[i - n, 1], sea.sections[i - n, 2]
            _add(sea.points, i, m0 * body[0], m1 * body[1], m2 * body[2], value, IMPULSE)
            _add(sea.points, i, m0 * body[3], m1 * body[4], m2 * body[5], slope, IMPULSE)
        else:
            at = PROBES + 3 * (i - n - s)
            for k in range(3):
                value[at + k] = body[k]
                slope[at + k] = body[3 + k]
    for i in range(6):
        for j in range(6):
            value[WATER + i] += sea.compliance[i, j] * value[IMPULSE + j]
            slope[WATER + i] += sea.compliance[i, j] * slope[IMPULSE + j]
