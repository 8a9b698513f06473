"""The public names: their examples run, they load late, no room hides one, the command line is the same thing."""

from __future__ import annotations

import doctest
import inspect
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import ident
from ident.cli import main
from sim.boat.row_codec import correlation_pairs

ROOT = Path(__file__).parents[1]
SECTIONS = ("Parameters", "Returns", "Raises")


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """A folder as the examples have it: the starter boat, fitted once."""
    folder = tmp_path_factory.mktemp("desk")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        ident.write_starter("my-boat")
        ident.fit("my-boat/captive", db="coeff_db")
        yield folder


def _examples(name):
    """Doctests of a public name and of its own methods."""
    public = getattr(ident, name)
    return [t for t in doctest.DocTestFinder(recurse=True).find(public, name, globs={}) if t.examples]


@pytest.mark.parametrize("name", ident.__all__)
def test_the_examples_of_a_public_name_run(desk, name):
    found = _examples(name)
    assert found, f"{name} has no example"
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for example in found:
        said: list[str] = []
        runner.run(example, out=said.append)
        assert not said, "".join(said)


@pytest.mark.parametrize("name", [n for n in ident.__all__ if inspect.isfunction(getattr(ident, n))])
def test_a_function_says_what_it_takes_gives_and_refuses(name):
    function = getattr(ident, name)
    text = inspect.getdoc(function)
    for section in SECTIONS:
        assert f"{section}\n{'-' * len(section)}" in text, f"{name}: {section}"
    for parameter in inspect.signature(function).parameters:
        assert parameter in text, f"{name}: {parameter}"


def test_every_public_name_is_listed_and_lives_where_it_is_said():
    assert set(ident.__all__) == set(ident._PLACES)
    assert set(ident.__all__) <= set(dir(ident))
    for name, place in ident._PLACES.items():
        assert getattr(ident, name).__module__ == place
        assert getattr(ident, name).__name__ == name
        assert inspect.getdoc(getattr(ident, name))
    with pytest.raises(AttributeError, match="no attribute 'fits'"):
        ident.fits  # noqa: B018


def test_no_room_hides_a_public_name():
    """``ident.fit`` is a function whatever was imported before: no module of the package has a public name."""
    rooms = {p.stem for p in (ROOT / "ident").iterdir() if p.suffix == ".py" or p.is_dir()}
    assert not rooms & set(ident.__all__)


def _loaded(code):
    text = f"import sys, time; start = time.perf_counter(); {code}; took = time.perf_counter() - start\n"
    text += "import json; print(json.dumps([took, sorted(sys.modules)]))"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True, cwd=ROOT)
    return json.loads(done.stdout)


def test_importing_the_package_loads_none_of_the_heavy_libraries():
    took, modules = min((_loaded("import ident") for _ in range(3)), key=lambda found: found[0])
    assert not {"numba", "pandas", "matplotlib", "numpy", "scipy", "xarray", "pydantic"} & set(modules)
    assert took < 0.05


def test_a_public_name_is_loaded_with_no_more_than_it_needs():
    _, modules = _loaded("import ident; ident.Database")
    assert not {"numba", "matplotlib", "xarray", "scipy"} & set(modules)


def test_a_flight_imports_no_library_that_it_does_not_use():
    """Of what a command takes before it flies, most is imports: a number of modules is the same on every machine."""
    _, modules = _loaded("import ident.validation.validate, ident.validation.tables")
    found = set(modules)
    assert not {"matplotlib", "scipy.sparse", "scipy.optimize", "scipy.interpolate", "xarray"} & found
    assert not {"ident.captive.campaign", "ident.trials.trial", "ident.identification.identify"} & found
    assert sum(name.partition(".")[0] in ("ident", "sim") for name in found) <= 110


def test_a_flight_held_against_a_record_makes_no_units_and_draws_nothing(fitted_db):
    """Beside what it needs, it loads nothing while it flies either."""
    _, modules = _loaded(f"import ident; assert ident.validate('hzz20', {fitted_db!r}).errors")
    assert not {"pint", "dask", "matplotlib", "scipy.optimize", "scipy.interpolate", "xarray"} & set(modules)


def test_a_report_begins_to_draw_before_it_loads_what_it_computes_with():
    _, modules = _loaded("import ident.report.page, ident.report.interactive")
    assert not {"numba", "scipy", "matplotlib", "plotly", "ident.captive.campaign"} & set(modules)


def _equal(one, other):
    """JSON content without the time stamps of two commits."""
    return json.loads(json.dumps(one)) == json.loads(json.dumps(other))


def test_the_command_line_prints_what_the_functions_give(desk, planned):
    def said(*arguments):
        done = CliRunner().invoke(main, [*arguments, "--json", "-"])
        assert done.exit_code == 0, done.output
        return json.loads(done.stdout)

    case, folder = "my-boat/zigzag.toml", "my-boat/captive"
    assert _equal(said("fit", folder), ident.fit(folder).to_dict())
    assert _equal(said("check", folder), ident.check(folder).to_dict())
    assert _equal(said("plan", folder, "--target-rel", "0.5"), planned.to_dict())
    assert _equal(said("validate", "--case", case), ident.validate(case).to_dict())
    assert _equal(said("stability", "--case", case, "--speed", "4"), ident.stability(case, speeds=[4.0]).to_dict())
    assert _equal(said("versions"), ident.Database("coeff_db").to_dict())
    assert said("diff", "0", "0") == []


def test_results_have_a_table_for_a_notebook(desk, planned):
    case, folder = "my-boat/zigzag.toml", "my-boat/captive"
    shown = [ident.read_campaign(folder), ident.check(folder), planned, ident.fit(folder)]
    shown += [ident.validate(case), ident.stability(case, speeds=[4.0]), ident.Database("coeff_db")]
    shown += [ident.Database("coeff_db")[0], ident.Database("coeff_db")[0].diff(ident.Database("coeff_db")[0])]
    for one in shown:
        page = one._repr_html_()
        assert page.count("<table>") == page.count("</table>") >= 1
        assert "<td>" in page or type(one) is ident.Difference
    flown = ident.validate(case)
    shown += [flown.simulation, ident.fit(folder)[0].identification, flown.with_bands(8).bands]
    for one in [*shown, ident.scoreboard(cases=[case])]:
        assert "\n" not in repr(one)
        assert len(repr(one)) < 200


def test_text_from_files_is_escaped_in_a_notebook(desk):
    version = ident.Database("coeff_db")[0]
    odd = ident.DatabaseVersion("<b>db", version.number, version.commit, version.history)
    odd.__dict__["rows"] = version.rows
    assert "<b>" not in odd._repr_html_()


def test_versions_count_from_either_end_and_name_what_is_missing(desk, tmp_path):
    db = ident.Database("coeff_db")
    assert [v.number for v in db] == [v.number for v in db.versions] == list(range(len(db)))
    assert db[-1].number == db.latest.number == len(db) - 1
    for number in (len(db), -len(db) - 1):
        with pytest.raises(ident.InputError, match="does not exist"):
            db[number]
    with pytest.raises(ident.InputError, match="no coefficient database"):
        ident.Database(tmp_path)
    with pytest.raises(KeyError, match=r"no N_vv in version 0 \(my-boat\); spelt like it: N_v"):
        db[0]["N_vv"]
    with pytest.raises(ident.InputError, match="no coefficients of vehicle 'nobody'"):
        db[0].of("nobody")


@pytest.fixture(scope="module")
def planned(desk):
    return ident.plan("my-boat/captive", 0.5)


@pytest.fixture(scope="module")
def bb2(fitted_db):
    return ident.Database(fitted_db)[0]


def test_a_table_over_axes_holds_every_row_at_its_place(bb2):
    for name in ("N_uvw", "Z_uvw", "Y_d1", "KT", "X_udot_section"):
        array, rows = bb2[name], bb2.rows[bb2.rows["coefficient"] == name]
        assert np.isfinite(array).sum() == len(rows)
        axes = [d for d in array.dims if d != "part"]
        for _, row in rows.iterrows():
            point = array.sel({a: row[a] for a in axes} | ({"part": row["part"]} if "part" in array.dims else {}))
            assert point.item() == row["value"]
            assert point.stderr.item() == row["stderr"]
            assert point.runs.item() == row["runs"]
            assert point.quality.item() == row["quality"]


def test_axes_have_units_and_the_array_says_what_load_it_is(bb2):
    array = bb2["N_uvw"]
    assert array.dims == ("speed_mps", "alpha_deg", "beta_deg", "depth_m")
    assert [array[d].attrs["units"] for d in array.dims] == ["m/s", "deg", "deg", "m"]
    assert array.attrs["load"] == "N = 1/2 rho L^3 N_uvw U*U"
    assert "forward" in array.attrs["frame"]
    assert (array.attrs["units"], array.stderr.attrs["units"]) == ("1", "1")


def test_what_it_takes_to_find_where_a_value_comes_from(tmp_path):
    """File, row and the row's own words, from the database alone."""
    db = str(tmp_path / "db")
    (done,) = ident.fit(ROOT / "raw_captive_data" / "bb2", db=db)
    point = ident.Database(db)[0]["N_uvw"].sel(beta_deg=8, depth_m=23.69, speed_mps=5.14444, method="nearest").squeeze()
    runs = done.campaign.runs.set_index("run_id").loc[point.runs.item().split()]
    assert len(runs) >= 1
    for _, run in runs.iterrows():
        assert f"{run['source']} ({run['file']} row " in point.source.item()
        assert math.degrees(run["beta"]) == pytest.approx(8.0)
    mirrored = (
        ident.Database(db)[0]["N_uvw"].sel(beta_deg=-8, depth_m=23.69, speed_mps=5.14444, method="nearest").squeeze()
    )
    assert mirrored.origin.item() == "mirror"
    assert mirrored.source.item().startswith("mirror image of: ")


def test_a_version_from_before_runs_were_kept_names_its_campaign(bb2):
    assert set(np.unique(bb2["KT"].source.values)) == {"campaign "}


def test_a_covariance_is_that_of_the_rows(bb2):
    found = bb2.covariance("N_uvw", "Y_uvw", "M_uq")
    rows = bb2.rows[bb2.rows["coefficient"].isin(["N_uvw", "Y_uvw", "M_uq"])].reset_index(drop=True)
    matrix = found.to_numpy()
    known = (rows["estimate"] >= 0).to_numpy()
    np.testing.assert_allclose(np.diag(matrix), np.where(known, rows["stderr"] ** 2, 0.0), rtol=1e-14)
    np.testing.assert_allclose(matrix, matrix.T, rtol=0, atol=0)
    assert np.linalg.eigvalsh(matrix).min() > -1e-6 * np.diag(matrix).max()
    # Mirror images are one estimate: of an odd load they have opposite errors.
    one, other = rows.index[(rows["coefficient"] == "N_uvw") & (rows["beta_deg"].abs() == 8)][:1].tolist() * 2
    pair = rows[(rows["estimate"] == rows["estimate"][one]) & (rows.index != one)].index[0]
    sign = math.copysign(1.0, rows["value"][one] * rows["value"][pair])
    assert matrix[one, pair] == pytest.approx(sign * rows["stderr"][one] * rows["stderr"][other], rel=1e-12)
    # Estimates of different numbers, as the row says them.
    for i, row in rows.iterrows():
        for number, rho in correlation_pairs(row["correlation"]).items():
            for j in rows.index[rows["estimate"] == number][:1]:
                size = row["stderr"] * rows["stderr"][j]
                assert abs(matrix[i, j]) == pytest.approx(abs(rho) * size, rel=1e-5, abs=1e-30)


def test_a_sum_of_values_has_the_variance_that_error_bands_draw(bb2):
    """w^T R w, with the steps that one draw of each estimate makes in the rows."""
    from ident.validation.bands import _row_steps
    from sim.boat.row_codec import correlation_matrix

    estimates, correlation = correlation_matrix(bb2.rows)
    index, step = _row_steps(bb2.rows, estimates)
    chosen = bb2.rows["coefficient"].isin(["M_uq", "M_uvw"]).to_numpy() & (index >= 0)
    weight = np.bincount(index[chosen], step[chosen], len(estimates))
    found = bb2.covariance("M_uq", "M_uvw").to_numpy().sum()
    assert found == pytest.approx(weight @ correlation @ weight, rel=1e-9)
    assert found > 0.0


def test_a_difference_counts_and_scales(desk, tmp_path):
    db = str(tmp_path / "db")
    ident.fit("my-boat/captive", db=db)
    before = ident.Database(db)[0]
    rows = before.rows.copy()
    place = rows.index[rows["coefficient"] == "N_v"][0]
    rows.loc[place, "value"] += 3.0 * rows.loc[place, "stderr"]
    from ident.database.store import commit

    commit(db, rows, {})
    changed = before.diff(ident.Database(db)[1])
    assert changed.to_dict() == [change.to_dict() for change in changed]
    (change,) = changed
    assert (change.coefficient, change.added, change.removed, change.changed) == ("N_v", 0, 0, 1)
    assert change.largest_change_in_stderr == pytest.approx(3.0, rel=1e-9)
    assert changed.table.loc[("my-boat", "N_v"), "changed"] == 1
