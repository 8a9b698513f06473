"""Maneuvers in waves and through the surface: calm limit, long waves, symmetry, drift, published harmonics."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from ident.metrics.in_waves import in_waves, irregular_waves, regular_waves, turn_drift
from sim.flight.case import Case, load_case
from sim.flight.environment import WavesData
from sim.flight.simulate import model_of, simulate, water_of
from sim.waves.in_waves import shares, surroundings, water_around
from sim.waves.linear import kinematics, regular
from sim.waves.mean_loads import dipole_body, plane_waves, scattering
from sim.waves.pressure import rotation
from sim.waves.surroundings import prepare, read_gauge


def _changed(name: str, **parts: dict) -> Case:
    """A bundled case with keys of its sections changed."""
    case = load_case(name)[0]
    update = {k: getattr(case, k).model_copy(update=v) if getattr(case, k) is not None else v for k, v in parts.items()}
    return case.model_copy(update=update)


def _adrift(depth: float, waves: WavesData, duration: float) -> Case:
    """A boat at rest with its planes fixed and no propeller."""
    case = load_case("roll-decay")[0]
    start = case.initial.model_copy(update={"speed_mps": 0.0, "depth_m": depth, "heel_deg": 0.0})
    run = case.run.model_copy(update={"duration_s": duration, "step_s": 0.1, "record_s": 0.5})
    return case.model_copy(update={"initial": start, "run": run, "waves": waves, "reference": None})


def test_waves_of_no_height_are_calm_to_the_last_digit(coefficients):
    calm = _changed("ss5-2.5m", run={"duration_s": 20.0}).model_copy(update={"waves": None})
    flat = _changed("ss5-2.5m", run={"duration_s": 20.0}, waves={"height_m": 0.0})
    assert np.array_equal(simulate(calm, coefficients).record, simulate(flat, coefficients).record)


def test_a_surface_out_of_reach_changes_no_digit(coefficients):
    """Emergence is compiled in and has nothing to do."""
    calm = _changed("hzz20", run={"duration_s": 30.0})
    below = _changed("hzz20", run={"duration_s": 30.0}, environment={"free_surface": True})
    assert np.array_equal(simulate(calm, coefficients).record, simulate(below, coefficients).record)


@pytest.mark.parametrize("direction", [180.0, 60.0])
def test_long_waves_carry_a_boat_at_rest_like_water(coefficients, direction):
    """Waves of 100 boat lengths: the boat's velocity changes by the water's, 2 % of the orbital speed."""
    waves = WavesData(kind="regular", height_m=0.2, length_m=7000.0, direction_deg=direction, second_order=False)
    case = _adrift(30.0, waves, 60.0)
    flown = simulate(case, coefficients)
    wave = flown.waves
    velocity = np.array(
        [
            rotation(phi, theta, psi) @ [u, v, w]
            for u, v, w, phi, theta, psi in zip(
                *(flown[k] for k in ("u", "v", "w", "phi", "theta", "psi")), strict=True
            )
        ]
    )
    place = np.column_stack([flown["x"], flown["y"], flown["z"]])
    water = kinematics(wave, place, flown["t"]).velocity
    size = 0.1 * wave.frequency[0]
    assert velocity - velocity[0] == pytest.approx(water - water[0], abs=0.02 * size)


def test_port_and_starboard_seas_give_mirrored_motions(coefficients):
    port, starboard = (
        simulate(
            _adrift(12.0, WavesData(kind="regular", height_m=2.0, length_m=120.0, direction_deg=d), 30.0), coefficients
        )
        for d in (-70.0, 70.0)
    )
    for channel, sign in (("y", -1), ("phi", -1), ("psi", -1), ("x", 1), ("z", 1), ("theta", 1)):
        scale = np.abs(port[channel]).max()
        assert starboard[channel] == pytest.approx(sign * port[channel], abs=1e-6 * scale + 1e-12), channel


def test_deep_boats_move_by_exp_kz(coefficients):
    """Amplitudes 30 m deeper, small waves: exp(-30 k) of those above."""
    found = []
    for depth in (30.0, 60.0):
        waves = WavesData(kind="regular", height_m=0.02, length_m=140.0, direction_deg=180.0, second_order=False)
        flown = simulate(_adrift(depth, waves, 40.0), coefficients)
        found.append([np.ptp(flown["z"] - np.polyval(np.polyfit(flown["t"], flown["z"], 1), flown["t"]))])
    assert found[1][0] / found[0][0] == pytest.approx(np.exp(-30.0 * 2.0 * np.pi / 140.0), rel=0.03)


@njit
def _gauge(around, state, rate, time):
    prepare(around, state, time)
    read_gauge(around, state, rate)


def test_a_depth_gauge_reads_depth_and_the_head_of_the_wave(coefficients, environment, model):
    wave = regular(3.0, 120.0, 2.0, environment.density, environment.gravity)
    around = surroundings(water_around(coefficients, environment, wave, second_order=False), model.added_mass)
    state, rate = np.zeros(12), np.zeros(12)
    state[0], state[6:9], rate[6] = 5.0, (30.0, -20.0, 17.0), 5.0

    def head(t):
        place = state[6:9] + np.array([5.0 * t, 0.0, 0.0])
        return kinematics(wave, place, 3.0 + t).pressure / (environment.density * environment.gravity)

    read, change = state.copy(), rate.copy()
    _gauge(around, read, change, 3.0)
    assert read[8] == pytest.approx(17.0 + head(0.0), abs=1e-9)
    assert change[8] == pytest.approx((head(1e-3) - head(-1e-3)) / 2e-3, abs=1e-6)
    assert np.array_equal(np.delete(read, 8), np.delete(state, 8))


def test_parts_of_the_added_mass_are_positive_and_sum_to_it(coefficients, environment, model):
    wave = regular(3.0, 120.0, 2.0, environment.density, environment.gravity)
    water = water_around(coefficients, environment, wave, second_order=False)
    parts = shares(model.added_mass, water.centres, water.masses)
    assert parts.sum(axis=0) == pytest.approx(model.added_mass, rel=1e-9, abs=1e-6)
    scale = np.sqrt(np.diag(model.added_mass))
    values = np.linalg.eigvalsh(parts / np.outer(scale, scale))
    assert values.min() > -1e-9
    # Sections carry all of it but what the congruence cannot reach.
    assert np.abs(parts[-1] / np.outer(scale, scale)).max() < 1e-6


def test_a_rise_goes_through_the_surface_without_a_jump(coefficients):
    """Half the step gives the same flight, and no velocity jumps by more than the loads allow."""
    coarse, fine = (
        simulate(_changed("max-q-surfacing", run={"duration_s": 60.0, "step_s": h}), coefficients)
        for h in (0.05, 0.025)
    )
    assert coarse["D0"].min() < 3.0
    assert np.isfinite(coarse.record).all()
    assert coarse["theta"] == pytest.approx(fine["theta"], abs=np.radians(0.02))
    assert coarse["z"] == pytest.approx(fine["z"], abs=0.01)
    # Weight of the boat on its mass: nothing accelerates faster.
    gravity = 9.81
    assert np.abs(np.diff(coarse["w"])).max() / 0.1 < gravity


def test_a_turning_circle_drifts_with_the_waves(coefficients):
    """Head sea to the south: the centre of the circle goes with the waves by many standard errors."""
    flown = simulate(_changed("turn20-ss5-2.5m", run={"duration_s": 800.0}), coefficients)
    found = turn_drift(flown)
    assert found["drift_along_waves_mps"] > 5.0 * found["drift_stderr_mps"]
    assert found["diameter_stderr_m"] > 0.0
    still = simulate(
        _changed("turn20-ss5-2.5m", run={"duration_s": 800.0}, waves={"second_order": False}), coefficients
    )
    assert turn_drift(still)["drift_along_waves_mps"] > 0.0


@pytest.mark.parametrize(
    ("name", "depth", "pitch"),
    [
        # The published model: 0.94 and 0.83 at 2.5 m, 0.88 and 0.96 at 23.69 m.
        ("ss5-2.5m", (1.05, 1.12), (0.95, 1.05)),
        ("ss5-23.69m", (0.95, 1.05), (1.05, 1.20)),
    ],
)
def test_harmonics_in_head_seas_beside_cfd(coefficients, name, depth, pitch):
    """Depth near the surface and pitch in deep water are not within 5 % of the CFD, and this says so."""
    case = load_case(name)[0]
    flown = _changed(name, run={"duration_s": 400.0})
    found = regular_waves(in_waves(flown, simulate(flown, coefficients)).harmonics)
    cfd = {p.metric: p.value for p in case.published if p.source == "CFD"}
    assert depth[0] < found["dz1_over_aw"] / cfd["dz1_over_aw"] < depth[1]
    assert pitch[0] < found["theta1_deg"] / cfd["theta1_deg"] < pitch[1]


@pytest.mark.parametrize(("depth", "most"), [(2.5, 0.03), (23.69, 0.005)])
def test_the_surface_answers_little_to_a_boat_in_long_waves(coefficients, environment, depth, most):
    """Image, radiated and scattered waves, left out of the first-order loads, change heave and pitch by this much."""
    body = dipole_body(coefficients, environment)
    number = 2.0 * np.pi / 140.9
    frequency = np.sqrt(environment.gravity * number)
    encounter = frequency + 5.14444 * number
    kappa, field = plane_waves(body, number, np.array([np.pi]))
    velocity = frequency / (1j * number) * field
    for answering in (number, encounter**2 / environment.gravity):
        near, far = (scattering(body, answering, kappa, velocity, d + 11.37).motion[0] for d in (depth, depth + 400.0))
        assert np.abs(near[[2, 4]]) == pytest.approx(np.abs(far[[2, 4]]), rel=most)


def test_waves_need_the_geometry_of_the_vehicle(coefficients):
    from sim.files.errors import InputError

    bare = type(coefficients).__new__(type(coefficients))
    vehicle = coefficients.vehicle.model_copy(deep=True, update={"geometry": None})
    bare.__dict__.update(coefficients.__dict__ | {"vehicle": vehicle})
    with pytest.raises(InputError, match="key geometry"):
        water_of(load_case("ss5-4m")[0], bare)
    assert model_of(load_case("ss5-4m")[0], coefficients).added_mass.shape == (6, 6)


@pytest.mark.parametrize(
    ("waves", "words"),
    [
        ({"kind": "regular", "height_m": 1.0}, "length_m"),
        ({"kind": "regular", "height_m": 1.0, "length_m": 9.0, "period_s": 2.0}, "one of length_m and period_s"),
        ({"kind": "regular", "sea_state": 5}, "no sea_state"),
        ({"kind": "jonswap"}, "sea_state"),
        ({"kind": "jonswap", "sea_state": 5, "height_m": 1.0, "period_s": 9.0}, "sea_state"),
        ({"kind": "bretschneider", "sea_state": 5, "length_m": 100.0}, "no length_m"),
        ({"kind": "swell", "sea_state": 5}, "regular"),
    ],
)
def test_a_mistake_in_the_waves_of_a_case_is_named(tmp_path, waves, words):
    from importlib.resources import files

    from sim.files.errors import InputError

    text = (files("sim") / "cases" / "ss5-4m.toml").read_text("utf-8")
    first, last = text.index("[waves]"), text.index("[initial]")
    lines = [f'{k} = "{v}"' if isinstance(v, str) else f"{k} = {v}" for k, v in waves.items()]
    path = tmp_path / "own.toml"
    path.write_text(text[:first] + "\n".join(["[waves]", "direction_deg = 180.0", *lines, "", ""]) + text[last:])
    with pytest.raises(InputError, match="waves") as caught:
        load_case(str(path))
    assert words in str(caught.value)


def test_a_seed_gives_the_same_sea_and_its_statistics(coefficients):
    """Significant values follow the significant height; another seed is another sea of the same size."""
    case = _changed("periscope-depth", run={"duration_s": 900.0})
    first, again = (simulate(case, coefficients) for _ in range(2))
    other = simulate(_changed("periscope-depth", run={"duration_s": 900.0}, waves={"seed": 9}), coefficients)
    assert np.array_equal(first.record, again.record)
    assert not np.array_equal(first.record, other.record)
    found, others = (irregular_waves(in_waves(case, one).statistics, one) for one in (first, other))
    # The boat moves less than the surface, whose significant height is 1.9 m.
    assert 0.2 < found["D0_significant_m"] < 1.9
    assert others["theta_significant_deg"] == pytest.approx(found["theta_significant_deg"], rel=0.35)
    assert found["broaching_per_hour"] == 0.0
    # Longer is nearer to the surface, and what is passed once in a hundred times nearer still.
    least = [found[f"D0_least_{k}_m"] for k in ("3h_1percent_rice", "3h_rice", "rice")]
    assert least == sorted(least)
    # sqrt(2 ln n)/4 of the significant double amplitude: 0.7 for a hundred waves, 1.3 for a million.
    below = (found["D0_mean_m"] - np.array(least)) / found["D0_significant_m"]
    assert 0.5 < below[2] < below[1] < below[0] < 1.5
    assert found["D0_least_m"] == first["D0"].min() < found["D0_mean_m"]
