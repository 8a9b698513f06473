"""A case for every key of ``[[source]]``: what is changed, and what that is to change."""

from __future__ import annotations

import io
from typing import Any

import pandas as pd
from declared_campaigns import (
    DRIFT,
    HEAD,
    LOADS,
    ROWS,
    of,
    primes,
    reduced,
    sway,
)

SWAY: dict[str, Any] = {
    "files": "sway.csv",
    "rows": "history",
    "constants": {"part": "hull", "quality": "ok", "U": "5 m/s", "alpha": "0 deg", "beta": "0 deg", "D0": "25 m"},
    "reduction": {"kind": "oscillatory", "motion": "sway", "frequency_hz": 0.25, "amplitude": 0.3},
}
STEADY = {**SWAY, "constants": {**SWAY["constants"], "test": "drift_horizontal", "beta": "4 deg"}}
STEADY["reduction"] = {"kind": "steady"}
GRIDS = {"finest": "fine", "coarser": ["mid", "low"], "refinement": 1.4}
RATES = {k: v for k, v in SWAY["reduction"].items() if k != "amplitude"}


SEMI = ROWS.replace(",", ";")
PART = ROWS.replace(LOADS, LOADS + ",RX [N],RY [N]").replace("\na", "\na").replace("-17000,0\n", "-17000,0,5,50\n")
PART = PART.replace("-2260000\n", "-2260000,6,60\n").replace("-4500000\n", "-4500000,7,70\n")
TAKEN = {"what": "rudder", "source": "stock", "columns": {"RX": "X", "RY": "Y"}, "at_m": [-30.0, 0.0, 0.0]}
SOURCE_CASES: dict[str, tuple[dict[str, Any], dict[str, Any], dict[str, Any]]] = {
    "Source.files": (of(DRIFT), of(DRIFT, files="none.csv"), {}),
    "Source.reader": (of(DRIFT), of(DRIFT, reader="columns"), {}),
    "Source.rows": (of(DRIFT), of(DRIFT, rows="history"), {}),
    "Source.columns": (of(DRIFT), of(DRIFT, columns={"X_N": "Y [N]"}), {}),
    "Source.patterns": (of(DRIFT), of(DRIFT, patterns={"^X": "X"}), {}),
    "Source.ignore": (of(DRIFT), of(DRIFT, ignore=["X*"]), {}),
    "Source.table": (of(DRIFT), of(DRIFT, table="drift"), {}),
    "Source.names": (of(DRIFT), of(DRIFT, names=["a", "b"]), {}),
    "Source.header_pattern": (of(DRIFT), of(DRIFT, header_pattern="^a", delimiter=","), {}),
    "Source.widths": (of(DRIFT), of(DRIFT, widths=[3, 3]), {}),
    "Source.units_row": (of(DRIFT), of(DRIFT, units_row=True), {}),
    "Source.delimiter": (of(DRIFT), of(DRIFT, delimiter=";"), {}),
    "Source.decimal": (of(DRIFT), of(DRIFT, decimal=","), {}),
    "Source.thousands": (of(DRIFT), of(DRIFT, thousands="."), {}),
    "Source.encoding": (of(DRIFT), of(DRIFT, encoding="utf-16-le"), {}),
    "Source.skip": (of(DRIFT), of(DRIFT, skip="^b"), {}),
    "Source.constants": (of(DRIFT), of(DRIFT, constants={**DRIFT["constants"], "quality": "poor"}), {}),
    "Source.within": (of(DRIFT), of(DRIFT, within={"beta_deg": [-5.0, 5.0]}), {}),
    "Source.match": (of(DRIFT), of(DRIFT, match="(?P<reason>x)"), {}),
    "Source.normalisation": (of(DRIFT), of(DRIFT, normalisation="half_rho_L2"), {}),
    "Source.parts": (of(DRIFT), of(DRIFT, parts={"a": "hull"}), {}),
    "Source.rho_inf": (of(DRIFT), of(DRIFT, rho_inf=1.0), {}),
    "Source.vehicle_origin": (of(DRIFT), of(DRIFT, vehicle_origin=[1.0, 0.0, 0.0]), {}),
    "Source.cofr": (of(DRIFT), of(DRIFT, cofr=[1.0, 0.0, 0.0]), {}),
    "Source.axes": (of(DRIFT), of(DRIFT, axes="flow"), {}),
    "Source.moment_axes": (of(DRIFT, axes="flow"), of(DRIFT, axes="flow", moment_axes="body"), {}),
    "Source.moments_about": (of(SWAY), of(SWAY, moments_about="fixed"), {"files": {"sway.csv": sway()}}),
    "Source.factor": (of(DRIFT), of(DRIFT, factor={"Y": -1.0}), {}),
    "Source.missing": (of(DRIFT), of(DRIFT, missing=[-629000.0]), {}),
    "Source.words": (of(DRIFT), of(DRIFT, words={"rudder": "towing"}), {}),
    "Source.plus_minus": (
        of(DRIFT),
        of(DRIFT, plus_minus=1.96),
        {"files": {"drift.csv": ROWS.replace("-336000,", "-336000 \u00b1 5000,")}},
    ),
    "Source.marks": (
        of(DRIFT),
        of(DRIFT, marks={"*": "poor"}),
        {"files": {"drift.csv": ROWS.replace("-336000,", "-336000*,")}},
    ),
    "Source.reference": (of(DRIFT), of(DRIFT, reference={"area_m2": 1.0, "source": "x"}), {}),
    "Source.reduction": (of(DRIFT), of(DRIFT, reduction={"kind": "steady"}), {}),
    "Source.subtract": (of(DRIFT, ignore=["R*"]), of(DRIFT, subtract=[TAKEN]), {"files": {"drift.csv": PART}}),
    "Subtract.what": (
        of(DRIFT, subtract=[TAKEN]),
        of(DRIFT, subtract=[{**TAKEN, "what": "skeg"}]),
        {"files": {"drift.csv": PART}, "words": True},
    ),
    "Subtract.source": (
        of(DRIFT, subtract=[TAKEN]),
        of(DRIFT, subtract=[{**TAKEN, "source": "other"}]),
        {"files": {"drift.csv": PART}, "words": True},
    ),
    "Subtract.columns": (
        of(DRIFT, subtract=[TAKEN]),
        of(DRIFT, subtract=[{**TAKEN, "columns": {"RX": "Y", "RY": "X"}}]),
        {"files": {"drift.csv": PART}},
    ),
    "Subtract.at_m": (
        of(DRIFT, subtract=[TAKEN]),
        of(DRIFT, subtract=[{**TAKEN, "at_m": [-10.0, 0.0, 0.0]}]),
        {"files": {"drift.csv": PART}},
    ),
    "Subtract.factor": (
        of(DRIFT, subtract=[TAKEN]),
        of(DRIFT, subtract=[{**TAKEN, "factor": 20.0}]),
        {"files": {"drift.csv": PART}},
    ),
    "Source.grids": (
        of({**STEADY, "files": "fine/sway.csv"}),
        of(
            {**STEADY, "files": "fine/sway.csv"}, grids={"finest": "fine", "coarser": ["mid", "low"], "refinement": 1.4}
        ),
        {"files": {f"{grid}/sway.csv": sway(lag) for grid, lag in (("fine", 0.0), ("mid", 0.05), ("low", 0.15))}},
    ),
    # A run that was to be one of drift is none once its loads are a deduction.
    "Source.deduction": (
        of(STEADY),
        of(STEADY, deduction={"towed": "towed.csv", "thrust_n": 5e4, "source": "disc"}),
        {"files": {"sway.csv": sway(), "towed.csv": sway(0.1)}},
    ),
    # A file that is to come is waited for; without the key it is refused.
    "Source.awaited": (
        {**HEAD, "source": [DRIFT, {**DRIFT, "files": "late.csv", "awaited": True}]},
        {**HEAD, "source": [DRIFT, {**DRIFT, "files": "late.csv"}]},
        {},
    ),
    "Reduction.kind": (of(STEADY), reduced(STEADY, kind="acceleration"), {"files": {"sway.csv": sway()}}),
    "Reduction.start_s": (of(SWAY), reduced(SWAY, start_s=40.0), {"files": {"sway.csv": sway()}}),
    "Reduction.end_s": (of(SWAY), reduced(SWAY, end_s=50.0), {"files": {"sway.csv": sway()}}),
    "Reduction.rate_hz": (of(SWAY), reduced(SWAY, rate_hz=11.0), {"files": {"sway.csv": sway()}}),
    "Reduction.motion": (of(SWAY), reduced(SWAY, motion="heave"), {"files": {"sway.csv": sway()}}),
    "Reduction.frequency_hz": (of(SWAY), reduced(SWAY, frequency_hz=0.2), {"files": {"sway.csv": sway()}}),
    "Reduction.amplitude": (of(SWAY), reduced(SWAY, amplitude=0.4), {"files": {"sway.csv": sway()}}),
    "Reduction.path": (
        reduced(SWAY, motion="yaw"),
        reduced(SWAY, motion="yaw", path="straight"),
        {"files": {"sway.csv": sway()}},
    ),
    "Reduction.phase_deg": (of(SWAY), reduced(SWAY, phase_deg=30.0), {"files": {"sway.csv": sway()}}),
    "Reduction.delay_s": (of(SWAY), reduced(SWAY, delay_s={"Y": 0.05}), {"files": {"sway.csv": sway()}}),
}
PRIMED = {"drift.csv": primes(ROWS)}
REFERENCE = {"area_m2": 40.0, "length_m": 4.0, "source": "setup"}
SOURCE_CASES |= {
    f"Reference.{k}": (
        of(DRIFT, normalisation="half_rho_A", reference=REFERENCE),
        of(DRIFT, normalisation="half_rho_A", reference={**REFERENCE, k: v}),
        {"files": PRIMED, "words": k == "source"},
    )
    for k, v in {"area_m2": 80.0, "length_m": 8.0, "source": "other"}.items()
}


def eased(newtons: float) -> str:
    """The made history with another mean of X."""
    table = pd.read_csv(io.StringIO(sway()))
    table["X_N"] += newtons
    return table.to_csv(index=False)


# Of a ratio of steps of 0.3 the observed order is beyond the formal one at 1.4, and below it at 2.
SAMPLED = {f"{grid}/sway.csv": eased(x) for grid, x in (("fine", 0.0), ("mid", 300.0), ("low", 1300.0), ("raw", 4e3))}
ON_GRIDS = of({**STEADY, "files": "fine/sway.csv"}, grids=GRIDS)
DISC = {"towed": "towed.csv", "thrust_n": 5e4, "source": "disc"}
PUSHED = {**STEADY, "constants": {"test": "self_propulsion", "part": "propeller", "quality": "ok", "U": "5 m/s"}}
PUSHED["constants"] |= {"D0": "25 m", "n": "0.8 1/s"}
RUNS = {"sway.csv": eased(0.0), "towed.csv": eased(5e3), "other.csv": eased(8e3)}
SOURCE_CASES |= {
    f"Grids.{k}": (
        ON_GRIDS,
        of({**STEADY, "files": "fine/sway.csv"}, grids={**GRIDS, k: v}),
        {"files": SAMPLED, "said": "a folder 'best' in files" if k == "finest" else ""},
    )
    for k, v in {"finest": "best", "coarser": ["mid", "raw"], "refinement": 2.0}.items()
}
SOURCE_CASES |= {
    f"Deduction.{k}": (
        of(PUSHED, deduction=DISC), of(PUSHED, deduction={**DISC, k: v}), {"files": RUNS, "words": k == "source"}
    )
    for k, v in {"towed": "other.csv", "thrust_n": 9e4, "source": "other"}.items()
}  # fmt: skip
# What a key contradicts, where the message is on that: the file it is read from, or another statement.
SAID = {
    "Source.columns": "Y stands twice",
    "Source.patterns": "no unit for X",
    "Source.names": "numbers for a, b",
    "Source.header_pattern": "row 2 (header)",
    "Source.units_row": "'run_id [a]'",
    "Source.delimiter": "'run_id,U_mps",
    "Source.decimal": "'0.05'",
    "Source.thousands": "'0.05'",
    "Source.encoding": "not utf-16-le text",
    "Source.reduction": "only time histories are reduced",
    "Source.awaited": "no file 'late.csv'",
    "Source.deduction": "its loads would be left out",
    "Reduction.rate_hz": "Y oscillates at 0.275 Hz",
}
