"""Campaigns of one boat fitted together: the habits of five laboratories, and facilities that differ.

Authority: the bundled campaign itself, split by tests among facilities that write it each in another
frame, hand, scale, unit system, moment point and water; and made campaigns with a known error between them.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rewritten_campaigns import BB2, assert_same, frame_text, header, in_units, moved, number, scaled, text, turned
from small_campaign import HEADER

from ident.captive.campaign import find_campaigns, read_campaign
from ident.captive.combine import by_vehicle
from ident.database.store import database_rows
from ident.fitting.fit import fit
from ident.identification.identify import identify
from sim.boat.database import versions
from sim.files.errors import InputError


@pytest.fixture(scope="module")
def tables():
    return {p.name: pd.read_csv(p, dtype=str, keep_default_na=False) for p in sorted(BB2.glob("*.csv"))}


def shares(tables: dict[str, pd.DataFrame], number_of: int) -> list[list[str]]:
    """Files in so many shares; those with a test in common, or copies of each other's runs, stay together."""
    parent = {name: name for name in tables}

    def root(name: str) -> str:
        while parent[name] != name:
            name = parent[name]
        return name

    owner = {run: name for name, table in tables.items() for run in table["run_id"]}
    tests: dict[str, str] = {}
    for name, table in tables.items():
        for test in table["test"].unique():
            parent[root(name)] = root(tests.setdefault(test, name))
        for origin in table["copy_of"][table["copy_of"] != ""] if "copy_of" in table else ():
            parent[root(name)] = root(owner[origin])
    groups: dict[str, list[str]] = {}
    for name in tables:
        groups.setdefault(root(name), []).append(name)
    found: list[list[str]] = [[] for _ in range(number_of)]
    for k, group in enumerate(sorted(groups.values(), key=len, reverse=True)):
        found[k % number_of] += group
    assert all(found)
    return found


def in_water(tables, density: float):
    """Loads of the same boat in other water."""
    other = {}
    for name, table in tables.items():
        other[name] = table.copy()
        for column in [c for c in table if c.split("_")[0] in tuple("XYZKMN") and c.endswith(("_N", "_Nm"))]:
            other[name][column] = text(number(table[column]) * density / 1025.0)
    return other


def plain(tables):
    return tables, header()


def other_axes(tables):
    """A basin with x forward, z up by the left hand, and the ship's sign of drift, in fresh water."""
    made = turned(in_water(tables, 1000.0), {"x": -1, "y": 1, "z": 1}, -1)
    for table in made.values():
        if "beta_deg" in table:
            table["beta_deg"] = text(-number(table["beta_deg"]))
    head = frame_text("forward", "starboard", "up", "left-hand", "ittc")
    return made, head.replace("density_kgpm3 = 1025.0", "density_kgpm3 = 1000.0")


def small_model(tables):
    """A towing tank: a model at 1:18.348, moments about its own point."""
    ratio, point = 18.348, (0.21, -0.05, 0.13)
    head = header().replace("ratio = 1.0", f"ratio = {ratio}").replace("length_m = 70.2", f"length_m = {70.2 / ratio}")
    for axis, value in zip("xyz", point, strict=True):
        head = head.replace(f"{axis}_m = 0.0", f"{axis}_m = {value}")
    return moved(scaled(tables, ratio), point, 1), head


def imperial(tables):
    return in_units(tables), header()


def thousandths(tables):
    """Loads in kN under headers that say nothing, with the sign of a resistance: factors by hand."""
    made = {}
    for name, table in tables.items():
        made[name] = table.copy()
        for column in [c for c in table if c in ("X_N", "N_Nm")]:
            made[name][column] = text(number(table[column]) * (-1.0 if column == "X_N" else 1e-3))
    sources = ""
    for name, table in made.items():
        factors = ["X = -1.0" if c == "X_N" else "N = 1000.0" for c in table if c in ("X_N", "N_Nm")]
        sources += f'[[source]]\nfiles = "{name}"\n' + (
            "[source.factor]\n" + "\n".join(factors) + "\n" if factors else ""
        )
    return made, header() + sources


HABITS = {"a_plain": plain, "b_axes": other_axes, "c_model": small_model, "d_feet": imperial, "e_factors": thousandths}


def test_five_laboratories_together_give_bb2s_coefficients(tables, rows, tmp_path):
    for (name, habit), files in zip(HABITS.items(), shares(tables, len(HABITS)), strict=True):
        made, head = habit({f: tables[f] for f in files})
        folder = tmp_path / name
        folder.mkdir()
        (folder / "campaign.toml").write_text(head.replace('"bb2-captive-2021"', f'"{name}"'), "utf-8")
        for file, table in made.items():
            table.to_csv(folder / file, index=False)
    paths = find_campaigns(tmp_path)
    (whole,), _ = by_vehicle([read_campaign(p) for p in paths], paths)
    found = identify(whole)
    got = database_rows(found)
    assert not any(one.tau > 0.0 for one in found.between)
    got["runs"] = got["runs"].map(lambda t: " ".join(r.partition("/")[2] for r in t.split()))
    assert_same(got, rows, 1e-9)


def habits_of_a_basin(tables):
    """All at once: axes by the left hand, ITTC drift, other water, a model, its own moment point, feet and pounds."""
    ratio, point = 18.348, (0.21, -0.05, 0.13)
    made = moved(turned(scaled(in_water(tables, 1000.0), ratio), {"x": -1, "y": 1, "z": 1}, -1), point, 1)
    for table in made.values():
        if "beta_deg" in table:
            table["beta_deg"] = text(-number(table["beta_deg"]))
    head = frame_text("forward", "starboard", "up", "left-hand", "ittc")
    head = head.replace("density_kgpm3 = 1025.0", "density_kgpm3 = 1000.0").replace("ratio = 1.0", f"ratio = {ratio}")
    head = head.replace("length_m = 70.2", f"length_m = {70.2 / ratio}")
    for axis, value in zip("xyz", point, strict=True):
        head = head.replace(f"{axis}_m = 0.0", f"{axis}_m = {value}")
    return in_units(made), head


def habits_of_a_tunnel(tables):
    """Full scale about the stern, thousands of newton metres under N, resistance positive aft, axes to port."""
    point = (-31.0, 0.4, 1.5)
    made, _ = thousandths(moved(turned(tables, {"x": 1, "y": -1, "z": 1}, -1), point, 1))
    _, head = thousandths(tables)
    head = head.replace('y = "starboard"', 'y = "port"\nrotations = "left-hand"')
    for axis, value in zip("xyz", point, strict=True):
        head = head.replace(f"{axis}_m = 0.0", f"{axis}_m = {value}")
    return made, head


def test_two_facilities_with_every_habit_that_measured_the_same_runs_give_bb2s_coefficients(tables, rows, tmp_path):
    """Each has the whole campaign in its own form; together they are BB2's, and nothing stands between them."""
    for name, habit in (("basin", habits_of_a_basin), ("tunnel", habits_of_a_tunnel)):
        made, head = habit(tables)
        (tmp_path / name).mkdir()
        (tmp_path / name / "campaign.toml").write_text(head.replace('"bb2-captive-2021"', f'"{name}"'), "utf-8")
        for file, table in made.items():
            table.to_csv(tmp_path / name / file, index=False)
    found = together(tmp_path)
    assert {one.output for one in found.between} >= {"X", "Y", "N"}
    assert not any(one.tau > 0.0 for one in found.between)
    got = database_rows(found)
    assert len(got) == len(rows)
    # But for the wake, which is of one self-propulsion run, each value rests on the runs of both.
    assert (got["n_runs"] == 2 * rows["n_runs"]).mean() > 0.95
    key = [rows["coefficient"], rows["part"]]
    largest = rows["value"].abs().groupby(key).transform("max")
    off = (got["value"] - rows["value"]).abs() / largest.where(largest > 0.0, 1.0)
    assert off.max() < 1e-9, rows.loc[off.idxmax(), ["coefficient", "part", "value"]].to_dict()


# -- facilities that differ ------------------------------------------------------------------------


def facility(
    folder: Path, name: str, factor: float, noise: float = 0.0, seed: int = 0, density: float = 1025.0
) -> Path:
    """Drift runs of a boat with a known Y and N, all loads of this facility times a factor."""
    folder = folder / name
    folder.mkdir(parents=True)
    head = HEADER.replace('name = "small"', f'name = "{name}"').replace('vehicle = "bb2"', 'vehicle = "suboff"')
    head = head.replace("length_m = 70.2", "length_m = 4.2609").replace("1025.0", str(density))
    head = head.replace('x = "aft"', 'x = "forward"').replace('z = "up"', 'z = "down"')
    # This balance has all components.
    head = head.replace('[absent]\n"drift_horizontal.N" = "a made balance of two components"\n', "")
    (folder / "campaign.toml").write_text(head, "utf-8")
    generator = np.random.default_rng(seed)
    pressure = 0.5 * density * 4.2609**2 * 4.0
    lines = ["run_id,test,part,U_mps,alpha_deg,beta_deg,X_N,Y_N,N_Nm,rel_sigma,quality,source"]
    for beta in (-8, -6, -4, -2, 0, 2, 4, 6, 8):
        # The terms are over u v and not over v U.
        v = math.sin(math.radians(beta)) * math.cos(math.radians(beta))
        y, n = -0.028 * v * pressure * factor, -0.0136 * v * pressure * 4.2609 * factor
        y, n = (load * (1.0 + noise * generator.standard_normal()) for load in (y, n))
        x = -0.001 * pressure * factor
        lines.append(f"r{beta},drift_horizontal,hull,2,0,{beta},{x!r},{y!r},{n!r},0.03,as_published,made")
    (folder / "runs.csv").write_text("\n".join(lines) + "\n", "utf-8")
    return folder


def together(folder: Path):
    paths = find_campaigns(folder)
    (whole,), _ = by_vehicle([read_campaign(p) for p in paths], paths)
    return identify(whole)


def test_campaigns_that_agree_show_no_error_between_them(tmp_path):
    for k, density in enumerate((1025.0, 1000.0, 998.0)):
        facility(tmp_path, f"lab{k}", 1.0, density=density)
    found = together(tmp_path)
    assert {one.output for one in found.between} >= {"Y", "N"}
    assert all(one.tau == 0.0 for one in found.between)
    values = {n.name: v for n, v in zip(found.nodes, found.values, strict=True)}
    assert values["Y_v"] == pytest.approx(-0.028, rel=1e-9)


def test_the_error_between_facilities_is_recovered(tmp_path):
    """Twelve facilities whose loads differ by 10 %: tau and the standard error of the mean come out."""
    factors = 1.0 + 0.1 * np.random.default_rng(4).standard_normal(12)
    for k, one in enumerate(factors):
        facility(tmp_path, f"lab{k:02d}", float(one), 0.01, seed=k)
    found = together(tmp_path)
    tau = {one.output: one.tau for one in found.between}
    assert tau["Y"] == pytest.approx(np.std(factors, ddof=1), rel=0.15)
    at = next(i for i, n in enumerate(found.nodes) if n.name == "Y_v")
    error = math.sqrt(found.covariance[at, at]) / abs(found.values[at])
    assert found.values[at] == pytest.approx(-0.028 * factors.mean(), rel=0.03)
    # The mean of twelve, not of a hundred runs.
    assert error > 0.7 * np.std(factors, ddof=1) / math.sqrt(12.0)


def test_the_fit_of_several_campaigns_is_one_version_that_says_so(tmp_path):
    facility(tmp_path / "c", "tank", 1.0)
    facility(tmp_path / "c", "arm", 1.25)
    (done,) = fit(tmp_path / "c", tmp_path / "db")
    assert any(f.check == "facilities" and "Y: between facilities" in f.what for f in done.findings)
    stored = versions(str(tmp_path / "db"))[-1].metadata
    assert {one["output"] for one in json.loads(stored["between"])} >= {"Y", "N"}
    assert set(json.loads(stored["conversions"])["campaigns"]) == {"arm", "tank"}
    assert any(name.startswith("tank/") for name in json.loads(stored["inputs"]))


def test_two_vehicles_of_one_name_are_refused(tmp_path):
    facility(tmp_path, "tank", 1.0)
    other = facility(tmp_path, "arm", 1.0)
    source = Path(read_campaign.__code__.co_filename).parents[2] / "sim" / "vehicles" / "suboff.toml"
    (other / "mine.toml").write_text(source.read_text("utf-8").replace("4.2609", "4.3", 1), "utf-8")
    head = (other / "campaign.toml").read_text("utf-8").replace('vehicle = "suboff"', 'vehicle = "mine.toml"')
    (other / "campaign.toml").write_text(head, "utf-8")
    with pytest.raises(InputError, match="another particulars"):
        together(tmp_path)
