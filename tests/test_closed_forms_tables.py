"""Tables against functions they must reproduce: multilinear, additive, Eq. (25), a + b/x."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.boat.tables import Table, axis_weights, extend_axis

RULES = ("hold", "linear", "linear_load", "drift_odd", "drift_even")


def _grid(*axes):
    return np.array(list(itertools.product(*axes)), dtype=float)


# -- inside ------------------------------------------------------------------------------


@pytest.mark.parametrize("dimensions", [1, 2, 3, 4])
def test_interpolation_is_exact_for_multilinear_functions(dimensions):
    rng = np.random.default_rng(dimensions)
    axes = [np.sort(rng.uniform(-2.0, 3.0, size=4)) for _ in range(dimensions)]
    powers = list(itertools.product((0, 1), repeat=dimensions))
    factor = rng.normal(size=len(powers))

    def f(x):
        return sum(c * np.prod([xi for xi, e in zip(x, p, strict=True) if e]) for c, p in zip(factor, powers))

    names, points = tuple("abcd"[:dimensions]), _grid(*axes)
    table = Table(names, ("hold",) * dimensions, points)
    values = np.array([f(p) for p in points])
    for _ in range(50):
        x = [rng.uniform(a[0], a[-1]) for a in axes]
        assert table.weights(x) @ values == pytest.approx(f(x), abs=1e-12)


def test_a_measured_point_returns_its_own_value():
    rng = np.random.default_rng(0)
    points = rng.permutation(_grid([1.0, 2.0, 4.0], [-1.0, 0.0, 3.0]))[:6]
    table = Table(("a", "b"), ("hold", "hold"), points)
    for i, x in enumerate(points):
        assert table.weights(x) == pytest.approx(np.eye(6)[i], abs=1e-15)


def test_completion_is_exact_for_additive_functions_on_a_cross():
    """Runs on one line of each axis only, as in a drift campaign: C(a,b) = f(a) + g(b)."""
    a, b = np.array([-0.2, -0.1, 0.0, 0.05, 0.3]), np.array([-0.4, 0.0, 0.1, 0.2])
    points = np.array([(x, 0.0) for x in a] + [(0.0, y) for y in b if y])
    table = Table(("a", "b"), ("hold", "hold"), points)
    values = np.exp(points[:, 0]) + np.sin(3.0 * points[:, 1]) + 0.7
    for x, y in itertools.product(a, b):
        assert table.weights((x, y)) @ values == pytest.approx(np.exp(x) + np.sin(3.0 * y) + 0.7, abs=1e-13)


def test_completion_is_exact_for_the_source_superposition_at_every_speed_and_depth():
    """f(U, alpha, D0) + g(U, beta, D0) from runs with alpha or beta zero, as in BB2."""
    speeds, alphas, betas, depths = [1.5, 3.1, 5.1], [-0.2, -0.1, 0.0, 0.1, 0.2], [-0.2, 0.0, 0.2], [2.5, 4.0, 24.0]
    points = [(u, a, 0.0, d) for u in speeds for a in alphas for d in depths]
    points += [(u, 0.0, b, d) for u in speeds for b in betas if b for d in depths]

    def f(u, a, b, d):
        return np.sin(4.0 * a) * u / d + (b**2 - b) * u**2 * d + u * d

    points = np.array(points)
    table = Table(("U", "alpha", "beta", "D0"), ("hold",) * 4, points)
    values = np.array([f(*p) for p in points])
    for x in itertools.product(speeds, alphas, betas, depths):
        assert table.weights(x) @ values == pytest.approx(f(*x), abs=1e-11)


def test_a_gap_between_two_runs_of_a_line_is_interpolated():
    """A depth at which one speed was not run lies straight between its neighbours."""
    points = np.array([(u, d) for u in (1.0, 2.0) for d in (2.0, 4.0, 10.0) if (u, d) != (2.0, 4.0)])
    table = Table(("U", "D0"), ("hold", "hold"), points)
    values = points[:, 0] * points[:, 1]
    assert table.weights((2.0, 4.0)) @ values == pytest.approx(0.75 * 4.0 + 0.25 * 20.0, abs=1e-14)


def test_covered_is_one_on_runs_and_zero_on_completed_corners():
    points = np.array([(-1.0, 0.0), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    table = Table(("a", "b"), ("hold", "hold"), points)
    assert table.covered([(0.5, 0.0), (1.0, 1.0), (0.5, 1.0)]) == pytest.approx([1.0, 0.0, 0.5])


# -- weights -----------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    rules=st.tuples(st.sampled_from(RULES), st.sampled_from(RULES)),
    seed=st.integers(0, 2**16),
    x=st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)),
)
def test_weights_sum_to_one_on_ragged_points_for_every_rule(rules, seed, x):
    """A constant is in the span of every rule: cos^2 + sin|sin| = 1 on the side it is used."""
    rng = np.random.default_rng(seed)
    grid = _grid([-0.3, -0.1, 0.0, 0.15, 0.3], [-0.2, 0.0, 0.2, 0.3])
    points = grid[rng.permutation(len(grid))[: rng.integers(1, len(grid))]]
    weights = Table(("a", "b"), rules, points).weights(x)
    assert weights.sum() == pytest.approx(1.0, abs=1e-9)


# -- beyond ------------------------------------------------------------------------------


def test_hold_is_the_edge_value_and_linear_goes_on_straight():
    nodes = np.array([1.0, 2.0, 4.0])
    values = np.array([3.0, 5.0, 9.0])
    assert axis_weights(nodes, "hold", 7.0) @ values == 9.0
    assert axis_weights(nodes, "hold", -7.0) @ values == 3.0
    for x in (-7.0, 0.0, 11.0):
        assert axis_weights(nodes, "linear", x) @ values == pytest.approx(2.0 * x + 1.0, abs=1e-13)


def test_linear_load_continues_a_straight_load_exactly():
    """Coefficient a + b/x means load (coefficient times x) a x + b: it must go on straight."""
    nodes = np.array([-0.09, -0.05, 0.05, 0.09])
    values = 1.7 + 0.2 / np.abs(nodes)
    for x in (0.1, 0.5, 4.0):
        for side in (1.0, -1.0):
            found = axis_weights(nodes, "linear_load", side * x) @ values
            assert found == pytest.approx(1.7 + 0.2 / x, rel=1e-13)
    # Tends to the constant a; never runs away as a straight coefficient would.
    assert axis_weights(nodes, "linear_load", 1e6) @ values == pytest.approx(1.7, abs=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_load_of_a_linear_load_axis_vanishes_with_the_rate_when_runs_are_on_one_side(side):
    """A campaign with bow-up runs only: coefficient times u q must still go to zero with q."""
    nodes = np.sort(side * np.array([0.05, 0.09]))
    values = np.array([-3.0, -5.0])
    load = [x * float(axis_weights(nodes, "linear_load", x) @ values) for x in (side * 1e-3, side * 1e-6, 0.0)]
    assert np.abs(load[0]) < 1e-3 * 10.0
    assert np.abs(load[1]) < 1e-6 * 10.0
    assert load[2] == 0.0


def _drift(x, c0, a, b):
    return c0 * np.cos(x) ** 2 + a * np.sin(x) * np.cos(x) + b * np.sin(x) * np.abs(np.sin(x))


def _out_of_plane(x, a, b):
    return a * np.cos(x) ** 2 + b * np.sin(x) ** 2


def test_out_of_plane_continuation_has_value_and_slope_of_the_last_runs():
    """Solve A cos^2 + B sin^2 for value and slope at the edge here, compare at every node."""
    nodes = np.radians([-12.0, -8.0, -4.0, 0.0, 4.0, 8.0, 12.0])
    values = np.random.default_rng(1).normal(size=nodes.size)
    extended, matrix = extend_axis(nodes, "drift_even")
    assert extended[0] == pytest.approx(-np.pi / 2)
    assert extended[-1] == pytest.approx(np.pi / 2)
    continued, step = matrix @ values, 1e-6

    def basis(x):
        return np.array([np.cos(x) ** 2, np.sin(x) ** 2])

    for side, edge, inner in ((1, -1, -2), (-1, 0, 1)):
        e, value = nodes[edge], values[edge]
        slope = (values[edge] - values[inner]) / (e - nodes[inner])
        # Slopes by central differences, so that no derivative is copied from the program.
        rows = np.stack([basis(e), (basis(e + step) - basis(e - step)) / (2 * step)])
        factor = np.linalg.solve(rows, np.array([value, slope]))
        for x, found in zip(extended, continued, strict=True):
            if side * x > side * e:
                assert found == pytest.approx(basis(x) @ factor, abs=1e-7)


@pytest.mark.parametrize("spacing", [1.0, 4.0, 6.0])
def test_eq_25_is_continued_exactly(spacing):
    """Runs that follow Eq. (25) are continued by it, whatever their spacing."""
    nodes = np.radians(np.arange(-12.0, 12.5, spacing))
    extended, matrix = extend_axis(nodes, "drift_odd")
    assert matrix @ _drift(nodes, -0.8e-3, -0.03, -0.11) == pytest.approx(
        _drift(extended, -0.8e-3, -0.03, -0.11), abs=1e-12
    )


def test_scatter_of_the_last_run_does_not_turn_cross_flow_drag_round():
    """A last run 5 % low moves the curve by as much, and leaves it growing to 30 deg."""
    nodes = np.radians(np.arange(-12.0, 12.5, 4.0))
    values = _drift(nodes, 0.0, 0.018, 0.005)
    values[-1] *= 0.95
    extended, matrix = extend_axis(nodes, "drift_odd")
    continued = (matrix @ values)[(extended > nodes[-1]) & (extended < np.radians(33.0))]
    assert np.all(np.diff(continued) > 0.0)
    assert continued[0] > values[-1]


def test_out_of_plane_form_is_reproduced_as_the_run_spacing_goes_to_zero():
    """The edge slope is a two-point slope, so the error is O(h): it halves with the spacing."""

    def f(x):
        return _out_of_plane(x, -0.8e-3, -6.0e-3)

    errors = []
    for h in np.radians([1.0, 0.5, 0.25]):
        nodes = np.arange(-round(np.radians(12.0) / h), round(np.radians(12.0) / h) + 1) * h
        extended, matrix = extend_axis(nodes, "drift_even")
        outside = np.abs(extended) > nodes[-1] + 1e-12
        errors.append(np.abs(matrix @ f(nodes) - f(extended))[outside].max())
    scale = np.abs(f(np.radians(90.0)))
    assert errors[-1] < 0.05 * scale
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("rule", RULES)
def test_tables_are_continuous_at_their_edge(rule):
    nodes = np.radians([-12.0, -8.0, -4.0, 4.0, 8.0, 12.0])
    values = np.array([3.0, 1.0, 0.5, -0.4, -1.5, -3.0])
    table = Table(("beta",), (rule,), nodes[:, None])
    for edge in (nodes[0], nodes[-1]):
        inside, outside = (table.weights([edge * (1.0 + d)]) @ values for d in (-1e-9, 1e-9))
        # The steepest rule here has a slope of about 30 per radian.
        assert inside == pytest.approx(outside, abs=1e-7)


def test_grid_holds_the_same_values_as_the_weights():
    """The kernel's grid and the weights behind the standard errors are one table."""
    points = _grid([1.5, 5.1], np.radians([-12.0, -4.0, 0.0, 4.0, 12.0]))
    table = Table(("U", "beta"), ("hold", "drift_odd"), points)
    values = np.random.default_rng(2).normal(size=len(points))
    grid = table.grid(values)
    for i, u in enumerate(table.extension[0][0]):
        for j, b in enumerate(table.extension[1][0]):
            assert grid[i, j] == pytest.approx(table.weights((u, b)) @ values, abs=1e-13)
