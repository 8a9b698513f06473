"""The scoreboard against single validations of each version, and geometric means by hand."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from ident.captive.campaign import read_campaign
from ident.database.store import commit, database_rows
from ident.identification.identify import identify
from ident.validation.board import geometric_mean
from ident.validation.scoreboard import is_trained, scoreboard
from ident.validation.scoreboard_tables import show
from ident.validation.validate import validate

ROOT = Path(__file__).parents[1]
CASES = ["roll-decay", "vzz10-10kt", "vzz10-06kt", "meander", "suboff-hzz10"]


@pytest.fixture(scope="module")
def database(rows, tmp_path_factory):
    """Version 0 captive, 1 another vehicle's, 2 trained with the captive one as its parent."""
    path = str(tmp_path_factory.mktemp("board") / "coeff_db")
    commit(path, rows, {})
    commit(path, _suboff(), {})
    moved = rows.assign(value=rows["value"].where(rows["coefficient"] != "M_uq", 1.2 * rows["value"]))
    commit(path, moved, {"parent": "0", "trained": json.dumps(["vzz10-10kt:CFD"])})
    return path


def _suboff():
    return database_rows(identify(read_campaign(ROOT / "raw_captive_data" / "suboff")))


@pytest.fixture(scope="module")
def board(database):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("ident.validation.scoreboard.case_names", lambda folder: CASES)
        return scoreboard(database, workers=2)


@pytest.fixture(scope="module")
def printed(board):
    """What a program reads of the board."""
    return board.to_dict()


def _entries(board):
    for case in board["cases"]:
        for source, channels in case["references"].items():
            for channel, entry in channels.items():
                yield case, source, channel, entry


def test_every_error_is_that_of_a_single_run_of_its_version(database, printed):
    own = {name: [validate(name, database, v).to_dict()["references"] for v in (2, 0)] for name in CASES[:3]}
    seen = 0
    for case, source, channel, entry in _entries(printed):
        this, parent = (one[source][channel] for one in own[case["case"]])
        assert entry["rmse"] == this["rmse"]
        assert entry["published_model_rmse"] == this["published_model_rmse"]
        assert entry["parent_rmse"] == parent["rmse"]
        assert entry["ratio"] == pytest.approx(this["rmse"] / this["published_model_rmse"], rel=1e-12)
        assert entry["ratio_to_parent"] == pytest.approx(this["rmse"] / parent["rmse"], rel=1e-12)
        seen += 1
    assert seen == sum(len(c) for pair in own.values() for c in pair[0].values())


def test_means_are_of_trained_and_untrained_cases(printed):
    trained = {case["case"]: case["trained"] for case in printed["cases"]}
    assert trained == {name: name == "vzz10-10kt" for name in CASES}
    for key, name in (("geometric_mean_ratio", "ratio"), ("geometric_mean_ratio_to_parent", "ratio_to_parent")):
        for kind in ("trained", "untrained"):
            ratios = [e[name] for case, *_, e in _entries(printed) if case["trained"] == (kind == "trained")]
            assert printed[key][kind] == pytest.approx(np.prod(ratios) ** (1.0 / len(ratios)), rel=1e-9)
    assert printed["worst_ratio"]["ratio"] == max(e["ratio"] for *_, e in _entries(printed))


def test_parent_is_the_vehicles_own_earlier_version(printed):
    """SUBOFF's version comes after BB2's, which is no parent of it."""
    parents = {case["case"]: case["parent"] for case in printed["cases"]}
    assert parents["suboff-hzz10"] is None
    assert {parents[name]["version"] for name in CASES[:4]} == {0}
    versions = {case["case"]: case["database"]["version"] for case in printed["cases"]}
    assert versions == dict.fromkeys(CASES[:4], 2) | {"suboff-hzz10": 1}
    assert printed["trained_on"] == {"bb2": ["vzz10-10kt:CFD"], "suboff": []}


def test_first_version_has_no_parent(database):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("ident.validation.scoreboard.case_names", lambda folder: CASES[:1])
        first = scoreboard(database, 0).to_dict()
    entry = first["cases"][0]["references"]["EXP"]["phi"]
    assert (first["cases"][0]["parent"], entry["parent_rmse"], entry["ratio_to_parent"]) == (None, None, None)
    assert first["geometric_mean_ratio_to_parent"] == {"trained": None, "untrained": None}


def test_board_does_not_depend_on_workers(database, printed):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("ident.validation.scoreboard.case_names", lambda folder: CASES)
        alone = scoreboard(database, workers=1).to_dict()
    assert json.dumps(alone) == json.dumps(printed)


def test_print_names_worst_case_and_cases_without_reference(board):
    console = Console(record=True, width=200, file=io.StringIO())
    show(board, console)
    text = console.export_text()
    at = board.worst_ratio
    assert f"worst ratio: {at.ratio:.2f} ({at.case} {at.source} {at.channel})" in text
    below = text[text.index("Without a reference series") :]
    assert "meander" in below
    assert "bb2 trained on: vzz10-10kt:CFD" in below


@pytest.mark.parametrize(
    ("case", "trained", "expected"),
    [
        ("hzz20", ["hzz20"], True),
        ("hzz20", ["hzz20:EXP"], True),
        ("hzz20", ["hzz20-other", "hzz2"], False),
        ("hzz2", ["hzz20:EXP"], False),
        ("hzz20", [], False),
    ],
)
def test_trained_by_case_or_by_source(case, trained, expected):
    assert is_trained(case, trained) is expected


def test_geometric_mean_closed_form():
    assert geometric_mean([2.0, 8.0]) == pytest.approx(4.0)
    assert geometric_mean([]) is None
