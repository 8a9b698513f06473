"""Made campaigns that declare something, and what they lead to."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from toml_text import toml

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign
from ident.database.store import database_rows
from ident.estimates.predict import predicted
from ident.fitting.fit import given_of, metadata
from ident.identification.identify import identify
from sim.files.errors import InputError

HEAD: dict[str, Any] = {
    "name": "made",
    "vehicle": "bb2",
    "facility": "tank",
    "provenance": "made up",
    "frame": {"x": "forward", "y": "starboard", "z": "down", "angles": "flight"},
    "moment_point": {"x_m": 0.0, "y_m": 0.0, "z_m": 0.0, "about": "origin"},
    "scale": {"ratio": 1.0, "length_m": 70.2},
    "fluid": {"density_kgpm3": 1025.0, "source": "made up"},
    "inertia": {"model_inertia_in_loads": False},
    "uncertainty": {"floor": 0.1, "source": "made up"},
    "quality": {"ok": {"factor": 1.0, "meaning": "as measured"}, "poor": {"factor": 2.0, "meaning": "less"}},
}
DRIFT: dict[str, Any] = {
    "files": "drift.csv",
    "constants": {"test": "drift_horizontal", "part": "hull", "quality": "ok", "source": "s", "alpha": "0 deg"},
}
LOADS = "X_N,Y_N,Z_N,K_Nm,M_Nm,N_Nm"
ROWS = f"""run_id,U_mps,beta_deg,D0_m,rel_sigma,{LOADS}
a,5,0,25,0.05,-68000,0,-13000,0,-17000,0
b,5,4,25,0.05,-74000,-336000,-15000,-120000,-18000,-2260000
c,5,8,25,0.05,-40000,-629000,-30000,-240000,-19000,-4500000
"""
TIME = np.arange(0.0, 80.0, 0.1)
OMEGA = 2.0 * np.pi * 0.25


def sway(lag: float = 0.0, extra: str = "", start: float = 0.0) -> str:
    """A made sway history: Y of velocity and acceleration, a moment, a displacement on request."""
    time = TIME + start
    noise = np.random.default_rng(1).standard_normal((time.size, 3))
    late = time - lag
    y = -3e5 * np.cos(OMEGA * late) + 9e5 * np.sin(OMEGA * late)
    n = -2e6 * np.cos(OMEGA * late) + 1e5 * np.sin(OMEGA * late)
    table = pd.DataFrame({"time_s": time, "X_N": -4e4 + 10 * noise[:, 0], "Y_N": y + 10 * noise[:, 1]})
    table["N_Nm"] = n + 100 * noise[:, 2]
    if extra == "displacement":
        table["displacement_m"] = 0.3 * np.sin(OMEGA * time)
    return table.to_csv(index=False)


def made(folder: Path, head: dict[str, Any], files: dict[str, str]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "campaign.toml").write_text(toml(head), "utf-8")
    for name, text in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, "utf-8")
    return folder


def outcome(folder: Path, head: dict[str, Any], files: dict[str, str], estimated: bool = True) -> dict[str, Any]:
    """What a campaign leads to: coefficients with their errors, findings, what the version says; or a refusal."""
    made(folder, head, files)
    try:
        campaign = read_campaign(folder)
        found = identify(campaign)
        rows, estimates = database_rows(found), []
        if estimated:
            rows, estimates = predicted(campaign.vehicle, rows, given_of(campaign))
        findings = [f.as_json() for f in check_campaign(campaign, folder)]
        own = metadata(campaign, found, "", [], estimates)
    except InputError as error:
        return {"refused": str(error)}
    # The digest of campaign.toml changes with every key, and what estimates were given counts where they use it.
    own = {k: v for k, v in own.items() if k not in ("inputs", "given")}
    noted = [found.unused, found.warnings, found.covariance.round(15).tolist()]
    return {"rows": rows.round(12).to_csv(), "noted": noted, "findings": findings, "words": own}


_KNOWN: dict[str, dict[str, Any]] = {}


def _known(folder: Path, head: dict[str, Any], files: dict[str, str], estimated: bool) -> dict[str, Any]:
    """``outcome`` of what many keys are held against, worked out once."""
    key = json.dumps([head, files, estimated], sort_keys=True, default=str)
    if key not in _KNOWN:
        _KNOWN[key] = outcome(folder, head, files, estimated)
    return _KNOWN[key]


def campaign(changed: dict[str, Any] | None = None, **source_keys: Any) -> dict[str, Any]:
    own = json.loads(json.dumps({**HEAD, "source": [{**DRIFT, **source_keys}]}))
    for path, value in (changed or {}).items():
        own = set_at(own, path, value)
    return own


def differs(tmp_path, before, after, files=None, other=None, words=False, named="", elsewhere="") -> None:
    """The two campaigns lead to other coefficients or findings; of words, to another version's words; or the second
    is refused, in a message that names the key, or ``elsewhere`` where another statement is what it contradicts."""
    files = files or {"drift.csv": ROWS}
    parts = ("words",) if words else ("rows", "noted", "findings")
    # Estimates take most of the time, and few keys change nothing but them.
    for estimated in (False, True):
        one = _known(tmp_path / "one", before, files, estimated)
        two = outcome(tmp_path / "two", after, other or files, estimated)
        assert "refused" not in one, one
        if "refused" in two:
            key = elsewhere or named.rpartition(".")[2]
            assert key in two["refused"], two["refused"]
            return
        if any(one[k] != two[k] for k in parts):
            return
    raise AssertionError("declared, and nothing changed")


def set_at(own: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    at: Any = own
    value = json.loads(json.dumps(value))
    *parents, last = path.split(".")
    for key in parents:
        at = at[int(key)] if key.isdigit() else at.setdefault(key, {})
    at[last] = value
    return own


def primes(rows: str) -> str:
    return rows.replace(LOADS, "X',Y',Z',K',M',N'").replace("000", "")


def of(own: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {**HEAD, "source": [{**own, **more}]}


def reduced(own: dict[str, Any], **more: Any) -> dict[str, Any]:
    return of(own, reduction={**own["reduction"], **more})
