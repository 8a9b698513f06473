"""The report page and the derivatives it checks."""

from __future__ import annotations

import html
import json
import math
import re
from dataclasses import astuple
from pathlib import Path

import pandas as pd
import pytest

from ident.analysis.derivatives import checks, derivatives
from ident.captive.campaign import read_campaign
from ident.database.store import commit, database_rows
from ident.identification.identify import identify
from ident.report.figures import _group, quality_colours
from ident.report.page import write_report
from sim.boat.coefficients import Coefficients
from sim.boat.database import column_order, read_rows, versions
from sim.boat.mass import Environment
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError

BB2 = Path(__file__).parents[1] / "raw_captive_data" / "bb2"
SPEED, DEPTH = 5.14444, 25.0
# Signs of a submarine about straight ahead, SNAME frame (model.md, section 10).
SIGNS = {"Y_v": -1, "N_v": -1, "Z_w": -1, "M_w": 1, "Y_r": 1, "N_r": -1, "Z_q": -1, "M_q": -1, "K_p": -1}


@pytest.fixture(scope="module")
def found():
    return identify(read_campaign(BB2))


@pytest.fixture(scope="module")
def database(found, tmp_path_factory):
    header = found.campaign.header
    metadata = {
        "campaign": header.name,
        "facility": header.facility,
        "provenance": header.provenance,
        "frame": str(found.campaign.vehicle.frame.frame),
        "inputs": json.dumps(found.campaign.digests),
        "options": json.dumps({}),
        "unused": json.dumps([astuple(one) for one in found.unused]),
        "warnings": json.dumps([astuple(one) for one in found.warnings]),
        "quality": json.dumps({k: q.model_dump() for k, q in header.quality.items()}),
        "message": "",
    }
    path = str(tmp_path_factory.mktemp("report") / "db")
    commit(path, database_rows(found), metadata)
    return path


@pytest.fixture(scope="module")
def coefficients(database):
    return Coefficients(load_vehicle("bb2"), read_rows(database, vehicle="bb2")[0])


@pytest.fixture(scope="module")
def path(database, tmp_path_factory):
    return Path(write_report(database, None, tmp_path_factory.mktemp("pages") / "new", "bb2").file)


@pytest.fixture(scope="module")
def page(path):
    return path.read_text("utf-8")


def test_one_self_contained_file(path, page):
    assert path.name == "bb2_v0.html"
    assert list(path.parent.iterdir()) == [path]
    addresses = re.findall(r"""(?:src|href)\s*=\s*["']([^"']*)""", page)
    assert addresses
    assert all(a.startswith(("#", "data:image/")) for a in addresses)
    assert not re.search(r"<script\s|<link|@import|url\(|fetch\(|XMLHttp", page)
    anchors = {a[1:] for a in addresses if a.startswith("#")}
    assert anchors <= set(re.findall(r'id="([^"]+)"', page))
    assert path.stat().st_size < 8e6


def test_page_states_origin(database, found, page):
    assert versions(database)[0].digest in page
    for name, digest in found.campaign.digests.items():
        assert name in page
        assert digest in page
    text = html.unescape(page)
    for one in found.unused:
        assert one.file in text
        assert one.reason in text
    assert sum(int(n) for n in re.findall(r'<td class="num">(\d+)</td><td>\w+\.csv', page)) == len(found.unused)


def test_page_names_every_term(coefficients, page):
    absent = {t.name for t, _ in coefficients.absent()}
    marked = re.findall(r'<tr class="absent"><th scope="row" class="sym">([^<]+)<', page)
    assert sorted(marked) == sorted(absent)
    listed = re.findall(r'<tr><th scope="row"><a class="sym" href="#[^"]+">([^<]+)</a></th><td>', page)
    assert {t.name for t in vehicle_terms(coefficients.vehicle)} - absent <= set(listed)
    assert "No run combines alpha and beta" in page


def test_every_value_is_drawn_once_an_axis(database, coefficients):
    rows, _ = read_rows(database, vehicle="bb2")
    figures = _group(vehicle_terms(coefficients.vehicle), rows)
    drawn = pd.concat([p.rows for panels in figures.values() for p in panels])
    assert set(drawn.index) == set(rows.index)
    for (_, _, x), panels in figures.items():
        own = pd.concat([p.rows for p in panels])
        assert own.index.is_unique, f"a value stands twice in the figure against {x}"


def test_sign_table_agrees_with_the_frame():
    assert {c.symbol: c.expected for c in checks()} == SIGNS
    suboff = {c.symbol: c.suboff for c in checks()}
    assert all(value is None or value * SIGNS[symbol] > 0 for symbol, value in suboff.items())
    assert suboff["Y_v"] == pytest.approx(-0.0278, abs=5e-5)
    assert suboff["M_q"] == pytest.approx(-0.0037, abs=5e-5)


@pytest.mark.parametrize("speed", [SPEED, 1.54333])
@pytest.mark.parametrize("depth", [DEPTH, 2.5])
def test_bb2_derivatives_have_the_signs_of_a_submarine(coefficients, speed, depth):
    for d in derivatives(coefficients, Environment(1025.0, 9.81), speed, depth):
        assert d.whole * SIGNS[d.symbol] > 0, d
        assert d.ok


def test_prime_derivatives_do_not_depend_on_water_or_propeller(coefficients):
    one = derivatives(coefficients, Environment(1.0, 0.0), SPEED, DEPTH)
    other = derivatives(coefficients, Environment(1025.0, 9.81), SPEED, DEPTH, revolutions=1.2)
    assert [d.whole for d in one] == pytest.approx([d.whole for d in other], rel=1e-9)


def test_planes_damp(coefficients):
    """A plane that moves the way it lifts loses lift: stern planes damp and stabilise."""
    planes = {d.symbol: d.whole - d.hull for d in derivatives(coefficients, Environment(1.0, 0.0), SPEED, DEPTH)}
    assert all(planes[s] < 0 for s in ("Y_v", "Z_w", "K_p", "M_q", "N_r"))
    assert planes["N_v"] > 0


def _rows(entries):
    base = {"vehicle": "bb2", "part": "hull", "output": "", "depth_m": DEPTH, "quality": "as_published"}
    base |= {"stderr": 0.0, "n_runs": 1, "origin": "measured", "estimate": 0, "worst_residual": 0.0, "runs": "a"}
    return pd.DataFrame([base | e for e in entries]).reindex(columns=column_order())


def test_derivatives_of_constant_coefficients():
    """Y_ur and N_uvw = c beta give their own derivatives; p|p| its secant over 0.2 U/L."""
    angle = math.radians(12.0)
    drift = [
        {"coefficient": "N_uvw", "value": -0.02 * b, "speed_mps": SPEED, "alpha_deg": 0.0, "beta_deg": math.degrees(b)}
        for b in (-angle, 0.0, angle)
    ]
    turn = {"coefficient": "Y_ur", "value": 0.005, "ur_mps2": 0.01}
    roll = {"coefficient": "K_p|p|", "value": -1e-4, "p_radps": 0.01}
    made = Coefficients(load_vehicle("bb2"), _rows([*drift, turn, roll]))
    found = {d.symbol: d for d in derivatives(made, Environment(1025.0, 9.81), SPEED, DEPTH)}
    step = math.radians(1.0)
    expected = {"N_v": -0.02 * step / math.sin(step), "Y_r": 0.005, "K_p": -1e-4 * 0.2}
    for symbol, d in found.items():
        assert d.hull == pytest.approx(expected.get(symbol, 0.0), rel=1e-9, abs=1e-15)
        assert d.whole == d.hull
        assert d.ok == (symbol in expected)


def test_derivatives_refuse_a_boat_at_rest(coefficients):
    with pytest.raises(ValueError, match="positive"):
        derivatives(coefficients, Environment(1.0, 0.0), 0.0, DEPTH)


def test_page_of_a_sparse_commit_without_metadata(tmp_path, database):
    rows, _ = read_rows(database, vehicle="bb2")
    db = str(tmp_path / "db")
    commit(db, rows[rows["coefficient"].isin(["KT", "X_uvw", "w_T"])], {})
    page = Path(write_report(db, 0, tmp_path, "bb2").file).read_text("utf-8")
    assert "FAIL: wrong sign" in page
    assert page.count('class="absent"') == len(vehicle_terms(load_vehicle("bb2"))) - 3
    assert "does not name its input files" in page


def test_wrong_requests_are_refused(tmp_path, database):
    with pytest.raises(InputError, match="version 7"):
        write_report(database, 7, tmp_path, "bb2")
    with pytest.raises(InputError):
        write_report(database, None, tmp_path, vehicle="nobody")


def test_page_that_cannot_be_written(tmp_path, database):
    rows, _ = read_rows(database, vehicle="bb2")
    db = str(tmp_path / "db")
    commit(db, rows[rows["coefficient"] == "KT"], {})
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_report(db, None, tmp_path / "file", "bb2")


def test_quality_colours_tell_words_apart():
    words = [f"word{i}" for i in range(12)]
    assert len(set(quality_colours(words).values())) == len(words)
