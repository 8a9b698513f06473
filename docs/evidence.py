"""The page of evidence: every vehicle, what its coefficients are from, predictions with bands, measured values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from reference_tables import table

import ident
from ident.captive.campaign import read_campaign
from ident.database.store import database_rows
from ident.estimates.appendages import differences
from ident.identification.identify import identify
from ident.validation.validate import Validation
from sim.boat.vehicle import load_vehicle
from sim.files.toml_files import bundled
from sim.flight.case import load_case

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "raw_captive_data"
SAMPLES, SEED = 100, 1
# Metrics shown of a case, by what is flown.
_SHOWN = ("advance_90_heading_m", "tactical_diameter_180_heading_m", "overshoot_1_deg", "overshoot_2_deg")
_BOATS = ("kvlcc2-", "remus", "lauv", "nps-", "suboff-")


def campaigns() -> dict[str, Any]:
    """Bundled campaigns by vehicle, identified."""
    folders = sorted({p.parent for p in DATA.rglob("campaign.toml")})
    found = {}
    for folder in folders:
        campaign = read_campaign(folder)
        found[campaign.vehicle.name] = (campaign, identify(campaign))
    return found


def vehicles() -> str:
    """Every bundled vehicle, and what its coefficients were identified from."""
    rows = []
    known = campaigns()
    for name in bundled("vehicles"):
        vehicle = load_vehicle(name)
        if name not in known:
            rows.append([f"`{name}`", vehicle.term_set, "-", "-", "no campaign"])
            continue
        campaign, identified = known[name]
        made = database_rows(identified)
        kinds = made.groupby("quality").size()
        words = ", ".join(f"{n} {q.replace('_', ' ')}" for q, n in kinds.items() if q)
        rows.append(
            [f"`{name}`", f"`{vehicle.term_set}`", str(len(made)), words, campaign.header.facility.split(",")[0]]
        )
    return table(["vehicle", "term set", "rows", "of which, by quality", "from"], rows)


def suboff_differences() -> str:
    """What an appendage adds alone: by the lines, and measured."""
    folder = DATA / "suboff" / "configurations"
    rows = {n: database_rows(identify(read_campaign(folder / n))) for n in ("hull", "hull-sail", "hull-planes")}
    found = differences(rows, "suboff")
    inside = sum(abs(d.score) < 1.96 for d in found)
    lines = [
        [
            d.appendage,
            f"`{d.coefficient}`",
            f"{d.estimated:+.4f} +- {d.estimated_sigma:.4f}",
            f"{d.measured:+.4f} +- {d.measured_sigma:.4f}",
            f"{d.estimated / d.measured:.2f}",
            f"{d.score:+.1f}",
        ]
        for d in found
    ]
    head = ["appendage", "derivative", "estimated", "measured difference", "ratio", "standard errors"]
    return f"{inside} of {len(found)} lie within 1.96 standard errors of both.\n\n{table(head, lines)}"


def predictions(db: str) -> str:
    """Metrics of the cases of other boats with 95 % bands, from the versions in ``db``."""
    rows = []
    for name in bundled("cases"):
        if not name.startswith(_BOATS):
            continue
        done = ident.validate(name, db=db).with_bands(SAMPLES, SEED)
        rows += _of_case(name, done)
    return table(["case", "metric", "predicted", "95 % band", "printed or measured", "ratio"], rows)


def _of_case(name: str, done: Validation) -> list[list[str]]:
    case, _ = load_case(name)
    length = load_vehicle(case.vehicle).particulars.length.value
    printed = {p.metric: p for p in case.published}
    lines = []
    for metric in _SHOWN:
        if metric not in done.metrics or done.metrics[metric].get("simulated") is None:
            continue
        value = float(done.metrics[metric]["simulated"])
        drawn = sorted(m[metric] for m in done.bands.metrics if m.get(metric) is not None) if done.bands else []
        low, high = (drawn[int(0.025 * len(drawn))], drawn[int(0.975 * (len(drawn) - 1))]) if drawn else (value, value)
        scale, unit = (length, "L") if metric.endswith("_m") else (1.0, "deg")
        label = metric.rsplit("_", 1)[0].replace("_", " ") + f" [{unit}]"
        there = printed.get(metric)
        rows = [f"`{name}`", label, f"{value / scale:.2f}", f"{low / scale:.2f} to {high / scale:.2f}"]
        rows += [f"{there.value / scale:.2f}", f"{value / there.value:.2f}"] if there else ["-", "-"]
        lines.append(rows)
    return lines
