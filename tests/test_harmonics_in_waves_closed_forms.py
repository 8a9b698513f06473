"""Authority: closed forms. Sums of cosines of a known encountered wave, the Doppler relation
omega_e = omega - k U cos mu, the errors of amplitudes in AR(1) noise.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from flights_in_waves import made_flight
from scipy.signal import lfilter

from ident.metrics.in_waves import in_waves, regular_waves
from ident.metrics.seakeeping import encounter_of, harmonics, harmonics_of
from ident.validation.wave_case_figures import harmonics_over_depth
from ident.validation.wave_figures import harmonics_figure
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.waves.linear import kinematics, make_waves, regular

RHO, G = 1025.0, 9.81
REFERENCE = Path(__file__).parent / "data" / "published" / "bb2" / "waves_ss5.csv"
AMPLITUDES, PHASES = (0.4, 0.05, 0.01), (0.7, -1.1, 2.0)


def met(waves, time, north, east):
    """Theta from the wave field itself: elevation and its quadrature at the boat's place."""
    theta = waves.number * (waves.north * north + waves.east * east) - waves.frequency * time + waves.phase
    rising = theta[-1] > theta[0]
    return theta if rising else -theta


def response(theta, mean=14.0):
    return mean + sum(a * np.cos(k * theta + p) for k, (a, p) in enumerate(zip(AMPLITUDES, PHASES, strict=True), 1))


@pytest.mark.parametrize(
    ("length", "heading", "travels", "speed"),
    [
        (140.9, 0.0, 180.0, 5.14),  # head seas
        (140.9, 0.0, 0.0, 5.14),  # following seas, overtaken by the waves
        (10.0, 0.0, 0.0, 5.14),  # following seas, overtaking the waves
        (140.9, 70.0, 200.0, 4.0),  # bow quartering
        (140.9, 0.0, 180.0, 0.0),  # at rest
    ],
)
def test_known_harmonics_come_back(length, heading, travels, speed):
    """Amplitudes and phases of three harmonics, mean and drift, to seven digits."""
    waves = regular(3.25, length, math.radians(travels), RHO, G, phase=0.4)
    time = np.arange(0.0, 600.0, 0.2)
    course = math.radians(heading)
    north, east = speed * math.cos(course) * time + 30.0, speed * math.sin(course) * time - 12.0
    theta = met(waves, time, north, east)
    surface = kinematics(waves, np.column_stack([north, east, 0.0 * time]), time).elevation
    assert surface == pytest.approx(1.625 * np.cos(theta), abs=1e-9)
    z = response(theta) + 0.002 * (time - time.mean()) + 11.0
    flown = made_flight(time, x=north, y=east, z=z, theta=0.02 * np.cos(theta - 0.3))
    found = harmonics(flown, waves)
    depth, pitch = found["D0"], found["theta"]
    k = 2.0 * math.pi / length
    expected = abs(math.sqrt(G * k) - k * speed * math.cos(course - math.radians(travels)))
    assert depth.encounter.computed == pytest.approx(expected, rel=1e-9)
    assert depth.encounter.frequency == pytest.approx(expected, rel=1e-7)
    assert depth.amplitude == pytest.approx(AMPLITUDES, abs=1e-7)
    assert depth.phase == pytest.approx(PHASES, abs=1e-4)
    # Harmonic 0 is the mean over the window, the drift up to its middle included.
    middle = 0.5 * (depth.start + depth.end) - time.mean()
    assert depth.mean == pytest.approx(14.0 + 0.002 * middle, abs=1e-6)
    assert depth.drift == pytest.approx(0.002 * (depth.end - depth.start), abs=1e-6)
    assert depth.transfer[0] == pytest.approx(0.4 / 1.625, abs=1e-6)
    assert pitch.transfer[0] == pytest.approx(0.02 / (k * 1.625), rel=1e-6)
    assert pitch.phase[0] == pytest.approx(-0.3, abs=1e-4)
    assert np.isfinite([v for v in depth.as_json().values() if isinstance(v, float)]).all()


def test_drift_of_the_order_fitted_does_not_leak():
    """Half a metre of quadratic drift over 3.5 periods: nothing of it in the harmonics."""
    waves = regular(3.25, 140.9, math.pi, RHO, G)
    time = np.arange(0.0, 24.0, 0.05)
    theta = met(waves, time, 5.0 * time, 0.0 * time)
    z = response(theta) + 0.5 * (time / time[-1]) ** 2
    track = np.column_stack([5.0 * time, 0.0 * time])
    first, none = (
        harmonics_of(time, z[:, None], {"z": "m"}, waves, track, drift=order)["z"].amplitude[0] for order in (2, 0)
    )
    assert first == pytest.approx(0.4, abs=1e-6)
    assert abs(none - 0.4) > 1e-3


def test_frequency_is_refined_from_the_record():
    """A boat whose track is recorded 0.3 % short: the record has the true frequency."""
    waves = regular(3.25, 140.9, math.pi, RHO, G)
    time = np.arange(0.0, 900.0, 0.2)
    theta = met(waves, time, 5.14 * time, 0.0 * time)
    track = np.column_stack([0.997 * 5.14 * time, 0.0 * time])
    found = harmonics_of(time, response(theta)[:, None], {"z": "m"}, waves, track)["z"].encounter
    k, omega = float(waves.number[0]), float(waves.frequency[0])
    assert found.computed == pytest.approx(omega + k * 0.997 * 5.14, rel=1e-9)
    assert found.frequency == pytest.approx(omega + k * 5.14, rel=1e-6)


def test_record_without_the_wave_keeps_the_computed_frequency():
    """White noise has no optimum inside; where one is found, it stays within half a line."""
    waves = regular(3.25, 140.9, math.pi, RHO, G)
    time = np.arange(0.0, 300.0, 0.2)
    noise = np.random.default_rng(4).standard_normal((time.size, 1))
    found = harmonics_of(time, noise, {"z": "m"}, waves, np.column_stack([5.0 * time, 0.0 * time]))["z"]
    assert abs(found.encounter.frequency - found.encounter.computed) < math.pi / (found.end - found.start)
    assert found.amplitude[0] < 5.0 * found.amplitude_stderr[0]


def test_standard_errors_hold_in_correlated_noise():
    """Scatter of 100 series in AR(1) noise is the stated error; 95 % intervals hold the truth."""
    waves = regular(3.25, 140.9, math.pi, RHO, G)
    time = np.arange(0.0, 400.0, 0.25)
    track = np.column_stack([5.0 * time, 0.0 * time])
    theta = met(waves, time, *track.T)
    noise = np.random.default_rng(7).standard_normal((100, time.size + 200))
    noise = 0.1 * lfilter([1.0], [1.0, -0.8], noise, axis=1)[:, 200:]
    found = [harmonics_of(time, (response(theta) + e)[:, None], {"z": "m"}, waves, track)["z"] for e in noise]
    first, error = (np.array([getattr(f, n)[0] for f in found]) for n in ("amplitude", "amplitude_stderr"))
    phase, phase_error = (np.array([getattr(f, n)[0] for f in found]) for n in ("phase", "phase_stderr"))
    mean, mean_error = np.array([f.mean for f in found]), np.array([f.mean_stderr for f in found])
    for value, truth, stated in ((first, 0.4, error), (phase, 0.7, phase_error), (mean, 14.0, mean_error)):
        assert np.std(value) == pytest.approx(np.mean(stated), rel=0.22)
        assert 0.88 < np.mean(np.abs(value - truth) < 1.96 * stated) <= 0.99


def test_errors_are_never_nothing_beside_other_lines():
    """Lines beside the harmonics: errors hold the truth, neither zero nor larger than the lines."""
    waves = regular(3.25, 140.9, math.pi, RHO, G)
    time = np.arange(0.0, 600.0, 0.1)
    theta = met(waves, time, 5.0 * time, 0.0 * time)
    track = np.column_stack([5.0 * time, 0.0 * time])
    for rest in (
        0.02 * np.cos(4.0 * theta),
        0.02 * np.cos(0.3 * theta),
        0.01 * np.cos(4.0 * theta) + 0.01 * np.cos(5.0 * theta),
    ):
        found = harmonics_of(time, (response(theta) + rest)[:, None], {"z": "m"}, waves, track)["z"]
        assert np.all(found.amplitude_stderr > 1e-4)
        assert np.all(found.amplitude_stderr < 0.03)
        assert np.all(np.abs(found.amplitude - AMPLITUDES) < 3.0 * found.amplitude_stderr)


def test_start_up_is_cut_off():
    """Two metres that die away in 20 s are cut off, and the harmonics are those of the rest."""
    waves = regular(3.25, 140.9, math.pi, RHO, G)
    time = np.arange(0.0, 600.0, 0.2)
    theta = met(waves, time, 5.0 * time, 0.0 * time)
    noise = 0.001 * np.random.default_rng(2).standard_normal(time.size)
    z = response(theta) + 2.0 * np.exp(-time / 20.0) + noise
    flown = made_flight(time, x=5.0 * time, z=z)
    found = harmonics(flown, waves, ("z",))["z"]
    assert found.cut
    assert 60.0 < found.start < 300.0
    assert found.amplitude[0] == pytest.approx(0.4, abs=1e-3)


def test_what_cannot_be_fitted_is_refused():
    time = np.arange(0.0, 100.0, 0.2)
    wave = regular(3.25, 140.9, math.pi, RHO, G)
    flown = made_flight(time, x=5.0 * time, z=np.cos(time))
    two = make_waves(np.ones(2), np.array([0.5, 0.6]), 0.0, 0.0, RHO, G)
    with pytest.raises(InputError, match="2 wave components"):
        harmonics(flown, two)
    with pytest.raises(InputError, match="channel 'depth'"):
        harmonics(flown, wave, ("depth",))
    with pytest.raises(InputError, match="periods"):
        harmonics(flown, wave, start=90.0)
    with pytest.raises(InputError, match="record ends at"):
        harmonics(flown, wave, start=1e4)
    coarse = np.arange(0.0, 600.0, 2.0)
    with pytest.raises(InputError, match="samples an encountered period"):
        harmonics(made_flight(coarse, x=5.0 * coarse, z=np.cos(coarse)), wave)


def test_encounter_does_not_depend_on_where_time_begins():
    """Theta at an instant is the same whatever part of the track it is computed from."""
    waves = regular(2.0, 80.0, 2.5, RHO, G, phase=1.0)
    time = np.arange(0.0, 200.0, 0.5)
    north, east = 4.0 * time, 1.0 * time
    whole, part = encounter_of(waves, time, north, east), encounter_of(waves, time[150:], north[150:], east[150:])
    assert math.cos(whole.frequency * 120.0 + whole.phase) == pytest.approx(
        math.cos(part.frequency * 120.0 + part.phase), abs=1e-9
    )


CASES = ("ss5-2.5m", "ss5-23.69m")


@pytest.mark.parametrize("name", CASES)
def test_published_harmonics_of_the_cases_are_those_of_the_figure(name):
    """Values and reading errors as digitised from Kim et al. (2021), Fig. 22."""
    case = load_case(name)[0]
    read = pd.read_csv(REFERENCE)
    read = read[np.isclose(read["D0_m"], case.initial.depth_m)]
    wanted = {(r.source, r.channel, r.unit): (r.value, r.sigma) for r in read.itertuples()}
    own = {(p.source, p.metric.removesuffix("_deg"), p.unit): (p.value, p.sigma) for p in case.published}
    assert own == wanted
    assert len(own) == 4


def _flown(name, waves, time):
    """A case as if it had moved as the CFD did."""
    case = load_case(name)[0]
    cfd = {p.metric: p.value for p in case.published if p.source == "CFD"}
    theta = met(waves, time, 5.14 * time, 0.0 * time)
    z, pitch = cfd["dz1_over_aw"] * 1.625 * np.cos(theta), math.radians(cfd["theta1_deg"]) * np.cos(theta)
    flight = replace(made_flight(time, x=5.14 * time, z=z, theta=pitch), waves=waves)
    return SimpleNamespace(case=case, in_waves=in_waves(case, flight), database={"version": 3, "digest": "d" * 64})


def test_harmonics_over_depth_are_drawn_with_their_reading_errors(tmp_path, monkeypatch):
    """One figure holds every depth of one wave; another wave, and a depth a second time, have their own."""
    waves = regular(3.25, 140.9, math.pi, RHO, G)
    time = np.arange(0.0, 600.0, 0.2)
    done = [_flown(name, waves, time) for name in CASES]
    for one in done:
        measured = regular_waves(one.in_waves.harmonics)
        cfd = {p.metric: p.value for p in one.case.published if p.source == "CFD"}
        assert {k: measured[k] for k in cfd} == pytest.approx(cfd, rel=1e-6)
    given = []

    def figure(flown, reference, path, *words):
        given.append((sorted(flown), reference, words[0]))
        return harmonics_figure(flown, reference, path, *words)

    monkeypatch.setattr("ident.validation.wave_figures.harmonics_figure", figure)
    again = _flown(CASES[0], waves, time)
    files = harmonics_over_depth([*done, again], tmp_path)
    assert [f.name for f in files] == ["harmonics_in_waves_v3.png", "harmonics_in_waves_2_v3.png"]
    assert all(f.stat().st_size > 10_000 for f in files)
    depths, reference, title = given[0]
    assert depths == [2.5, 23.69]
    assert set(reference["sigma"]) == {0.0004, 0.0015}
    assert "140.9 m long, mu = 180 deg" in title
    assert given[1][0] == [2.5]
