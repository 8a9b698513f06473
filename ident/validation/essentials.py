"""What a version must have before a boat is flown from it: the loads that its tests are made for."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ident.captive.known_tests import tests
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


def refuse_without_essentials(vehicle: Vehicle, rows: pd.DataFrame, metadata: Mapping[str, str], where: str) -> None:
    """Refuse a flight of a boat without an essential load, as where a column of its runs was forgotten.

    Parameters
    ----------
    vehicle : That is to be flown.
    rows : Of the version.
    metadata : Of its commit: loads declared absent, and errors that a fit was forced past, are no surprise.
    where : The database.

    Raises
    ------
    InputError
        Naming the load, the test that gives it and the terms that are missing.
    """
    if metadata.get("forced") or "conversions" not in metadata:
        return
    declared = _absent(json.loads(metadata["conversions"]))
    there = set(rows.loc[(rows["part"] == "hull") & (rows["value"] != 0.0), "coefficient"])
    terms = [t for t in vehicle_terms(vehicle) if t.part == "hull"]
    for test, essential in tests()["essential"].items():
        for output in str(essential).split():
            wanted = [t.name for t in terms if test in t.tests and t.output == output]
            if wanted and not there & set(wanted) and f"{test}.{output}" not in declared:
                wrong = f"no {output} of the hull from {test}: {', '.join(wanted)[:120]} missing, every flight is wrong"
                text = f'runs or values that give it, or in campaign.toml: [absent] "{test}.{output}" = "why"'
                raise InputError(f"{where}, vehicle {vehicle.name}", wrong, text)


def _absent(conversions: Mapping[str, object]) -> set[str]:
    """Loads that the campaigns of a version declare absent."""
    absent = set(conversions.get("absent") or ())  # type: ignore[call-overload]
    for one in (conversions.get("campaigns") or {}).values():  # type: ignore[attr-defined]
        absent |= _absent(one)
    return absent
