"""Authority: Archimedes. A ship weighs what it displaces, and stands over it."""

from __future__ import annotations

import re
from importlib.resources import files

import pytest

from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError


@pytest.mark.parametrize(
    ("name", "share", "key"),
    [
        ("centre_of_gravity", 1.0, ""),
        ("centre_of_gravity", -1.0, "centre_of_gravity"),
        ("displaced_mass", 1.025, "mass"),
    ],
)
def test_a_ship_floats_on_an_even_keel(tmp_path, name, share, key):
    text = (files("sim") / "vehicles" / "kvlcc2.toml").read_text("utf-8")
    found = re.search(rf"^{name} = {{ value = \[?(-?[0-9.]+)", text, re.M)
    assert found
    path = tmp_path / "kvlcc2.toml"
    path.write_text(f"{text[: found.start(1)]}{share * float(found[1])!r}{text[found.end(1) :]}", "utf-8")
    if not key:
        assert load_vehicle(path).name == "kvlcc2"
        return
    with pytest.raises(InputError) as caught:
        load_vehicle(path)
    assert key in caught.value.where, caught.value
