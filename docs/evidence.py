"""The page of evidence: every vehicle, what its coefficients are from, predictions with bands, measured values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from reference_tables import table

import ident
from ident.analysis.stability import stability_at
from ident.captive.campaign import read_campaign
from ident.database.store import database_rows
from ident.estimates.appendages import differences
from ident.fitting.fit import completed
from ident.identification.identify import identify
from ident.validation.validate import Validation
from sim.boat.coefficients import Coefficients
from sim.boat.mass import Environment
from sim.boat.vehicle import load_vehicle
from sim.files.toml_files import bundled
from sim.flight.case import load_case

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "raw_captive_data"
SAMPLES, SEED = 100, 1
_APPENDED = ("configurations/hull-planes", "configurations/hull-sail")
# Metrics shown of a case, by what is flown.
_SHOWN = ("advance_90_heading_m", "tactical_diameter_180_heading_m", "overshoot_1_deg", "overshoot_2_deg")
_BOATS = ("kvlcc2-", "remus", "lauv", "nps-", "suboff-hzz", "suboff-vzz", "suboff-turn")
# Groups of cases that printed or measured values are counted of, by the beginnings of their names.
_GROUPS = {
    "`kvlcc2`, model scale, beside the free model": ("kvlcc2-turn", "kvlcc2-zz"),
    "`kvlcc2-ship`, full scale, beside the free model": ("kvlcc2-ship-",),
    "`kvlcc2-mmg`, beside what the paper calculated": ("kvlcc2-mmg-",),
}


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
    folders = {n: folder / n for n in ("hull", "hull-sail", "hull-planes")} | {"full": DATA / "suboff"}
    campaigns = {n: read_campaign(one) for n, one in folders.items()}
    rows = {n: database_rows(identify(one)) for n, one in campaigns.items()}
    found = differences(rows, "suboff", float(campaigns["full"].header.fluid.density_kgpm3))
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


def configurations() -> str:
    """Stability of SUBOFF's five configurations at the speed of the captive tests."""
    rows = []
    for folder in ("configurations/hull", "configurations/hull-ring-wing", *_APPENDED, "."):
        campaign = read_campaign(DATA / "suboff" / folder)
        made = completed(campaign, database_rows(identify(campaign)))
        case, _ = load_case(f"{campaign.vehicle.name}-coast" if folder != "." else "suboff-hzz10")
        water = Environment(case.environment.density_kgpm3, case.environment.gravity_mps2)
        one = stability_at(Coefficients(campaign.vehicle, made), water, case.initial.speed_mps, case.initial.depth_m)
        roots = [max(x[0] for x in found) for found in (one.vertical, one.horizontal)]
        published = int(made["quality"].isin(("published", "no_error_quoted")).sum())
        indices = [f"{one.g_horizontal:+.3f}", f"{one.g_vertical:+.3f}"]
        rows.append(
            [f"`{campaign.vehicle.name}`", f"{published} of {len(made)}", *indices, *(f"{x:+.3f}" for x in roots)]
        )
    head = ["configuration", "rows published", "Gh", "Gv", "least stable root, vertical [1/s]", "horizontal [1/s]"]
    return table(head, rows)


def predictions(db: str) -> str:
    """Metrics of the cases of other boats with 95 % bands, from the versions in ``db``."""
    rows: list[list[str]] = []
    for name in bundled("cases"):
        if name.startswith(_BOATS):
            rows += _of_case(name, ident.validate(name, db=db).with_bands(SAMPLES, SEED))
    head = ["case", "metric", "predicted", "95 % band", "printed or measured", "by", "ratio", "in the band"]
    said = [_counted(rows, label, of) for label, of in _GROUPS.items()]
    return "\n".join([*said, "", table(head, rows)])


def _counted(rows: list[list[str]], label: str, beginnings: tuple[str, ...]) -> str:
    """One line on how many of a group's printed or measured values were met."""
    held = [r for r in rows if r[0].strip("`").startswith(beginnings) and r[5] != "-"]
    inside, ratios = sum(r[7] == "yes" for r in held), [float(r[6]) for r in held]
    near = [sum(abs(r - 1.0) <= share + 1e-9 for r in ratios) for share in (0.03, 0.15)]
    turns = [float(r[6]) for r in held if r[1].endswith("[L]")]
    return (
        f"* {label}: {inside} of {len(held)} in the 95 % band; {near[0]} within 3 %, {near[1]} within 15 %; "
        f"turning circles between {min(turns):.2f} and {max(turns):.2f} of them."
    )


def _of_case(name: str, done: Validation) -> list[list[str]]:
    case, _ = load_case(name)
    length = load_vehicle(case.vehicle).particulars.length.value
    lines = []
    for metric in _SHOWN:
        if metric not in done.metrics or done.metrics[metric].get("simulated") is None:
            continue
        value = float(done.metrics[metric]["simulated"])
        drawn = sorted(m[metric] for m in done.bands.metrics if m.get(metric) is not None) if done.bands else []
        low, high = (drawn[int(0.025 * len(drawn))], drawn[int(0.975 * (len(drawn) - 1))]) if drawn else (value, value)
        scale, unit = (length, "L") if metric.endswith("_m") else (1.0, "deg")
        label = metric.rsplit("_", 1)[0].replace("_", " ") + f" [{unit}]"
        flown = [f"`{name}`", label, f"{value / scale:.2f}", f"{low / scale:.2f} to {high / scale:.2f}"]
        there = [p for p in case.published if p.metric == metric]
        for p in there:
            inside = "yes" if low <= p.value <= high else "no"
            lines.append([*flown, f"{p.value / scale:.2f}", p.source, f"{value / p.value:.3f}", inside])
        if not there:
            lines.append([*flown, "-", "-", "-", "-"])
    return lines
