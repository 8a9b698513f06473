"""The compiled kernel against the term table read in plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from sim.boat.catalogue import BOAT_FEATURES, PLANE_FEATURES
from sim.boat.coefficients import Coefficients
from sim.boat.forces import boat_features, plane_features
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble
from sim.kernel.layout import OUT_DEDUCTION, OUT_THRUST, workspace

PLANES = 5
# Within the tables, and far beyond them: stall of hull and planes, crash-back, surface.
RANGES = {
    "within": (lambda g: [g.uniform(2.0, 5.0), g.normal() * 0.4, g.normal() * 0.3], 0.01, (3.0, 23.0), (0.3, 1.5), 0.3),
    "beyond": (lambda g: g.normal(size=3) * 4.0, 0.1, (-2.0, 60.0), (-2.0, 2.0), 1.5),
}


def _states(kind, model, count, seed):
    rng = np.random.default_rng(seed)
    velocity, rate, depth, revolutions, angle = RANGES[kind]
    for _ in range(count):
        y = np.zeros(12)
        y[:3], y[3:6] = velocity(rng), rng.normal(size=3) * rate
        y[8], y[9:12] = rng.uniform(*depth) - model.sail_top, rng.normal(size=3) * 0.3
        yield y, np.append(rng.normal(size=PLANES) * angle, rng.uniform(*revolutions))


@pytest.mark.parametrize("kind", RANGES)
def test_loads_are_the_sum_of_scaled_coefficients_times_monomials(model, plain_loads, kind):
    """1e-10 of the sum of absolute contributions to each component; thrust carries (1-t)."""
    work, moved = workspace(model), 0
    for y, c in _states(kind, model, 100, 11):
        kernel.features(model, y, c, work)
        kernel.loads(model, work)
        expected, size = plain_loads(y, c)
        assert np.all(np.abs(work.loads[:6] - expected) <= 1e-10 * size)
        moved += np.count_nonzero(expected)
    assert moved == 600


def test_thrust_carries_the_deduction_and_the_wake(model, coefficients):
    """T = (1-t) KT(J) rho n^2 D^4, J = (1-w) u / (n D), from the open-water polynomial."""
    work = workspace(model)
    y, c = np.zeros(12), np.zeros(PLANES + 1)
    y[0], y[8], c[-1] = 5.144, 25.0 - model.sail_top, 1.18
    kernel.features(model, y, c, work)
    kernel.loads(model, work)
    with_propeller = work.loads.copy()
    wake, t = float(coefficients.get("w_T").values[0]), coefficients.get("t").at([5.144, 25.0])
    advance = (1.0 - wake) * 5.144 / (1.18 * 5.0)
    kt = -0.0923 * advance**2 - 0.3652 * advance + 0.4786
    kq = -0.021064 * advance**2 - 0.03247 * advance + 0.063982
    # 1e-3: the curve is tabulated every 0.05 in J, linear between.
    assert work.features[BOAT_FEATURES.index("J")] == pytest.approx(advance, rel=1e-14)
    assert with_propeller[OUT_THRUST] == pytest.approx(kt * 1025.0 * 1.18**2 * 5.0**4, rel=1e-3)
    assert with_propeller[OUT_DEDUCTION] == pytest.approx(t, rel=1e-13)
    c[-1] = 0.0
    kernel.features(model, y, c, work)
    kernel.loads(model, work)
    thrust = with_propeller[OUT_THRUST]
    assert with_propeller[0] - work.loads[0] == pytest.approx((1.0 - t) * thrust, rel=1e-12)
    # Clockwise seen from astern: the torque rolls the boat to port.
    assert with_propeller[3] - work.loads[3] == pytest.approx(-kq * 1025.0 * 1.18**2 * 5.0**5, rel=1e-3)


@pytest.mark.parametrize("kind", RANGES)
def test_features_are_those_of_the_plain_reading(model, coefficients, kind):
    work, vehicle = workspace(model), coefficients.vehicle
    for y, c in _states(kind, model, 20, 5):
        kernel.features(model, y, c, work)
        advance = (1.0 - model.wake) * y[0] / (c[-1] * model.diameter)
        plain = boat_features(y[:3], y[3:6], y[8] + model.sail_top, c[-1], advance)
        expected = [plain[name] for name in BOAT_FEATURES]
        for plane, angle in zip(vehicle.planes, c[:-1], strict=True):
            own = plane_features(plane, y[:3], y[3:6], angle)
            expected += [own[name] for name in PLANE_FEATURES]
        assert work.features == pytest.approx(np.array([*expected, 1.0]), rel=1e-12, abs=1e-13)


def test_a_plane_that_moves_along_its_lift_direction_has_a_finite_angle(campaign, rows, environment):
    """The sine of the incidence is -1 there, or by rounding just beyond it."""
    vehicle = campaign.vehicle.model_copy(deep=True)
    rng, controls, y = np.random.default_rng(0), np.zeros(PLANES + 1), np.zeros(12)
    column = len(BOAT_FEATURES) + PLANE_FEATURES.index("delta")
    for _ in range(300):
        plane = vehicle.planes[0]
        plane.span_axis, plane.leading_edge = list(rng.normal(size=3)), list(rng.normal(size=3))
        y[:3] = plane.lift_axis * rng.uniform(0.1, 5.0)
        model = assemble(Coefficients(vehicle, rows.iloc[:0]), environment)
        found = kernel.features(model, y, controls, workspace(model))
        # 1e-7: the arcsine is that steep near one.
        assert found[column] == pytest.approx(-np.pi / 2, abs=1e-7)
