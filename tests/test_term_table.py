"""The term table against dimensional analysis, the mirror of a state, and its own inverse."""

from __future__ import annotations

import csv
from dataclasses import replace
from importlib.resources import files
from typing import get_args

import numpy as np
import pandas as pd
import pytest

from sim.boat import catalogue
from sim.boat.catalogue import ACCELERATIONS, OUTPUTS, CatalogueError
from sim.boat.coefficients import Coefficients
from sim.boat.database import axis_columns
from sim.boat.forces import boat_features, multiplier, plane_features, slipstream
from sim.boat.mass import Environment, added_mass_matrix
from sim.boat.parts import mirror_of, parts_of, vehicle_terms
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble
from sim.kernel.layout import workspace

SETS = catalogue.SETS
ALL = [(s, t) for s in SETS for t in catalogue.terms(s)]
BY_NAME = pytest.mark.parametrize(("term_set", "term"), ALL, ids=[f"{s}-{t.name}" for s, t in ALL])

# Exponents of metre and second; angles, signs and J have none.
SPEED, RATE = (1, -1), (0, -1)
DIMENSIONS = {
    **dict.fromkeys(("u", "v", "w", "|u|", "|v|", "|w|", "U", "S", "V"), SPEED),
    **dict.fromkeys(("p", "q", "r", "|p|", "|q|", "|r|", "n", "|n|"), RATE),
    **dict.fromkeys(("up", "uq", "ur", "vp", "vq", "vr", "wp", "wq", "wr"), (1, -2)),
    **dict.fromkeys(("pq", "qr", "rp"), (0, -2)),
    **dict.fromkeys(("udot", "vdot", "wdot"), (1, -2)),
    **dict.fromkeys(("pdot", "qdot", "rdot"), (0, -2)),
    **dict.fromkeys(("sgn(v)", "sgn(w)", "alpha", "beta", "delta", "deflection", "J"), (0, 0)),
    "D0": (1, 0),
    "v/U": (0, 0),
    "r/U": (-1, 0),
    "v/r": (1, 0),
    "w/q": (1, 0),
    "slip": (0, 0),
    "uslip": SPEED,
}
UNITS = {"m/s": (1, -1), "m": (1, 0), "rad/s": (0, -1), "m/s2": (1, -2), "rad2/s2": (0, -2), "deg": (0, 0), "1": (0, 0)}
SUFFIX = {"m/s": "mps", "m": "m", "rad/s": "radps", "m/s2": "mps2", "rad2/s2": "rad2ps2", "deg": "deg"}


@BY_NAME
def test_scale_times_monomial_is_newton_or_newton_metre(term_set, term):
    metre = second = kilogram = 0
    if term.norm == "SI":
        # The coefficient has what is missing: no power of a length beside it.
        assert term.power == 0
        return
    if term.norm:
        # rho is kg m^-3; the length (L or D) carries the power of the row.
        kilogram, metre = 1, term.power - 3
    for factor in term.factors:
        metre += DIMENSIONS[factor][0]
        second += DIMENSIONS[factor][1]
    expected = {"": (0, 0, 0), **dict.fromkeys("XYZ", (1, 1, -2)), **dict.fromkeys("KMN", (1, 2, -2))}
    assert (kilogram, metre, second) == expected[term.output]


def test_scale_is_the_declared_power_of_the_declared_length():
    rho, length, diameter = 1000.0, 3.0, 2.0
    for _, term in ALL:
        size = {"rho/2 L": 500.0 * 3.0**term.power, "rho D": 1000.0 * 2.0**term.power, "SI": 1.0, "": 1.0}[term.norm]
        assert term.scale(rho, length, diameter) == pytest.approx(size, rel=1e-15), term.name


def test_axis_unit_and_column_agree_with_the_quantity():
    for name, axis in catalogue.axes().items():
        assert UNITS[axis.unit] == DIMENSIONS[name], name
        if axis.unit in SUFFIX:
            assert axis.column.endswith("_" + SUFFIX[axis.unit]), name


def test_axis_columns_are_unique():
    columns = [a.column for a in catalogue.axes().values()]
    assert len(columns) == len(set(columns))
    assert list(axis_columns().values()) == list(catalogue.axes())


@pytest.mark.parametrize("term_set", SETS)
def test_names_are_unique_and_every_row_names_equation_and_test(term_set):
    terms = catalogue.terms(term_set)
    assert len({t.name for t in terms}) == len(terms) > (20 if term_set == "mmg" else 80)
    with (files("ident") / "data" / "tests.csv").open(encoding="utf-8") as stream:
        known = {r["test"] for r in csv.DictReader(stream)}
    for term in terms:
        assert term.equation.strip(), term.name
        # Cross-flow of drift and rotation together comes from an estimate.
        assert term.tests or term.group == "cross-flow", term.name
        assert set(term.tests) <= known, term.name


# -- parity ------------------------------------------------------------------------------


def _mirrored_features(rng):
    """Features of a state and of its mirror image: v, p, r change sign and nothing else."""
    velocity, rates = rng.normal(size=3), rng.normal(size=3)
    turn = np.array([1.0, -1.0, 1.0])
    here = boat_features(velocity, rates, 20.0, 1.2, 0.7, 0.3)
    there = boat_features(velocity * turn, -rates * turn, 20.0, 1.2, 0.7, 0.3)
    acceleration = dict(zip(ACCELERATIONS, rng.normal(size=6), strict=True))
    sign = dict(zip(ACCELERATIONS, (1, -1, 1, -1, 1, -1), strict=True))
    return here | acceleration, there | {k: sign[k] * a for k, a in acceleration.items()}


@pytest.mark.parametrize("term_set", SETS)
def test_parity_of_hull_rows_follows_from_the_mirror_of_the_state(term_set):
    here, there = _mirrored_features(np.random.default_rng(3))
    load_sign = dict(zip(OUTPUTS, (1, -1, 1, -1, 1, -1), strict=True)) | {"": 1}
    rows = [t for t in catalogue.terms(term_set) if not set(t.factors) & set(catalogue.PLANE_FEATURES)]
    assert len(rows) > (20 if term_set == "mmg" else 60)
    for term in (t for t in rows if t.output):
        ratio = multiplier(term, there) / multiplier(term, here)
        assert abs(ratio) == pytest.approx(1.0, abs=1e-14)
        # C(mirrored axes) * m' = sign(load) * C(axes) * m
        wanted = load_sign[term.output] * round(ratio)
        assert term.mirror_sign() == wanted, term.name
        odd = {a for a in term.axes if here[a] and there[a] == -here[a]}
        assert term.parity == dict.fromkeys(odd, wanted), term.name


def test_parity_of_plane_rows_follows_from_the_mirrored_plane():
    vehicle = load_vehicle("bb2")
    planes = {p.name: p for p in vehicle.planes}
    rng = np.random.default_rng(4)
    velocity, rates, turn = rng.normal(size=3), rng.normal(size=3) * 0.02, np.array([1.0, -1.0, 1.0])
    velocity[0] += 5.0
    # What a plane does in the mirror: the same lift direction up to the partner's sense.
    of_planes = [t for t in vehicle_terms(vehicle) if t.part in planes]
    assert {t.part for t in of_planes} == set(planes)
    for term in of_planes:
        plane, mirror = planes[term.part], mirror_of(term, term.part, vehicle)
        partner = planes[mirror.part]
        assert partner.position == pytest.approx(plane.position * turn)
        sense = round(float((plane.lift_axis * turn) @ partner.lift_axis))
        assert mirror.axis_signs[term.axes.index("delta")] == sense
        here = plane_features(plane, velocity, rates, 0.1)
        there = plane_features(partner, velocity * turn, -rates * turn, sense * 0.1)
        assert there["V"] == pytest.approx(here["V"], rel=1e-14)
        assert there["delta"] == pytest.approx(sense * here["delta"], rel=1e-12)
        assert mirror_of(catalogue.term(mirror.name, vehicle.term_set), mirror.part, vehicle).name == term.name


# -- forward and back --------------------------------------------------------------------


def _vehicle_for(term_set, term):
    boats = [load_vehicle(name) for name in ("bb2", "suboff", "nps-auv2", "kvlcc2-mmg")]
    vehicle = next(v for v in boats if term.part == "section" or term.part in v.part_names())
    kind = "derivatives" if term.group == "added mass" else "sections"
    return vehicle.model_copy(update={"term_set": term_set, "added_mass": kind})


# What a slipstream is of, for terms that it multiplies.
SLIPSTREAM = {"J_0": 0.7, "C_T1": 1.2}


def _single(vehicle, term, part, value, heave):
    row = dict.fromkeys(axis_columns(), np.nan) | {"coefficient": term.name, "part": part, "value": value}
    # One run: a constant, on the side of the heave speed (a side without runs has none).
    row |= {catalogue.axes()[a].column: np.sign(heave) if a == "sgn(w)" else 1.0 for a in term.axes}
    rows = [row]
    if {"slip", "uslip"} & set(term.factors):
        rows += [
            dict.fromkeys(row, np.nan) | {"coefficient": k, "part": "propeller", "value": v}
            for k, v in SLIPSTREAM.items()
        ]
    return Coefficients(vehicle, pd.DataFrame(rows))


@BY_NAME
def test_a_coefficient_alone_forward_through_the_model_and_back_is_itself(term_set, term):
    """Load of one coefficient from the compiled model, divided by scale and monomial."""
    vehicle = _vehicle_for(term_set, term)
    rng = np.random.default_rng(sum(map(ord, term.name)))
    value, state, environment = float(rng.normal()), rng.normal(size=12), Environment(1025.0, 9.81)
    part = parts_of(term, vehicle)[0]
    coefficients = _single(vehicle, term, part, value, state[2])
    scale = term.scale(1025.0, vehicle.particulars.length.value, vehicle.propeller.diameter.value)
    if not term.output:
        assert coefficients.get(term.name).at([1.0] * len(term.axes)) == value
        return
    if term.is_acceleration:
        # -A is the derivative of the load by the acceleration; a section also has levers.
        i, j = OUTPUTS.index(term.output), ACCELERATIONS.index(term.factors[0])
        found = -added_mass_matrix(coefficients, environment)[i, j] / scale
        assert found == pytest.approx(value, rel=1e-15)
        return
    model = assemble(coefficients, environment)
    work, controls = workspace(model), rng.normal(size=len(vehicle.planes) + 1)
    kernel.features(model, state, controls, work)
    kernel.loads(model, work)
    slip = slipstream(state[0], controls[-1], SLIPSTREAM["J_0"] * vehicle.diameter, SLIPSTREAM["C_T1"])
    features = boat_features(state[:3], state[3:6], 0.0, controls[-1], 0.0, slip)
    for plane, angle in zip(vehicle.planes, controls, strict=False):
        if plane.name == part:
            features |= plane_features(plane, state[:3], state[3:6], angle)
    k = OUTPUTS.index(term.output)
    assert work.loads[k] / (scale * multiplier(term, features)) == pytest.approx(value, rel=1e-13)
    assert np.count_nonzero(work.loads[:6]) == 1


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_side_of_the_heave_speed_without_runs_has_no_coefficient(side):
    vehicle, term = load_vehicle("bb2"), catalogue.term("K_wp", "reduced")
    coefficient = next(iter(_single(vehicle, term, "hull", 2.0, side)))
    at = dict.fromkeys(term.axes, 1.0)
    assert coefficient.at([*(at | {"sgn(w)": side}).values()]) == 2.0
    assert coefficient.at([*(at | {"sgn(w)": -side}).values()]) == 0.0


# -- refusals ----------------------------------------------------------------------------

GOOD = catalogue.term("Y_uvw", "reduced")
CORRUPTED = {
    "unknown factor": replace(GOOD, factors=("U", "Q")),
    "unknown axis": replace(GOOD, axes=("U", "gamma"), extrapolation={"U": "hold", "gamma": "hold"}, parity={}),
    "unknown set": replace(GOOD, sets=("feldman",)),
    "unknown rule": replace(GOOD, extrapolation=GOOD.extrapolation | {"U": "spline"}),
    "rule missing": replace(GOOD, extrapolation={"U": "hold"}),
    "wrong parity": replace(GOOD, parity={"beta": 1}),
    "wrong output": replace(GOOD, output="X"),
}


@pytest.mark.parametrize("row", CORRUPTED.values(), ids=CORRUPTED.keys())
def test_a_corrupted_row_is_refused_by_name(row):
    with pytest.raises(CatalogueError, match="row Y_uvw"):
        catalogue.check(row)


def test_unknown_set_and_unknown_term_are_refused():
    with pytest.raises(CatalogueError, match="unknown term set"):
        catalogue.terms("feldman")
    with pytest.raises(CatalogueError, match="no term"):
        catalogue.term("Y_uuu", "reduced")


def test_a_vehicle_file_may_state_every_set_of_the_table_and_no_other():
    assert get_args(Vehicle.model_fields["term_set"].annotation) == SETS
