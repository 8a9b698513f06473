"""The bundled BB2 campaign written in another form, and whether its rows are the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from ident.captive.campaign import read_campaign
from ident.database.store import database_rows
from ident.identification.identify import identify

BB2 = Path(__file__).parents[1] / "raw_captive_data" / "bb2"
AXES = ("speed_mps", "alpha_deg", "beta_deg", "delta_deg", "depth_m", "p_radps", "q_radps", "r_radps")


def number(column: pd.Series) -> pd.Series:
    return pd.to_numeric(column.where(column != ""))


def text(values: pd.Series) -> pd.Series:
    return values.map(lambda x: "" if pd.isna(x) else repr(float(x)))


def rewritten(folder: Path, tables: dict[str, pd.DataFrame], header: str) -> pd.DataFrame:
    """Database rows of the campaign written into a folder."""
    folder.mkdir(exist_ok=True)
    (folder / "campaign.toml").write_text(header, "utf-8")
    for name, table in tables.items():
        table.to_csv(folder / name, index=False)
    return database_rows(identify(read_campaign(folder)))


def header() -> str:
    return (BB2 / "campaign.toml").read_text("utf-8")


def assert_same(got: pd.DataFrame, rows: pd.DataFrame, tolerance: float) -> None:
    """The same rows; values and errors within ``tolerance`` of the coefficient's largest."""
    assert len(got) == len(rows)
    for column in ("coefficient", "part", "origin", "runs", "n_runs", "quality"):
        assert got[column].tolist() == rows[column].tolist(), column
    for column in AXES:
        np.testing.assert_allclose(got[column], rows[column], rtol=1e-9, atol=1e-12)
    key = [rows["coefficient"], rows["part"]]
    for column in ("value", "stderr"):
        largest = rows[column].abs().groupby(key).transform("max")
        off = (got[column] - rows[column]).abs() / largest.where(largest > 0, 1.0)
        assert off.max() < tolerance, rows.loc[off.idxmax(), ["coefficient", "part", "value", "runs"]].to_dict()
