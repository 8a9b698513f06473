"""The bundled BB2 campaign written in another form, and whether its rows are the same."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd

from ident.captive.campaign import read_campaign
from ident.database.store import database_rows
from ident.identification.identify import identify

BB2 = Path(__file__).parents[1] / "raw_captive_data" / "bb2"
AXES = ("speed_mps", "alpha_deg", "beta_deg", "delta_deg", "depth_m", "p_radps", "q_radps", "r_radps")
# Vector columns by axis, polar and axial.
VECTORS = {
    "x": (["X_N", "udot_mps2", "x_m"], ["K_Nm", "p_radps", "pdot_radps2"]),
    "y": (["Y_N", "vdot_mps2", "y_m"], ["M_Nm", "q_radps", "qdot_radps2"]),
    "z": (["Z_N", "wdot_mps2", "z_m"], ["N_Nm", "r_radps", "rdot_radps2"]),
}


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


def turned(tables, signs: dict[str, int], hand: int):
    """Every vector turned by hand from the source frame (x aft, y starboard, z up)."""
    other = {}
    for name, table in tables.items():
        other[name] = table.copy()
        for axis, (vectors, rotations) in VECTORS.items():
            for columns, sign in ((vectors, signs[axis]), (rotations, signs[axis] * hand)):
                for column in [c for c in columns if c in table]:
                    other[name][column] = text(sign * number(table[column]))
    return other


def scaled(tables, ratio: float):
    powers = {"U_mps": -0.5, "n_rps": 0.5} | dict.fromkeys(("D0_m", "R0_m", "x_m", "y_m", "z_m"), -1)
    powers |= {f"{rate}_radps": 0.5 for rate in "pqr"} | {f"{rate}dot_radps2": 1 for rate in "pqr"}
    powers |= {f"{o}_N": -3 for o in "XYZ"} | {f"{o}_Nm": -4 for o in "KMN"}
    other = {}
    for name, table in tables.items():
        other[name] = table.copy()
        for column in [c for c in powers if c in table]:
            other[name][column] = text(number(table[column]) * ratio ** powers[column])
    return other


def moved(tables, point: tuple[float, float, float], hand: int):
    """Moments about another point; in a frame of the left hand N = x Y - y X all the same."""
    x, y, z = point
    other = {}
    for name, table in tables.items():
        table = table.copy()
        moments = [f"{m}_Nm" for m in "KMN" if f"{m}_Nm" in table]
        given = (table[moments] != "").any(axis=1)
        for force in "XYZ" if moments else ():
            column = table.get(f"{force}_N", pd.Series("", index=table.index))
            table[f"{force}_N"] = column.mask((column == "") & given, "0")
        if moments:
            fx, fy, fz = (number(table[f"{o}_N"]) for o in "XYZ")
            for moment, arm in (("K", y * fz - z * fy), ("M", z * fx - x * fz), ("N", x * fy - y * fx)):
                if f"{moment}_Nm" in table:
                    table[f"{moment}_Nm"] = text(number(table[f"{moment}_Nm"]) - hand * arm)
        other[name] = table
    return other


def in_units(tables):
    """Feet, pounds and knots in brackets, angles in radians."""
    pound, foot = 4.4482216152605, 0.3048
    units = {f"{o}_N": (f"{o} [lbf]", pound) for o in "XYZ"} | {
        f"{o}_Nm": (f"{o} [lbf*ft]", pound * foot) for o in "KMN"
    }
    units |= {f"{c}_m": (f"{c} (ft)", foot) for c in ("D0", "R0", "x", "y", "z")}
    units |= {f"{r}_radps": (f"{r} [deg/s]", math.radians(1)) for r in "pqr"}
    units |= {
        "U_mps": ("U [ft/s]", foot),
        "n_rps": ("n [1/min]", 1 / 60),
        "alpha_deg": ("alpha [rad]", math.degrees(1)),
    }
    other = {}
    for name, table in tables.items():
        table = table.copy()
        for column in [c for c in units if c in table]:
            table[column] = text(number(table[column]) / units[column][1])
        other[name] = table.rename(columns={c: u[0] for c, u in units.items()})
    return other


def frame_text(x: str, y: str, z: str, rotations: str, angles: str = "flight") -> str:
    found = header().replace('x = "aft"', f'x = "{x}"').replace('z = "up"', f'z = "{z}"')
    found = found.replace('y = "starboard"', f'y = "{y}"\nrotations = "{rotations}"')
    return found.replace('angles = "flight"', f'angles = "{angles}"')
