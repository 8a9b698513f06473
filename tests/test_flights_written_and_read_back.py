"""Authority: the flight itself. What is written is what was flown, to the last digit, in every format."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import xarray as xr
from click.testing import CliRunner
from flights_in_waves import made_flight

import ident
from ident.cli import main
from ident.exports.history import history_of, sampled, samples_dataset, write_history
from ident.validation.bands import Bands
from ident.validation.figures import _draw
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.flight.simulate import simulate
from sim.waves.linear import regular

ATTRIBUTES = {"title": "a zigzag", "database_version": "3", "database_digest": "d" * 64}


@pytest.fixture(scope="module")
def short(coefficients):
    """Twenty seconds of hzz20."""
    case = load_case("hzz20")[0]
    case = case.model_copy(update={"run": case.run.model_copy(update={"duration_s": 20.0})})
    return simulate(case, coefficients)


@pytest.fixture(scope="module")
def history(short, coefficients):
    return history_of(short, coefficients.vehicle, ATTRIBUTES)


def _read(path):
    if path.suffix == ".nc":
        data = xr.load_dataset(path, engine="scipy")
        return {str(n): data[n].to_numpy() for n in data.variables}, dict(data.attrs)
    if path.suffix == ".parquet":
        table = pq.read_table(path)
        texts = {k.decode(): v.decode() for k, v in table.schema.metadata.items()}
        return {n: table[n].to_numpy() for n in table.column_names}, texts
    lines = [line[2:].split(": ", 1) for line in path.read_text("utf-8").splitlines() if line.startswith("# ")]
    table = pd.read_csv(path, comment="#", float_precision="round_trip")
    return {n: table[n].to_numpy() for n in table}, {k: v.strip() for k, v in lines}


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".nc"])
def test_every_series_comes_back_to_the_last_digit(history, short, tmp_path, ending):
    values, texts = _read(write_history(history, tmp_path / f"flight{ending}"))
    for name, series in history.values.items():
        stored = ("time" if name == "t" else name) if ending == ".nc" else history.column(name)
        np.testing.assert_array_equal(values[stored], series, err_msg=name)
    assert {k: texts[k] for k in ATTRIBUTES} == ATTRIBUTES
    np.testing.assert_array_equal(history.values["psi"], short["psi"])
    assert {"stern_plane_1", "dH", "n", "alpha", "beta", "D0", "sail_top_submergence"} <= set(history.values)


def test_flow_angles_and_submergence_are_the_closed_forms(history):
    v = history.values
    speed = np.sqrt(v["u"] ** 2 + v["v"] ** 2 + v["w"] ** 2)
    np.testing.assert_allclose(np.sin(v["beta"]) * speed, v["v"], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.tan(v["alpha"]) * v["u"], v["w"], rtol=1e-12, atol=1e-12)
    a, b, c = load_vehicle("bb2").particulars.sail_top.value
    depth = v["z"] - np.sin(v["theta"]) * a + np.cos(v["theta"]) * (np.sin(v["phi"]) * b + np.cos(v["phi"]) * c)
    np.testing.assert_allclose(v["sail_top_submergence"], depth, rtol=0, atol=1e-12)


def test_the_surface_over_a_boat_at_rest_is_the_wave(coefficients):
    """A wave A cos(kx - wt) over an upright boat at x = 0 adds its elevation over the sail to the depth."""
    waves = regular(3.25, 140.9, 0.0, 1025.0, 9.81)
    time = np.arange(0.0, 20.0, 0.5)
    flight = made_flight(time, z=0.0 * time + 20.0)
    written = history_of(replace(flight, waves=waves), coefficients.vehicle, {}).values
    number, frequency = waves.number[0], waves.frequency[0]
    np.testing.assert_allclose(written["elevation"], 1.625 * np.cos(-frequency * time + waves.phase[0]), atol=1e-12)
    a, _, c = coefficients.vehicle.particulars.sail_top.value
    top = 1.625 * np.cos(number * a - frequency * time + waves.phase[0])
    np.testing.assert_allclose(written["sail_top_submergence"] - 20.0 - c, top, atol=1e-9)


def test_records_as_often_as_asked_and_no_oftener_than_the_step():
    case = load_case("hzz20")[0]
    assert sampled(case, 0.5).run.record_s == 0.5
    assert sampled(case, None) is case
    for wrong in (0.03, 0.01, 1e9):
        with pytest.raises(InputError, match="multiple of the step"):
            sampled(case, wrong)


def test_quantiles_of_samples_are_the_order_statistics():
    values = np.arange(5.0)[:, None] * np.ones(3)
    bands = Bands(np.arange(3.0), {"psi": values}, {}, np.zeros((5, 2)), np.eye(2), ["a", "b"], 0, 7)
    every = samples_dataset(bands, ATTRIBUTES)
    assert every["psi"].dims == ("sample", "time")
    assert every.attrs["seed"] == "7"
    some = samples_dataset(bands, ATTRIBUTES, (0.0, 0.5, 1.0))
    assert some["psi"].sel(quantile=0.5).to_numpy().tolist() == [2.0, 2.0, 2.0]
    assert some["psi"].attrs["units"] == "rad"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--out", "flight.xls"], ".csv, .parquet, .nc"),
        (["--samples", "4", "--out", "flight.csv"], "a .nc file"),
        (["--every", "0.03", "--out", "flight.csv"], "multiple of the step"),
    ],
)
def test_what_cannot_be_written_is_refused_and_leaves_nothing(fitted_db, tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["fly", "--case", "hzz20", "--db", fitted_db, *arguments])
    assert done.exit_code == 2, done.output
    assert said in done.output
    assert not list(tmp_path.iterdir())


def test_loads_beside_the_motion_balance_as_the_table_of_loads(fitted_db, tmp_path):
    path = tmp_path / "roll.nc"
    asked = ["fly", "--case", "roll-decay", "--db", fitted_db, "--loads", "part", "--out", str(path)]
    done = CliRunner().invoke(main, asked)
    assert done.exit_code == 0, done.output
    data = xr.load_dataset(path, engine="scipy")
    parts = [str(n) for n in data.variables if str(n).startswith("K_")]
    assert {"K_hull", "K_weight_and_buoyancy", "K_added_mass"} <= set(parts)
    assert data["K_hull"].attrs["units"] == "N m"
    size = float(np.abs(data["K_weight_and_buoyancy"]).max())
    assert np.abs(sum(data[n] for n in parts))[5:-5].max() < 0.02 * size


def test_every_series_of_a_figure_can_be_drawn_again_from_the_histories(fitted_db, tmp_path):
    """Each line of the figure of a zigzag that is of the boat stands in its history, to the last digit."""
    out = tmp_path / "out"
    asked = ["validate", "--case", "vzz10-10kt", "--db", fitted_db, "--out", str(out), "--history", "--samples", "2"]
    done = CliRunner().invoke(main, asked)
    assert done.exit_code == 0, done.output
    case, version = load_case("vzz10-10kt")[0], next(out.glob("*_samples.nc")).name.split("_v")[1].split("_")[0]
    own = sorted(p.stem.split(f"_v{version}_")[1] for p in out.glob(f"*_v{version}_*.csv"))
    assert own == sorted(s for s in case.reference.compare if case.started_as(s))
    flown = ident.validate("vzz10-10kt", fitted_db)
    figure, _ = _draw(flown, None)
    lines = [
        line for axis in figure.axes for line in axis.get_lines() if len(line.get_xdata()) == len(flown.simulation["t"])
    ]
    table = pd.read_csv(out / f"vzz10-10kt_v{version}.csv", comment="#", float_precision="round_trip")
    written = [table[c].to_numpy() for c in table] + [
        np.degrees(table[c]) for c in table if c.endswith(("_rad", "_radps"))
    ]
    for line in lines:
        x, y = line.get_data()
        assert any(np.array_equal(x, one) for one in written)
        if not str(line.get_label()).startswith("simulated as"):
            assert any(np.allclose(y, one, rtol=1e-15, atol=1e-15) for one in written), line.get_label()
    assert len(lines) > 5
    samples = xr.load_dataset(next(out.glob("*_samples.nc")), engine="scipy")
    assert samples.sizes["sample"] == 2


def test_the_command_writes_the_flight_and_says_what_it_wrote(fitted_db, tmp_path):
    path = tmp_path / "roll.csv"
    done = CliRunner().invoke(
        main, ["fly", "--case", "roll-decay", "--db", fitted_db, "--out", str(path), "--json", "-"]
    )
    assert done.exit_code == 0, done.output
    written = json.loads(done.stdout)
    table = pd.read_csv(path, comment="#")
    assert written["records"] == len(table)
    assert table["phi_rad"].iloc[0] == pytest.approx(np.radians(load_case("roll-decay")[0].initial.heel_deg))
