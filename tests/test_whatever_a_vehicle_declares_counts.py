"""Every key of a vehicle file: changing it changes the model, the limits of a flight or what a version says of it,
or is refused.

The keys are those of the bundled BB2, which has all of them but ``terms``; a key of the schema that it lacks fails.
"""

from __future__ import annotations

import copy
import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from toml_text import toml

from ident.database.provenance import vehicle_stated
from ident.report.page import _errata
from ident.schemas.describe import keys
from sim.boat.coefficients import Coefficients
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.simulate import mixer_of, plane_limits
from sim.hull.slender import geometry_of
from sim.kernel.assemble import assemble, with_tanks
from sim.waves.points import probes, section_masses

FOLDER = Path(__file__).parents[1] / "sim" / "vehicles"
BB2 = tomllib.loads((FOLDER / "bb2.toml").read_text("utf-8"))
# Words that only say where a number is from, or what a place is called.
WORDS = ("title", "source", "where", "origin", "name")


def leaves(data: Any, place: tuple[Any, ...] = ()):
    """Place -> value of every key that holds a number, a text or a list of numbers; of lists of tables the first."""
    for name, value in data.items():
        if isinstance(value, dict):
            yield from leaves(value, (*place, name))
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            yield from leaves(value[0], (*place, name, 0))
        else:
            yield (*place, name), value


def other(name: str, value: Any) -> Any:
    """Another value of the same type."""
    known = {"x": "forward", "y": "port", "z": "down", "mirror": "sail_plane_1", "term_set": "gertler_hagen"}
    known |= {"added_mass": "sections", "unit": "ft"}
    if name in known:
        return known[name]
    if isinstance(value, str):
        return f"other-{value}"
    if isinstance(value, list):
        return [other("", v) if i == len(value) - 1 else v for i, v in enumerate(value)]
    return value * 1.02 if value else 0.05


def changed(place: tuple[Any, ...]) -> dict[str, Any]:
    data = copy.deepcopy(BB2)
    inner: Any = data
    for step in place[:-1]:
        inner = inner[step]
    inner[place[-1]] = other(str(place[-1]), inner[place[-1]])
    return data


@pytest.fixture(scope="module")
def outcome(tmp_path_factory, rows, environment):
    folder = tmp_path_factory.mktemp("vehicles")
    shutil.copytree(FOLDER / "bb2", folder / "bb2")

    def found(data: dict[str, Any]) -> dict[str, Any]:
        (folder / "boat.toml").write_text(toml(data), "utf-8")
        try:
            vehicle = load_vehicle(folder / "boat.toml")
            coefficients = Coefficients(vehicle, rows)
            model = with_tanks(assemble(coefficients, environment), vehicle)
            # Read by what needs the surface, and by the report.
            geometry_of(vehicle)
            _errata(vehicle)
        except InputError as error:
            return {"refused": str(error)}
        numbers = [model.real, model.whole, mixer_of(vehicle), *plane_limits(vehicle), probes(vehicle)]
        numbers += section_masses(coefficients, environment, None)
        tanks = (vehicle.tanks.ballast, vehicle.tanks.trim)
        numbers += [[vehicle.propeller.limits.value, [vehicle.propeller.rate.value] * 2]]
        numbers += [[getattr(t, k).value for t in tanks for k in ("limit", "rate")]]
        numbers += [[vehicle.particulars.sail_top.value]]
        flat = np.concatenate([np.ravel(np.asarray(n, dtype=float)) for n in numbers])
        names = [vehicle.name, vehicle.part_names(), [t.name for t in vehicle_terms(vehicle)]]
        return {"numbers": flat, "names": names, "words": vehicle_stated(vehicle)}

    return found


@pytest.fixture(scope="module")
def usual(outcome):
    return outcome(BB2)


PLACES = [place for place, _ in leaves(BB2)]


@pytest.mark.parametrize("place", PLACES, ids=[".".join(map(str, p)) for p in PLACES])
def test_every_key_of_a_vehicle_counts(outcome, usual, place):
    assert "refused" not in usual, usual
    found = outcome(changed(place))
    if "refused" in found:
        named = ("boat.toml", "vehicle bb2", "other-bb2")
        assert any(name in found["refused"] for name in named), found
        return
    alike = found["numbers"].shape == usual["numbers"].shape and np.array_equal(found["numbers"], usual["numbers"])
    if place[-1] in WORDS:
        assert found["words"] != usual["words"] or found["names"] != usual["names"]
    else:
        assert not alike or found["names"] != usual["names"], "declared, and nothing changed"


def test_bb2_has_every_key_but_a_term_file_a_ships_rudder_and_the_speed_of_others_maneuvers(outcome):
    """Whose keys are those of tests/test_own_terms_of_a_vehicle.py, tests/test_published_kvlcc2.py and
    tests/test_cases_flown_by_other_boats.py."""
    there = {place[-1] for place in PLACES} | {step for place in PLACES for step in place if isinstance(step, str)}
    assert {key.name for key in keys("vehicle")} - there == {"terms", "rudder", "area", "height", "approach_speed"}
    size = {"area": BB2["particulars"]["length"] | {"unit": "m2"}, "height": BB2["particulars"]["length"]}
    assert "rudder" in outcome({**BB2, "rudder": size})["refused"]


@pytest.mark.parametrize("place", ["particulars", "propeller", "planes", "frame", "tanks"])
def test_a_key_that_is_none_is_refused(outcome, place):
    data = copy.deepcopy(BB2)
    (data[place][0] if isinstance(data[place], list) else data[place])["colour"] = "grey"
    assert "colour" in outcome(data)["refused"]
