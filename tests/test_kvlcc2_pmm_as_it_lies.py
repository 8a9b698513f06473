"""Authority: published derivatives. HMRI's PMM campaign of the KVLCC2 tanker, read as it lies,
against the MMG values of Yasukawa and Yoshimura (2015): ship sign of drift, primes on L^2,
harmonics in phase and in quadrature, and loads that contain the model's own inertia.

The instants of the oscillations one by one; ``test_published_kvlcc2.py`` fits the same
campaign file, so that the two have one moment point.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from ident.captive.campaign import read_campaign

DATA = Path(__file__).parents[2] / "shared" / "datasets"
HMRI = DATA / "kvlcc2_hmri_pmm"
OURS = Path(__file__).parent / "data" / "kvlcc2"
LENGTH, DRAUGHT, DENSITY, SPEED = 6.893, 0.448, 1000.0, 1.1702
pytestmark = pytest.mark.skipif(not HMRI.is_dir(), reason="the benchmark's sheets are not distributed with the program")


@pytest.fixture(scope="module")
def published():
    import pandas as pd

    return pd.read_csv(DATA / "kvlcc2_mmg_yasukawa2015.csv").set_index("parameter")["value"]


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hmri")
    for path in HMRI.glob("*_test.csv"):
        (folder / path.name).symlink_to(path)
    for path in OURS.glob("*.toml"):
        shutil.copy(path, folder)
    return read_campaign(folder).runs.set_index("run_id")


def slope(runs, output: str, axis: str, kind: str) -> np.ndarray:
    """Half the difference of the two ends of an oscillation over twice the amplitude."""
    names = [n[:-2] for n in runs.index if n.endswith(f"+{kind}")]
    ends = [(runs.loc[f"{n}+{kind}"], runs.loc[f"{n}-{kind}"]) for n in names]
    pairs = [(a[output] - b[output], a[axis] - b[axis]) for a, b in ends if abs(a[axis] - b[axis]) > 0]
    return np.array([x / y for x, y in pairs])


def mmg(length_power: int) -> float:
    """1/2 rho d L^n of the MMG primes, n one less than that of the prime form."""
    return 0.5 * DENSITY * DRAUGHT * LENGTH ** (length_power - 1)


def test_added_mass_in_sway_without_the_models_own(runs, published):
    found = -slope(runs, "Y", "vdot", "a") / mmg(3)
    assert len(found) == 4
    assert np.median(found) == pytest.approx(published["m_y_dash"], rel=0.12)


def test_added_inertia_in_yaw_without_the_models_own(runs, published):
    found = -slope(runs, "N", "rdot", "a") / mmg(5)
    assert len(found) == 6
    # The six runs themselves lie between 0.009 and 0.021; the model's own is twice the result.
    assert np.median(found) == pytest.approx(published["J_z_dash"], rel=0.3)


def test_drift_derivatives_have_the_published_sign_and_size(runs, published):
    drift = runs[runs["test"].eq("drift_horizontal") & runs["n"].notna()]
    small = drift[drift["beta"].abs() < np.radians(6.5)]
    v = SPEED * np.sin(small["beta"])
    assert len(small) >= 6
    for output, power, name in (("Y", 2, "Y_v"), ("N", 3, "N_v")):
        found = np.polyfit(v, small[output], 1)[0] / (mmg(power) * SPEED)
        assert found == pytest.approx(published[name], rel=0.15)


def test_sway_at_the_end_of_the_velocity_agrees_with_static_drift(runs):
    """Two kinds of test, one derivative."""
    damping = np.median(slope(runs[runs["test"].eq("drift_horizontal")], "Y", "beta", "v"))
    drift = runs[runs["test"].eq("drift_horizontal") & runs["n"].notna()]
    small = drift[drift["beta"].abs() < np.radians(6.5)]
    assert damping == pytest.approx(np.polyfit(small["beta"], small["Y"], 1)[0], rel=0.15)
