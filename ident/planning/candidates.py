"""Candidate runs of a plan: the states a facility can make, as rows of a run table."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from pydantic import Field, field_validator

from ident.captive.campaign import Campaign
from ident.captive.run_table import STATES, run_table
from sim.boat.parts import parts_of, vehicle_terms
from sim.files.errors import InputError
from sim.files.schema import Data, checked
from sim.files.toml_files import read_toml

RATES = ("p", "q", "r")
# Propeller curves are not a matter of design: a row of advance coefficients gives them.
_NOT_PLANNED = ("open_water", "self_propulsion")
# Towing at less than 60 deg to the axis; beyond is cross-flow.
_AHEAD = 0.5


@cache
def defaults() -> dict[str, list[float]]:
    """Numbers of ``data/plan_defaults.csv`` by name."""
    with (files("ident") / "data" / "plan_defaults.csv").open(encoding="utf-8") as stream:
        return {r["name"]: [float(x) for x in r["value"].split()] for r in csv.DictReader(stream)}


class Levels(Data):
    """Levels one test may be run at, in the program's signs; angles and rates both ways.

    Empty lists leave a quantity at zero; ``speed_mps`` and ``depth_m`` are absolute.
    """

    speed_mps: list[float] = Field(default_factory=list)
    depth_m: list[float] = Field(default_factory=list)
    alpha_deg: list[float] = Field(default_factory=list)
    beta_deg: list[float] = Field(default_factory=list)
    plane_deg: list[float] = Field(default_factory=list)
    p_radps: list[float] = Field(default_factory=list)
    q_radps: list[float] = Field(default_factory=list)
    r_radps: list[float] = Field(default_factory=list)
    linear_mps2: list[float] = Field(default_factory=list)
    angular_radps2: list[float] = Field(default_factory=list)

    @field_validator("*")
    @classmethod
    def _not_negative(cls, values: list[float]) -> list[float]:
        if any(v < 0.0 for v in values):
            raise ValueError("zero or more: the signs are added")
        return values


class Facility(Data):
    """What a facility can do: levels by test, most repeats of one run.

    A test that is left out keeps the levels taken from the campaign; ``exclude`` names
    tests the facility does not have.
    """

    name: str = "levels of the campaign"
    repeats: int = Field(default_factory=lambda: int(defaults()["repeats"][0]), ge=1, le=1000)
    exclude: list[str] = Field(default_factory=list)
    towing: Levels | None = None
    drift_vertical: Levels | None = None
    drift_horizontal: Levels | None = None
    plane_deflection: Levels | None = None
    pure_rotation: Levels | None = None
    rotating_arm: Levels | None = None
    acceleration: Levels | None = None
    propeller_side_force: Levels | None = None

    @field_validator("exclude")
    @classmethod
    def _known(cls, names: list[str]) -> list[str]:
        tests = planned_tests()
        unknown = [n for n in names if n not in tests]
        if unknown:
            raise ValueError(f"{unknown[0]!r} is not one of {', '.join(tests)}")
        return names


def planned_tests() -> list[str]:
    """Tests a plan may hold: the tables of a facility file."""
    return [name for name in Facility.model_fields if name not in ("name", "repeats", "exclude")]


def read_facility(path: Path) -> Facility:
    """A facility file.

    Raises
    ------
    InputError
        For a file that is not TOML, an unknown test or quantity, a negative level.
    """
    if path.suffix != ".toml":
        raise InputError(str(path), "not a .toml file", "a TOML file with a table for every test, see docs/checks.md")
    data, where = read_toml(path, "")
    return checked(Facility, data, where)


def campaign_levels(campaign: Campaign) -> dict[str, Levels]:
    """Levels of every test from the campaign's own ranges, where it has none from the defaults."""
    runs, length = campaign.runs, campaign.vehicle.particulars.length.value
    along = np.cos(runs["alpha"].fillna(0.0)) * np.cos(runs["beta"].fillna(0.0)) > _AHEAD
    towed = runs[(runs["U"] > 0.0) & along & (runs["part"] == "hull")]
    speed = float(towed["U"].max()) if len(towed) else 1.0
    rate = _largest_rate(towed, length) or defaults()["rate"][0]
    by_test = dict(iter(runs.groupby("test")))
    levels_of = {}
    for test in planned_tests():
        group = by_test.get(test, runs)
        depths = group["D0"] if group["D0"].notna().any() else runs["D0"]
        depth = float(depths.max()) if depths.notna().any() else defaults()["depth"][0] * length
        levels = {"speed_mps": [] if test == "pure_rotation" else [speed], "depth_m": [depth]}
        levels |= {f"{a}_deg": _levels(np.rad2deg(towed[a].abs())) for a in ("alpha", "beta")}
        if test in ("pure_rotation", "rotating_arm", "propeller_side_force"):
            still = by_test.get("pure_rotation", runs.iloc[:0]) if test == "pure_rotation" else towed
            turned = _top(still, RATES) if test == "pure_rotation" else 0.0
            levels |= {f"{k}_radps": _levels(still[k].abs(), turned or rate * speed / length) for k in RATES}
        planes = [p.limit_deg for p in campaign.vehicle.planes]
        levels["plane_deg"] = _levels(np.rad2deg(runs["plane"].abs()), min(planes, default=0.0))
        if test == "acceleration":
            levels["linear_mps2"] = [float(_top(group, ("udot", "vdot", "wdot")) or speed**2 / length)]
            levels["angular_radps2"] = [float(_top(group, ("pdot", "qdot", "rdot")) or (speed / length) ** 2)]
        levels_of[test] = Levels(**levels)
    return levels_of


def _top(runs: pd.DataFrame, columns: tuple[str, ...]) -> float:
    return float(np.nan_to_num(runs[list(columns)].abs().to_numpy(float)).max(initial=0.0))


def _largest_rate(towed: pd.DataFrame, length: float) -> float:
    """Largest rate times L over U of yaw and pitch at speed."""
    if towed.empty:
        return 0.0
    rates = towed[["q", "r"]].abs().max(axis=1) * length / towed["U"]
    return float(np.nan_to_num(rates.max()))


def _levels(values: pd.Series, top: float = 0.0) -> list[float]:
    """Parts of the largest of the runs and ``top``; levels that were run, where they are near."""
    run = sorted({float(f"{v:.12g}") for v in values.dropna() if v > 0.0})
    largest = max(top, run[-1] if run else 0.0)
    if largest == 0.0:
        return []
    wanted = [largest * part for part in defaults()["part_of_range"]]
    # A level that was run shares its table point with the plan.
    near = [run[int(np.argmin(np.abs(np.array(run) - w)))] if run else w for w in wanted]
    return sorted({n if abs(n - w) < 0.25 * largest else w for n, w in zip(near, wanted, strict=True)})


def candidate_runs(campaign: Campaign, facility: Facility) -> pd.DataFrame:
    """Every state of the facility's grid, as a run table without loads.

    Parameters
    ----------
    campaign : For the levels a facility file leaves out, and the parts of the vehicle.
    facility : Limits.

    Returns
    -------
    Run table (SI, radians, program frame), ``why`` naming the kind of gap a run is for.
    """
    levels = campaign_levels(campaign)
    for test in levels:
        stated = getattr(facility, test)
        levels[test] = stated if stated is not None else levels[test]
    rows = [dict(zip(("test", "part", "why"), key, strict=True)) | state for key, state in _states(campaign, levels)]
    rows = [r for r in rows if r["test"] not in facility.exclude]
    table = run_table({c: [r.get(c, math.nan) for r in rows] for c in ("test", "part", "why", *STATES)})
    measured = campaign.runs
    again = measured[~measured["test"].isin([*_NOT_PLANNED, *facility.exclude]) & (measured["copy_of"] == "")]
    again = again[["test", "part", *STATES]].drop_duplicates().assign(why="value")
    table = pd.concat([table, again], ignore_index=True)
    table = run_table({c: table[c] for c in ("test", "part", "why", *STATES)})
    return table.assign(run_id=[f"plan-{i}" for i in range(len(table))], file="plan", decoupled="", reason="")


State = tuple[tuple[str, str, str], dict[str, float]]


def _states(campaign: Campaign, levels: dict[str, Levels]) -> Iterator[State]:
    yield from _flow(levels["drift_horizontal"], levels["drift_vertical"])
    yield from _rotation(levels["pure_rotation"])
    parts = {
        part
        for t in vehicle_terms(campaign.vehicle)
        for part in parts_of(t, campaign.vehicle)
        if "rotating_arm" in t.tests
    }
    for part in sorted(parts):
        yield from _arm(levels["rotating_arm"], "rotating_arm", part, levels["plane_deflection"].plane_deg)
    yield from _arm(levels["propeller_side_force"], "propeller_side_force", "propeller", [])
    for plane in campaign.vehicle.planes:
        for u, d, angle in _grid(levels["plane_deflection"], "plane_deg"):
            yield ("plane_deflection", plane.name, "value"), {"U": u, "D0": d, "plane": math.radians(angle)}
    yield from _acceleration(campaign, levels["acceleration"])
    for u, d in product(levels["towing"].speed_mps, levels["towing"].depth_m):
        yield ("towing", "hull", "value"), {"U": u, "D0": d}


def _both(values: list[float]) -> list[float]:
    return [s * v for v in values if v for s in (1.0, -1.0)]


def _grid(levels: Levels, *names: str) -> Iterator[tuple[float, ...]]:
    yield from product(levels.speed_mps, levels.depth_m, *(_both(getattr(levels, n)) for n in names))


def _flow(horizontal: Levels, vertical: Levels) -> Iterator[State]:
    """Drift and incidence: alone, together, and beyond the campaign's largest angle."""
    beyond, widest = defaults()["beyond"], defaults()["widest_deg"][0]
    for test, levels, name in (("drift_horizontal", horizontal, "beta"), ("drift_vertical", vertical, "alpha")):
        angles = getattr(levels, f"{name}_deg")
        far = [min(max(angles) * b, widest) for b in beyond] if angles else []
        for u, d in product(levels.speed_mps, levels.depth_m):
            for why, several in (("value", _both(angles)), (f"{name} beyond the runs", _both(sorted(set(far))))):
                for angle in several:
                    state = {"U": u, "D0": d, "alpha": 0.0, "beta": 0.0, name: math.radians(angle)}
                    yield (test, "hull", why), state
    for u, d, alpha, beta in _grid(horizontal, "alpha_deg", "beta_deg"):
        state = {"U": u, "D0": d, "alpha": math.radians(alpha), "beta": math.radians(beta)}
        yield ("drift_horizontal", "hull", "alpha with beta"), state


def _rotation(levels: Levels) -> Iterator[State]:
    """One rate, and every two rates together, without speed."""
    rates = {k: _both(getattr(levels, f"{k}_radps")) for k in RATES}
    for d in levels.depth_m:
        for name, values in rates.items():
            for value in values:
                yield ("pure_rotation", "hull", "value"), {"U": 0.0, "D0": d, name: value}
        for a, b in (("p", "q"), ("q", "r"), ("r", "p")):
            for x, y in product(rates[a], rates[b]):
                yield ("pure_rotation", "hull", "value"), {"U": 0.0, "D0": d, a: x, b: y}


def _arm(levels: Levels, test: str, part: str, deflections: list[float]) -> Iterator[State]:
    """One rate at speed: alone, with incidence, with drift, with a plane deflected.

    With a flow angle the rate is raised so that u times rate keeps its table point.
    """
    flows = [(0.0, 0.0), *((math.radians(a), 0.0) for a in _both(levels.alpha_deg))]
    flows += [(0.0, math.radians(b)) for b in _both(levels.beta_deg)]
    angles = [0.0] if part in ("hull", "propeller") else _both(deflections)
    for (u, d), name in product(product(levels.speed_mps, levels.depth_m), RATES):
        for rate, (alpha, beta), angle in product(_both(getattr(levels, f"{name}_radps")), flows, angles):
            state = {"U": u, "D0": d, "alpha": alpha, "beta": beta, name: rate / (math.cos(alpha) * math.cos(beta))}
            if part not in ("hull", "propeller"):
                state["plane"] = math.radians(angle)
            yield (test, part, "value"), state


def _acceleration(campaign: Campaign, levels: Levels) -> Iterator[State]:
    """One acceleration at a time, on the hull or on every section."""
    sections = campaign.vehicle.sections if campaign.vehicle.added_mass == "sections" else None
    parts = [s.name for s in sections.centres] if sections else ["hull"]
    linear, angular = ("udot", "vdot", "wdot"), () if sections else ("pdot", "qdot", "rdot")
    for part, d in product(parts, levels.depth_m):
        for names, values in ((linear, levels.linear_mps2), (angular, levels.angular_radps2)):
            for name, value in product(names, values):
                yield ("acceleration", part, "value"), {"U": 0.0, "D0": d, name: value}
