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
from sim.compiled import inner, merged, outer
from sim.waves.linear import Waves
from sim.waves.pressure import Quadrature, box_top, fill_rotation
from sim.waves.sums import LANES, fill_many, sum_few, sum_many

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
    single : (6, n or a little more) as ``sim.waves.sums.sum_many`` takes it.
    points : (v + s + p + 1 + e, 3) volume points, section centres, probes, the depth gauge,
        stations over which the elevation is wanted, in the body frame [m].
    volumes : v. weights : (v + s, 3) in x, y, z: rho V of the volume points, c m of the sections [kg].
    compliance : (6, 6) inverse of the added mass; zero where there is none.
    stations : e. box : (2, 3) corners of a box around the boat [m]. crest : Highest elevation
        that can come [m].
    span : Time between sums [s]. reach : Largest miss of a predicted point that is accepted [m].
    length : Of the longest way from the origin to a point along x [m].
    """

    waves: Waves
    single: Single
    points: Array
    volumes: int
    weights: Array
    compliance: Array
    stations: int
    box: Array
    crest: float
    span: float
    reach: float
    length: float


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
    scratch: tuple[Array, Array, Array, Array]
    gain: Array
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
    single = np.zeros((6, k.size + -k.size % LANES))
    single[:, : k.size] = k, k / TWO_PI * waves.north, k / TWO_PI * waves.east, w, waves.north, waves.east
    points = np.concatenate([volume.points, centres, probes, gauge, over])
    return Sea(
        waves,
        np.ascontiguousarray(single, dtype=np.float32),
        points,
        len(volume.volumes),
        np.concatenate([np.tile(waves.density * volume.volumes[:, None], 3), masses]),
        np.asarray(np.linalg.pinv(added, rcond=1e-12, hermitian=True), dtype=float),
        along.size,
        np.asarray(gauges.box, dtype=float) if gauges else np.zeros((2, 3)),
        float(min(a.sum(), _HIGHEST * np.sqrt(0.5 * a @ a))),
        float(summing.span),
        float(summing.reach),
        float(np.abs(points[:, 0]).max()),
    )


def passage(sea: Sea) -> Passage:
    """Empty sums for one thread."""
    n, points = sea.waves.amplitude.size, len(sea.points)
    felt = 1 + sea.stations
    width = PROBES + 3 * (points - len(sea.weights) - felt) + felt
    return Passage(
        time=np.array([0.0, -1.0]),
        value=np.zeros((2, width)),
        slope=np.zeros((2, width)),
        state=np.zeros(12),
        before=np.zeros(6),
        size=np.zeros((3, n)),
        phase=np.zeros((3, n)),
        single_size=np.zeros((3, sea.single.shape[1]), dtype=np.float32),
        single_phase=np.zeros((3, sea.single.shape[1]), dtype=np.float32),
        place=np.zeros((points, 3)),
        motion=np.zeros((points, 3)),
        sums=np.zeros((points, 6)),
        scratch=(np.zeros(points), np.zeros(points), np.zeros(points), np.zeros(points)),
        gain=np.zeros(6),
        matrix=np.zeros((3, 3)),
    )


@merged
def _place(sea: Sea, y: Array, last: int, pas: Passage) -> float:
    """Points up to ``last`` and their velocities in earth axes from the shallowest one, whose depth is given [m]."""
    points, place, motion, m = sea.points, pas.place, pas.motion, pas.matrix
    u, v, w, p, q, r, depth = y[0], y[1], y[2], y[3], y[4], y[5], y[Z]
    m00, m01, m02, m10, m11, m12 = m[0, 0], m[0, 1], m[0, 2], m[1, 0], m[1, 1], m[1, 2]
    m20, m21, m22 = m[2, 0], m[2, 1], m[2, 2]
    top, gauge = np.inf, points.shape[0] - sea.stations - 1
    for i in range(last):
        a, b, c = points[i, 0], points[i, 1], points[i, 2]
        ua, va, wa = u + q * c - r * b, v + r * a - p * c, w + p * b - q * a
        place[i, 0], place[i, 1] = m00 * a + m01 * b + m02 * c, m10 * a + m11 * b + m12 * c
        motion[i, 0], motion[i, 1] = m00 * ua + m01 * va + m02 * wa, m10 * ua + m11 * va + m12 * wa
        # Above the calm surface the waves keep the values they have there.
        z = max(depth + m20 * a + m21 * b + m22 * c, 0.0)
        place[i, 2], motion[i, 2] = z, m20 * ua + m21 * va + m22 * wa
        if i < gauge:
            top = min(top, z)
    for i in range(gauge):
        place[i, 2] -= top
    for i in range(gauge + 1, last):
        place[i, 2] = motion[i, 2] = 0.0
    return top


@merged
def _fill_few(w: Waves, north: float, east: float, time: float, top: float, pas: Passage) -> None:
    """Sizes and phases of the components at a place, time and depth."""
    for j in range(w.amplitude.size):
        angle = w.number[j] * (w.north[j] * north + w.east[j] * east) - w.frequency[j] * time + w.phase[j]
        angle -= TWO_PI * floor(angle / TWO_PI)
        size = w.amplitude[j] * w.frequency[j] * exp(-w.number[j] * top)
        # Acceleration is the velocity a quarter period earlier times the frequency.
        pas.size[0, j], pas.phase[0, j] = size * w.frequency[j], angle - HALF_PI
        pas.size[1, j], pas.phase[1, j] = size, angle
        # -sin a quarter period earlier is the cosine of the elevation.
        pas.size[2, j], pas.phase[2, j] = w.amplitude[j], angle - HALF_PI


@merged
def _sum(sea: Sea, y: Array, time: float, last: int, pas: Passage) -> None:
    """Sums at the points up to ``last``, in earth axes."""
    w, top = sea.waves, _place(sea, y, last, pas)
    # Where the boat is in the water that carries the waves.
    north, east = y[X] - w.flow_north * time, y[Y] - w.flow_east * time
    many = w.amplitude.size >= MANY
    if many:
        fill_many(w, north, east, time, top, pas.phase[0], pas.single_size, pas.single_phase)
    else:
        _fill_few(w, north, east, time, top, pas)
    start, ends = 0, (sea.volumes, sea.points.shape[0] - sea.stations - 1, last)
    for kind in range(3):
        end = ends[kind]
        if many:
            sum_many(sea.single, pas.single_size, pas.single_phase, kind, pas.place, pas.motion, start, end, pas.sums)
        else:
            sum_few(w, pas.size[kind], pas.phase[kind], pas.place, pas.motion, start, end, pas.scratch, pas.sums)
        start = end


@merged
def _turn(sums: Array, last: int, m: Array, y: Array) -> None:
    """Earth vectors and their rates to body axes, where they are; the rate is that of the body-axis components."""
    m00, m01, m02, m10, m11, m12 = m[0, 0], m[0, 1], m[0, 2], m[1, 0], m[1, 1], m[1, 2]
    m20, m21, m22, p, q, r = m[2, 0], m[2, 1], m[2, 2], y[3], y[4], y[5]
    for i in range(last):
        a, b, c = sums[i, 0], sums[i, 1], sums[i, 2]
        da, db, dc = sums[i, 3], sums[i, 4], sums[i, 5]
        u, v, w = m00 * a + m10 * b + m20 * c, m01 * a + m11 * b + m21 * c, m02 * a + m12 * b + m22 * c
        sums[i, 0], sums[i, 1], sums[i, 2] = u, v, w
        sums[i, 3] = m00 * da + m10 * db + m20 * dc - (q * w - r * v)
        sums[i, 4] = m01 * da + m11 * db + m21 * dc - (r * u - p * w)
        sums[i, 5] = m02 * da + m12 * db + m22 * dc - (p * v - q * u)


@inner
def _add_up(sea: Sea, first: int, last: int, sums: Array, column: int, out: Array, at: int) -> None:
    """Vectors of points, or their rates, by weights, and their moments about the origin.

    Parameters
    ----------
    column : Of ``sums`` where the vectors begin: 0, or 3 for the rates.
    """
    points, weights = sea.points, sea.weights
    f0 = f1 = f2 = f3 = f4 = f5 = 0.0
    for i in range(first, last):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        a, b = weights[i, 0] * sums[i, column], weights[i, 1] * sums[i, column + 1]
        c = weights[i, 2] * sums[i, column + 2]
        f0 += a
        f1 += b
        f2 += c
        f3 += y * c - z * b
        f4 += z * a - x * c
        f5 += x * b - y * a
    out[at], out[at + 1], out[at + 2], out[at + 3], out[at + 4], out[at + 5] = f0, f1, f2, f3, f4, f5


@merged
def _near(sea: Sea, y: Array, matrix: Array) -> bool:
    """Whether a crest can reach the boat before the next sums; ``matrix`` turns body to earth."""
    rise = sea.span * sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2])
    return y[Z] + box_top(sea.box.reshape(6), 0, matrix[2, 0], matrix[2, 1], matrix[2, 2]) - rise <= sea.crest


@inner
def sum_up(sea: Sea, y: Array, time: float, pas: Passage, value: Array, slope: Array) -> None:
    """``evaluate`` for compiled functions."""
    n, felt, gauge = sea.volumes, sea.weights.shape[0], sea.points.shape[0] - sea.stations - 1
    fill_rotation(y[PHI], y[THETA], y[PSI], pas.matrix)
    last = sea.points.shape[0] if _near(sea, y, pas.matrix) else gauge + 1
    _sum(sea, y, time, last, pas)
    _turn(pas.sums, gauge, pas.matrix, y)
    for i in range(value.size):
        value[i] = slope[i] = 0.0
    start = 0
    for end, at in ((n, FORCE), (felt, IMPULSE)):
        _add_up(sea, start, end, pas.sums, 0, value, at)
        _add_up(sea, start, end, pas.sums, 3, slope, at)
        start = end
    for i in range(felt, gauge):
        at = PROBES + 3 * (i - felt)
        for k in range(3):
            value[at + k], slope[at + k] = pas.sums[i, k], pas.sums[i, 3 + k]
    for i in range(gauge, last):
        at = PROBES + 3 * (gauge - felt) + i - gauge
        value[at], slope[at] = pas.sums[i, 2], pas.sums[i, 5]
    for i in range(6):
        for j in range(6):
            value[WATER + i] += sea.compliance[i, j] * value[IMPULSE + j]
            slope[WATER + i] += sea.compliance[i, j] * slope[IMPULSE + j]


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
    sum_up(sea, y, time, pas, value, slope)
