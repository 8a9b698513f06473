"""What the pages show in Python runs as it stands there: how-to, the README, the plant model, the right-hand side."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import matplotlib
import numpy as np
import pytest

import ident

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """What the page on six things makes first; its database of BB2 is the one of the other pages too."""
    matplotlib.use("Agg")
    folder = tmp_path_factory.mktemp("pages")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        shutil.copytree(ROOT / "raw_captive_data" / "bb2", "raw_captive_data/bb2")
        exec(compile(_blocks("docs/how-to.md")[0], "docs/how-to.md", "exec"), {})
        shutil.copytree("bb2_db", "coeff_db")
        yield folder


def _blocks(name):
    return re.findall(r"```python\n(.*?)```", (ROOT / name).read_text("utf-8"), re.DOTALL)


def test_the_six_things_run_as_they_stand(desk):
    names: dict[str, object] = {"ident": ident}
    blocks = _blocks("docs/how-to.md")
    assert len(blocks) == 7
    for block in blocks[1:]:
        exec(compile(block.replace("with_bands(200)", "with_bands(4)"), "docs/how-to.md", "exec"), names)
    point = names["point"]
    assert point.runs.item()
    assert "drift_horizontal.csv row" in point.source.item()
    assert names["yaw"].dims == ("beta_deg",)
    assert names["done"].errors["EXP"]["psi"].rmse > 0.0
    assert names["own"].errors["TRIAL"]["psi"].rmse > 0.0
    assert names["variance"] < sum(names["drift"][name].stderr.item() ** 2 for name in ("N_v", "N_v|v|"))
    assert {"Y_cross", "N_cross"} <= {one.coefficient for one in names["change"] if one.added}
    assert list(names["db"].table["message"]) == ["runs alone", ""]


def test_the_readme_runs_as_it_stands(desk):
    (block,) = _blocks("README.md")
    names: dict[str, object] = {}
    latest = block.replace('[0]["N_uvw"]', '[-1]["N_uvw"]').replace("version=0", "version=1")
    exec(compile(latest, "README.md", "exec"), names)
    assert set(names["yaw"].dims) == {"speed_mps", "alpha_deg", "beta_deg", "depth_m"}
    assert "drift_horizontal.csv row" in str(names["yaw"].sel(beta_deg=8).source.values)


def test_the_plant_of_the_page_turns_to_its_heading(desk):
    (block,) = _blocks("docs/plant-model.md")
    names: dict[str, object] = {}
    exec(compile(block, "docs/plant-model.md", "exec"), names)
    assert np.degrees(names["boat"]["psi"]) == pytest.approx(30.0, abs=5.0)


def test_the_right_hand_side_of_the_page_stays_at_its_equilibrium(desk):
    (block,) = _blocks("docs/right-hand-side.md")
    names: dict[str, object] = {}
    exec(compile(block, "docs/right-hand-side.md", "exec"), names)
    flown, trim = names["flown"], names["trim"]
    assert flown.success
    np.testing.assert_allclose(flown.y[:6, -1], trim.state[:6], atol=1e-3)


def test_the_boat_in_other_tools_runs_as_the_page_has_it(desk):
    names: dict[str, object] = {}
    for block in _blocks("docs/other-tools.md"):
        exec(compile(block, "docs/other-tools.md", "exec"), names)
    assert names["observation"].shape == (10,)
    assert names["margin"] == pytest.approx(60.0, abs=1.0)
    assert np.degrees(names["boat"]["psi"]) == pytest.approx(20.0, abs=0.2)
    assert names["phase_margin"] > 60.0
