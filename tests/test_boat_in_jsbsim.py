"""Authority: JSBSim. It evaluates the loads of the file as the kernel does, and flies as the simulator does."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import jsbsim
import numpy as np
import pytest

from ident.analysis.derivatives import loads
from ident.exports.jsbsim import export_jsbsim
from ident.validation.boats import Fleet
from sim.boat.catalogue import OUTPUTS
from sim.boat.parts import vehicle_terms
from sim.boat.tables import Table
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.flight.plant import Plant
from sim.flight.simulate import begun

FOOT, RADIUS, GRAVITY = 0.3048, 6378137.0, 9.81
# A planet that does not turn, as docs/other-tools.md has it.
STILL = f"""<planet name="still">
  <semimajor_axis unit="M">{RADIUS}</semimajor_axis>
  <semiminor_axis unit="M">{RADIUS}</semiminor_axis>
  <rotation_rate unit="RAD/SEC">0.0</rotation_rate>
  <GM unit="M3/SEC2">{GRAVITY * RADIUS**2!r}</GM>
  <J2>0.0</J2>
</planet>"""


class Flown:
    """An exported boat in JSBSim, with the model it was made from."""

    def __init__(self, folder, boat, name):
        self.case = load_case(name)[0]
        path = folder / "aircraft" / "boat" / "boat.xml"
        path.parent.mkdir(parents=True)
        self.done = export_jsbsim(boat, self.case, "coeff_db", path)
        self.model = begun(self.case, boat.vehicle, boat.model(self.case))[0]
        (folder / "still.xml").write_text(STILL)
        jsbsim.FGJSBBase().debug_lvl = 0
        self.fdm = jsbsim.FGFDMExec(str(folder))
        self.fdm.set_debug_level(0)
        assert self.fdm.load_planet(str(folder / "still.xml"), False)
        assert self.fdm.load_model("boat")

    def start(self, state, controls):
        """From a state of the body origin to JSBSim's of the centre of gravity."""
        velocity, omega, angles = state[:3], state[3:6], state[9:12]
        centre = self.model.r_g
        (sf, st, _), (cf, ct, _) = np.sin(angles), np.cos(angles)
        down = np.array([-st, ct * sf, ct * cf])
        for k, x in zip("uvw", velocity + np.cross(omega, centre), strict=True):
            self.fdm[f"ic/{k}-fps"] = x / FOOT
        for k, x in zip("pqr", omega, strict=True):
            self.fdm[f"ic/{k}-rad_sec"] = x
        for k, x in zip(("phi-rad", "theta-rad", "psi-true-rad"), angles, strict=True):
            self.fdm[f"ic/{k}"] = x
        self.fdm["ic/h-sl-ft"] = -(state[8] + down @ centre) / FOOT
        for name, x in zip(self.done["inputs"], controls, strict=True):
            self.fdm[name] = x
        assert self.fdm.run_ic()

    def water(self):
        return np.array([self.fdm[f"ident/{o}-water"] for o in OUTPUTS])


@pytest.fixture(scope="module")
def flown(coefficients, fitted_db, tmp_path_factory):
    return Flown(tmp_path_factory.mktemp("jsbsim"), Fleet(fitted_db).boat(coefficients.vehicle), "hzz20")


def test_loads_are_the_kernels_within_and_beyond_the_tables(flown):
    rng = np.random.default_rng(1)
    beyond = 0
    for _ in range(60):
        state = np.zeros(12)
        state[:6] = rng.uniform(-1.0, 1.0, 6) * (1.5, 2.0, 2.0, 0.06, 0.06, 0.08) + (rng.uniform(0, 8), 0, 0, 0, 0, 0)
        state[8], state[9:12] = rng.uniform(5.0, 40.0), rng.uniform(-0.2, 0.2, 3)
        controls = np.append(rng.uniform(-0.6, 0.6, 5), rng.uniform(0.0, 2.5))
        flown.start(state, controls)
        wanted = loads(flown.model, state[:6], state[8] + flown.model.sail_top, controls)
        largest = np.repeat([np.abs(wanted[:3]).max(), np.abs(wanted[3:]).max()], 3)
        np.testing.assert_allclose(flown.water() / largest, wanted / largest, rtol=0.0, atol=1e-9)
        beyond += math.hypot(state[1], state[2]) > abs(state[0])
    assert beyond > 3


def test_rest_and_single_motions_have_no_division_by_zero(flown):
    for k in range(-1, 6):
        state = np.zeros(12)
        state[8] = 30.0
        if k >= 0:
            # Where u and w both vanish the incidence is that of rounding errors, here as there.
            state[0], state[k] = 0.5, 0.02
        flown.start(state, np.zeros(6))
        wanted = loads(flown.model, state[:6], 30.0 + flown.model.sail_top, np.zeros(6))
        np.testing.assert_allclose(flown.water(), wanted, rtol=1e-9, atol=1e-6)


def test_it_turns_as_the_plant_does(flown, coefficients):
    """20 s with 10 degrees of rudder: JSBSim's integration and round earth are between them."""
    plant = Plant(flown.case, coefficients)
    controls = plant.controls.copy()
    for k, plane in enumerate(coefficients.vehicle.planes):
        controls[k] += plane.mixer.dH * math.radians(10.0)
    start = plant.state.copy()
    plant.reset(state=start, controls=controls)
    for k, plane in enumerate(coefficients.vehicle.planes):
        plant.stick(plane.name, float(controls[k]))
    flown.fdm.set_dt(0.01)
    flown.start(start, controls)
    while flown.fdm.get_sim_time() < 20.0 - 1e-6:
        flown.fdm.run()
    plant.advance(20.0)
    found = [flown.fdm[f"ident/feature/{k}"] for k in "uvwpqr"]
    np.testing.assert_array_less(np.abs(found - plant.state[:6]), [5e-4] * 3 + [1e-5] * 3)
    heading = math.degrees(flown.fdm["attitude/psi-rad"] - plant["psi"])
    assert abs(heading) < 0.02 < math.degrees(plant["psi"])
    assert flown.fdm["ident/feature/D0"] == pytest.approx(plant["D0"], abs=0.005)


def test_the_start_of_the_case_stays_at_rest_in_it(flown):
    flown.start(np.array(list(flown.done["start"].values())), list(flown.done["inputs"].values()))
    rates = [flown.fdm[f"ident/{k}dot"] for k in "uvwpqr"]
    np.testing.assert_allclose(rates, 0.0, atol=1e-5)


@pytest.mark.parametrize("rule", ["linear", "linear_load", "hold"])
def test_ends_of_tables_are_the_rules(rule, tmp_path):
    """A table of one axis alone, written as an expression and evaluated by hand."""
    from ident.exports.jsbsim_functions import look_up

    nodes, values = np.array([-2.0, -0.5, 1.0, 3.0]), np.array([1.0, -2.0, 0.5, 4.0])
    table = Table(("J",), (rule,), nodes[:, None])
    expression = look_up(values, [nodes], [rule], ["x"])
    for x in (-7.0, -2.0, -1.0, 0.2, 3.0, 11.0):
        assert _evaluated(expression, x) == pytest.approx(float(table.weights([x]) @ values), abs=1e-12)


def _evaluated(node, x):
    """An expression of one property, read as JSBSim's manual says."""
    if node.tag in ("value", "property"):
        return float(node.text) if node.tag == "value" else x
    if node.tag == "table":
        rows = np.array([line.split() for line in node.find("tableData").text.splitlines()], dtype=float)
        return float(np.interp(x, rows[:, 0], rows[:, 1]))
    parts = [_evaluated(child, x) for child in node]
    known = {
        "sum": sum,
        "product": math.prod,
        "difference": lambda p: p[0] - sum(p[1:]),
        "quotient": lambda p: p[0] / p[1],
        "min": min,
        "max": max,
    }
    return known[node.tag](parts)


def test_what_it_cannot_hold_is_refused_or_said(fitted_db, coefficients, tmp_path, flown):
    boat = Fleet(fitted_db).boat(coefficients.vehicle)
    with pytest.raises(InputError, match=r"\.xml"):
        export_jsbsim(boat, flown.case, "coeff_db", tmp_path / "boat.txt")
    text = Path(flown.done["file"]).read_text(encoding="utf-8")
    assert all(one in text for one in flown.done["lost"])
    assert flown.done["database"]["digest"] in text
    for name, lost in (("kvlcc2", "held"), ("nps-auv2", "slip")):
        vehicle = load_vehicle(name)
        members = [SimpleNamespace(term=t) for t in vehicle_terms(vehicle)]
        with pytest.raises(InputError, match=lost):
            export_jsbsim(SimpleNamespace(vehicle=vehicle, coefficients=members), flown.case, "", tmp_path / "b.xml")
    assert not (tmp_path / "b.xml").exists()
