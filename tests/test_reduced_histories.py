"""Authority: closed forms. AR(1) series with known mean and known error of the mean, sums of
harmonics, added mass and damping of a mass on a spring, constant acceleration.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from made_campaigns import CONSTANTS, campaign, history
from scipy.signal import lfilter

from ident.captive.campaign import read_campaign
from ident.captive.history_figures import history_figures
from ident.timeseries.blocks import Condensed, constant, harmonics
from ident.timeseries.reduction import autocovariance, burg, fit_history
from sim.files.errors import InputError


def ar1(phi: float, n: int, series: int, seed: int) -> np.ndarray:
    """Stationary AR(1) series, unit innovations, mean zero: (series, n)."""
    noise = np.random.default_rng(seed).standard_normal((series, n + 500))
    noise[:, 0] /= math.sqrt(1.0 - phi**2)
    return lfilter([1.0], [1.0, -phi], noise, axis=1)[:, 500:]


def true_error(phi: float, n: int) -> float:
    """Standard error of the mean of n samples, exact."""
    k = np.arange(1, n)
    return math.sqrt((1.0 + 2.0 * np.sum((1.0 - k / n) * phi**k)) / (1.0 - phi**2) / n)


def fitted(y: np.ndarray, regressors=constant, dt: float = 0.1, **options):
    condensed = Condensed(regressors, 1)
    condensed.add(np.arange(len(y)) * dt, y[:, None])
    return fit_history(condensed, ["X"], **options)


@pytest.mark.parametrize(("phi", "n"), [(0.0, 400), (0.5, 1000), (0.9, 3000), (0.97, 8000), (-0.5, 500)])
def test_standard_errors_of_means_hold_on_ar1(phi, n):
    """95 % intervals hold the truth in 95 % of 200 series, give or take 3 binomial errors."""
    fits = [fitted(7.0 + y) for y in ar1(phi, n, 200, 11)]
    estimates = np.array([f.values[0, 0] for f in fits])
    errors = np.sqrt([f.covariance[0, 0, 0] for f in fits])
    covered = np.mean(np.abs(estimates - 7.0) < 1.96 * errors)
    assert 0.90 < covered < 0.99
    assert np.mean(errors) == pytest.approx(true_error(phi, n), rel=0.08)
    # The error of a standard deviation of 200 is 5 %.
    assert np.std(estimates) == pytest.approx(true_error(phi, n), rel=0.15)


@pytest.mark.parametrize("rate", [10.0, 250.0])
@pytest.mark.parametrize("slow", [0.0, 0.3])
def test_standard_errors_of_means_hold_under_a_vibration_at_any_sampling_rate(rate, slow):
    """A lightly damped oscillator at 2 Hz, alone and over a drift with 1 s correlation time; 80 s each.

    Both are autoregressions of known spectrum at zero. The drift decides the error of the mean, and is
    far below what a short autoregression of the samples themselves sees.
    """
    n, m = round(80.0 * rate), round(25.0 * rate)
    r, turn = math.exp(-0.02 * 4.0 * math.pi / rate), 4.0 * math.pi / rate
    noise = np.random.default_rng(31).standard_normal((60, n + m))
    swing = lfilter([1.0], [1.0, -2.0 * r * math.cos(turn), r * r], noise, axis=1)[:, m:]
    gain = (1.0 + r * r) / ((1.0 - r * r) * (1.0 + r**4 - 2.0 * r * r * math.cos(2.0 * turn)))
    phi = math.exp(-1.0 / rate)
    drift = ar1(phi, n, 60, 32) * math.sqrt(1.0 - phi**2)
    at_zero = 1.0 / (1.0 - 2.0 * r * math.cos(turn) + r * r) ** 2 / gain + slow**2 * (1.0 + phi) / (1.0 - phi)
    fits = [fitted(y, dt=1.0 / rate) for y in swing / math.sqrt(gain) + slow * drift]
    errors = np.sqrt([f.covariance[0, 0, 0] for f in fits])
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(math.sqrt(at_zero / n), rel=0.3)
    scores = np.array([f.values[0, 0] for f in fits]) / errors
    assert np.mean(np.abs(scores) < 1.96) > 0.85


def test_short_record_is_not_called_converged():
    """Four correlation times are no mean: 200 samples of phi = 0.98."""
    verdicts = [fitted(y).converged for y in ar1(0.98, 200, 50, 3)]
    assert np.mean(verdicts) < 0.1
    words = fitted(ar1(0.98, 200, 1, 3)[0]).verdict
    assert "effective samples" in words or "transient" in words


def test_start_up_transient_is_cut_and_a_stationary_start_is_not():
    t = np.arange(3000) * 0.1
    for size in (10.0, 100.0):
        fits = [fitted(y + size * np.exp(-t / 10.0)) for y in ar1(0.6, 3000, 40, 5)]
        assert all(f.cut for f in fits)
        assert np.median([f.start for f in fits]) > 10.0 * math.log(size) - 10.0
        # What is left of the transient is less than twice the error of the mean.
        biases = [f.values[0, 0] / math.sqrt(f.covariance[0, 0, 0]) for f in fits]
        assert abs(np.mean(biases)) < 2.0
    stationary = [fitted(y).cut for y in ar1(0.6, 3000, 200, 6)]
    assert np.mean(stationary) < 0.1


def test_a_trend_is_not_called_converged():
    y = ar1(0.5, 2000, 1, 8)[0] + np.linspace(0.0, 8.0, 2000)
    assert not fitted(y).converged


def test_a_settled_solver_is_converged():
    """A steady solution that decays to its value: nothing left that matters."""
    found = fitted(100.0 * (1.0 + np.exp(-np.arange(600) / 20.0)))
    assert found.converged
    assert found.values[0, 0] == pytest.approx(100.0, rel=1e-3)


def test_standard_errors_of_harmonics_hold_on_ar1():
    truth = np.array([3.0, 2.0, -1.0, 0.5, 0.25, 0.0, -0.125])
    n, f = 3000, 0.2
    signal = harmonics(f)(np.arange(n) * 0.05) @ truth
    fits = [fitted(signal + y, harmonics(f), 0.05) for y in ar1(0.9, n, 60, 21)]
    scores = np.array([(x.values[:, 0] - truth) / np.sqrt(np.diag(x.covariance[0])) for x in fits])
    assert (np.abs(scores) < 1.96).mean() == pytest.approx(0.95, abs=0.03)
    assert scores.std(axis=0) == pytest.approx(np.ones(7), abs=0.3)


def test_burg_finds_the_autoregression_and_its_autocovariance():
    y = ar1(0.8, 50_000, 1, 4)[0]
    a, variance = burg(y - y.mean())
    assert a[0] == pytest.approx(0.8, abs=0.02)
    assert variance == pytest.approx(1.0, abs=0.03)
    exact = autocovariance(np.array([0.8]), 1.0, 40)
    np.testing.assert_allclose(exact, 0.8 ** np.arange(41) / (1.0 - 0.64), rtol=1e-12)
    assert autocovariance(np.array([0.5, 0.3]), 1.0, 1)[1] / autocovariance(np.array([0.5, 0.3]), 1.0, 1)[
        0
    ] == pytest.approx(0.5 / 0.7)


@pytest.mark.parametrize("piece", [1, 7, 997, 10_000])
def test_block_means_do_not_depend_on_how_the_samples_arrive(piece):
    """Nor on how many are kept: harmonics are averaged over the same blocks as the data."""
    n, f = 10_007 if piece > 1 else 2003, 0.2
    t = np.arange(n) * 0.02
    y = harmonics(f)(t) @ np.array([1.0, 2.0, 3.0, 0.0, 0.5, 0.0, 0.0])
    for most in (1 << 15, 512):
        condensed = Condensed(harmonics(f), 1, most)
        for i in range(0, n, piece):
            condensed.add(t[i : i + piece], y[i : i + piece, None])
        assert len(condensed.blocks()[0]) <= most
        found = fit_history(condensed, ["X"], transient=False)
        np.testing.assert_allclose(found.values[:, 0], [1.0, 2.0, 3.0, 0.0, 0.5, 0.0, 0.0], atol=1e-9)


def test_uneven_time_steps_weigh_as_long_as_they_last():
    """A solver that takes ten small steps in the first half of every second: time mean of a ramp."""
    t = np.concatenate([[k + 0.05 * (i + 1) for i in range(10)] + [k + 1.0] for k in range(200)])
    condensed = Condensed(constant, 1)
    condensed.add(t, np.where(np.arange(t.size) % 11 == 10, 1.0, 0.0)[:, None])
    assert fit_history(condensed, ["X"]).values[0, 0] == pytest.approx(0.5, abs=0.01)


# -- oscillatory and accelerating tests, from files --------------------------------------------

OMEGA, SWING = 2.0 * math.pi * 0.25, 0.2
Y_VDOT, Y_V, N_V, Y_0 = -800.0, -150.0, -90.0, 12.0
OSCILLATORY = '[source.reduction]\nkind = "oscillatory"\nmotion = "sway"\nfrequency_hz = 0.25\n'
QUIET = CONSTANTS.replace('beta = "5 deg"\n', "").replace('test = "drift_horizontal"\n', "")


def sway(phase: float, cubic: float = 0.0) -> tuple[np.ndarray, ...]:
    """Time, displacement, Y and N of a swaying model with known derivatives."""
    t = np.arange(0.0, 40.0, 0.02)
    angle = OMEGA * t + phase
    v, vdot = SWING * OMEGA * np.cos(angle), -SWING * OMEGA**2 * np.sin(angle)
    noise = np.random.default_rng(9).standard_normal((2, t.size))
    y = Y_0 + Y_VDOT * vdot + Y_V * v + cubic * v**3 + noise[0]
    return t, SWING * np.sin(angle), y, N_V * v + noise[1]


def swayed(folder, keys: str, phase: float, cubic: float = 0.0, measured: bool = True, **tables):
    t, s, y, n = sway(phase, cubic)
    columns = {"time_s": t, "Y_N": y, "N_Nm": n} | ({"displacement_m": s} if measured else {})
    rows = "\n".join(",".join(f"{x:.12g}" for x in row) for row in np.column_stack(list(columns.values())))
    campaign(folder, history("pmm.csv", constants=QUIET, reduction=OSCILLATORY + keys), **tables)
    (folder / "pmm.csv").write_text(",".join(columns) + "\n" + rows + "\n")
    return read_campaign(folder).runs.set_index("run_id")


@pytest.mark.parametrize("phase", [0.0, 1.0, -2.5])
@pytest.mark.parametrize("measured", [True, False])
def test_pmm_sway_gives_added_mass_and_damping_at_any_phase(tmp_path, phase, measured):
    keys = "" if measured else f"amplitude = {SWING}\nphase_deg = {math.degrees(phase)}\n"
    runs = swayed(tmp_path, keys, phase, measured=measured)
    assert runs["test"].tolist() == ["drift_horizontal", "drift_horizontal", "acceleration", "acceleration"]
    assert runs["vdot"]["pmm+a"] == pytest.approx(-SWING * OMEGA**2, rel=1e-6)
    v = SWING * OMEGA
    assert runs["U"]["pmm+v"] == pytest.approx(math.hypot(2.0, v), rel=1e-6)
    assert runs["beta"]["pmm+v"] == pytest.approx(math.atan(v / 2.0), rel=1e-6)
    assert runs["beta"]["pmm-v"] == pytest.approx(-math.atan(v / 2.0), rel=1e-6)
    for name, expected in {"pmm+v": Y_0 + Y_V * v, "pmm-a": Y_0 + Y_VDOT * SWING * OMEGA**2}.items():
        assert abs(runs["Y"][name] - expected) < 4.0 * runs["s_Y"][name]
        assert runs["s_Y"][name] == pytest.approx(
            math.sqrt((1 + 2 + 2 + (2 if name == "pmm+v" else 0)) / 2000), rel=0.3
        )
    assert abs(runs["N"]["pmm+v"] - N_V * v) < 4.0 * runs["s_N"]["pmm+v"]


def test_pmm_keeps_a_cubic_by_its_third_harmonic(tmp_path):
    runs = swayed(tmp_path, "", 0.3, cubic=-500.0)
    v = SWING * OMEGA
    assert abs(runs["Y"]["pmm+v"] - (Y_0 + Y_V * v - 500.0 * v**3)) < 4.0 * runs["s_Y"]["pmm+v"]


def test_pmm_inertia_of_the_model_is_taken_out(tmp_path):
    """measured = water - m vdot: adding 300 kg of model turns -800 into -500 kg."""
    inertia = (
        "model_inertia_in_loads = true\nmass_kg = 300.0\ncentre_of_gravity_m = [0.5, 0.0, 0.0]\n"
        'tensor_kgm2 = [10.0, 200.0, 200.0]\nsource = "swing test"'
    )
    plain = swayed(tmp_path / "a", "", 0.3)
    freed = swayed(tmp_path / "b", "", 0.3, inertia=inertia)
    vdot = -SWING * OMEGA**2
    assert freed["Y"]["pmm+a"] - plain["Y"]["pmm+a"] == pytest.approx(300.0 * vdot, rel=1e-9)
    assert freed["N"]["pmm+a"] - plain["N"]["pmm+a"] == pytest.approx(0.5 * 300.0 * vdot, rel=1e-9)
    assert freed["Y"]["pmm+v"] == pytest.approx(plain["Y"]["pmm+v"], rel=1e-12)


@pytest.mark.parametrize(
    ("reduction", "words"),
    [
        (OSCILLATORY.replace('motion = "sway"\n', ""), "motion"),
        (OSCILLATORY.replace("frequency_hz = 0.25\n", ""), "frequency"),
        (OSCILLATORY.replace('"sway"', '"wobble"'), "sway"),
        (OSCILLATORY + "start_s = 30\nend_s = 20\n", "end_s after start_s"),
        (OSCILLATORY + "start_s = 39.9\n", "samples"),
    ],
)
def test_what_an_oscillation_needs_is_asked_for(tmp_path, reduction, words):
    t, _, y, _ = sway(0.0)
    campaign(tmp_path, history("pmm.csv", constants=QUIET, reduction=reduction + "amplitude = 0.2\n"))
    (tmp_path / "pmm.csv").write_text("time_s,Y_N\n" + "\n".join(f"{a},{b}" for a, b in zip(t, y, strict=True)))
    with pytest.raises(InputError) as caught:
        read_campaign(tmp_path)
    assert words in str(caught.value)


@pytest.mark.parametrize(("stated", "words"), [(2.0 * np.pi * 0.25, "rad/s for Hz"), (4.0, "0.25"), (15.0, "0.25")])
def test_a_frequency_in_other_units_is_refused(tmp_path, stated, words):
    """rad/s, a period, cycles a minute: the record oscillates elsewhere, however far from what is stated."""
    t, _, y, _ = sway(0.0)
    reduction = OSCILLATORY.replace("frequency_hz = 0.25", f"frequency_hz = {stated}") + "amplitude = 0.2\n"
    campaign(tmp_path, history("pmm.csv", constants=QUIET, reduction=reduction))
    (tmp_path / "pmm.csv").write_text("time_s,Y_N\n" + "\n".join(f"{a},{b}" for a, b in zip(t, y, strict=True)))
    with pytest.raises(InputError, match="Y oscillates at 0.25 Hz.*" if "for" not in words else words):
        read_campaign(tmp_path)


def test_constant_acceleration_gives_the_load_at_mid_time(tmp_path):
    """X = -c U^2 - m a with U = U0 + a t: value and acceleration at the middle of the record."""
    t = np.arange(0.0, 20.0, 0.01)
    speed, noise = 1.0 + 0.1 * t, 0.3 * np.random.default_rng(2).standard_normal(t.size)
    x = -20.0 * speed**2 - 500.0 * 0.1 + noise
    constants = CONSTANTS.replace('U = "2 m/s"\n', "").replace("drift_horizontal", "acceleration")
    campaign(tmp_path, history("acc.csv", constants=constants.replace('"5 deg"', '"0 deg"'),
                               reduction='[source.reduction]\nkind = "acceleration"\n'))  # fmt: skip
    rows = "\n".join(f"{a:.9g},{b:.9g},{c:.9g}" for a, b, c in zip(t, speed, x, strict=True))
    (tmp_path / "acc.csv").write_text("time_s,U_mps,X_N\n" + rows)
    run = read_campaign(tmp_path).runs.iloc[0]
    middle = 1.0 + 0.1 * t.mean()
    assert run["udot"] == pytest.approx(0.1, rel=1e-6)
    assert run["U"] == pytest.approx(middle, rel=1e-6)
    assert abs(run["X"] - (-20.0 * middle**2 - 50.0)) < 4.0 * run["s_X"]
    assert run["s_X"] == pytest.approx(0.3 * math.sqrt(9 / 4 / 2000), rel=0.3)


def test_rel_sigma_is_added_to_the_statistical_error(tmp_path):
    y = 100.0 + np.random.default_rng(1).standard_normal(2000)
    text = "time_s,Y_N\n" + "\n".join(f"{0.1 * i:.3f},{v:.9g}" for i, v in enumerate(y))
    found = []
    for name, more in (("a", ""), ("b", "rel_sigma = 0.03\n")):
        campaign(tmp_path / name, history("h.csv", constants=CONSTANTS + more))
        (tmp_path / name / "h.csv").write_text(text)
        found.append(read_campaign(tmp_path / name).runs.iloc[0])
    assert found[0]["s_Y"] == pytest.approx(1.0 / math.sqrt(2000), rel=0.2)
    assert found[1]["s_Y"] == pytest.approx(math.hypot(found[0]["s_Y"], 0.03 * found[1]["Y"]), rel=1e-9)


def test_every_history_has_a_plot(tmp_path):
    swayed(tmp_path, "", 0.3)
    reduced = read_campaign(tmp_path).reduced
    paths = history_figures(reduced, tmp_path / "reports")
    assert [p.name for p in paths] == ["history_pmm.png"]
    assert paths[0].read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert paths[0].stat().st_size > 10_000
