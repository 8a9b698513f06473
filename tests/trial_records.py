"""An exact zigzag and turning circle of a simulated boat, and records of them as trial teams write them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
DATA = Path(__file__).parent / "data" / "trials"
SCALE = 18.348


def truth() -> dict[str, dict[str, float]]:
    """Metrics of the exact flights, by file stem and the names of ``ident trial``."""
    known = json.loads((DATA / "truth.json").read_text())
    zigzag, turn = known["zigzag"], known["turning_circle"]
    times = {f"execute_{k}_s": zigzag["execute_s"][k - 1] for k in (2, 3, 4)}
    overshoots = {f"overshoot_{k}_deg": zigzag["overshoot_deg"][k - 1] for k in (1, 2, 3)}
    distances = {k: v for k, v in turn.items() if k.endswith("_m")}
    turned = {f"time_{a}_heading_s": turn[f"time_{a}_s"] for a in (90, 180)}
    return {"zigzag": times | overshoots, "turn": distances | turned}


def zigzag() -> dict[str, Array]:
    """t, psi, r, u, x, y, dH of the exact zigzag: s, deg, deg/s, m/s, m."""
    rows = np.loadtxt(DATA / "zz_clean.csv", delimiter=",", skiprows=1)
    return dict(zip(("t", "psi", "r", "u", "x", "y", "dH"), rows.T, strict=True))


def turn() -> dict[str, Array]:
    """t, x, y, psi, speed of the exact turning circle: s, m, deg, m/s."""
    rows = np.loadtxt(DATA / "tc_clean.csv", delimiter=",", skiprows=1)
    return dict(zip(("t", "x", "y", "psi", "speed"), rows.T, strict=True))


def write(path: Path, columns: dict[str, Array], digits: int = 5) -> Path:
    """A wide CSV of some columns."""
    lines = [",".join(columns)]
    lines += [",".join(f"{v:.{digits}f}" for v in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def turned(x: Array, y: Array, heading_deg: float, place: tuple[float, float]) -> tuple[Array, Array]:
    """A track turned to a course and moved to a place, north and east."""
    c, s = np.cos(np.radians(heading_deg)), np.sin(np.radians(heading_deg))
    return place[0] + c * x - s * y, place[1] + s * x + c * y


def approach(columns: dict[str, Array], seconds: float) -> dict[str, Array]:
    """The zigzag with a straight approach before it: heading 0, rudder amidships."""
    step = columns["t"][1] - columns["t"][0]
    count = round(seconds / step)
    before = {k: np.full(count, float(v[0]) if k in ("u",) else 0.0) for k, v in columns.items()}
    speed = float(columns["u"][0])
    before["t"] = step * np.arange(count)
    before["x"] = speed * before["t"]
    after = columns | {"t": columns["t"] + seconds, "x": columns["x"] + speed * seconds}
    return {k: np.concatenate([before[k], after[k]]) for k in columns}
