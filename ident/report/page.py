"""The report of one database version: a single self-contained HTML page."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from ident.analysis.derivatives import checks, derivatives
from ident.checks.findings import SEVERITIES, spans
from ident.database.provenance import steps
from ident.fitting.notes import group_unused, group_warnings, stored_unused, stored_warnings
from ident.output import whole
from ident.report.figures import Picture, equations, figures_begun, quality_colours
from ident.report.interactive import Drawn, write_interactive
from ident.report.score import read_score
from ident.report.values import Run, runs_of, term_anchor, term_pages
from ident.report.values import number as _figure
from sim.boat import catalogue
from sim.boat.catalogue import RULES, Term
from sim.boat.coefficients import Coefficients
from sim.boat.database import Version, axis_columns, own_version, read_rows
from sim.boat.mass import Environment
from sim.boat.parts import parts_of, vehicle_terms
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files.errors import InputError
from sim.files.frames import PROGRAM
from sim.files.toml_files import bundled

if TYPE_CHECKING:
    from jinja2 import Template

# Prime derivatives do not depend on density and gravity, so both may be anything.
_UNIT = Environment(density=1.0, gravity=0.0)
# Runs of one value that are printed one by one.
_MANY_RUNS = 40


def _time(stamp: str) -> str:
    return datetime.fromtimestamp(int(stamp) / 1000, UTC).strftime("%Y-%m-%d %H:%M UTC") if stamp.isdigit() else stamp


def _option(key: str, value: Any) -> str:
    """An option of the fit in words; what is stated of nothing is left out."""
    if isinstance(value, dict):
        stated = {k: v for k, v in value.items() if v not in ([], None, "")}
        return f"{key}: " + ", ".join(f"{k} {_listed(v)}" for k, v in stated.items())
    return f"{key} {_listed(value)}"


def _listed(value: Any) -> str:
    return " and ".join(map(str, value)) if isinstance(value, list) else str(value)


def _provenance(db: str, number: int, commit: Version, vehicle: Vehicle) -> list[tuple[str, str]]:
    known = commit.metadata
    options = [_option(key, value) for key, value in commit.stored("options", {}).items()]
    return [
        ("Database", db),
        ("Version", str(number)),
        ("Vehicle", f"{vehicle.name}: {vehicle.title}"),
        ("Term set", f"{vehicle.term_set}, added mass from {vehicle.added_mass}"),
        ("Committed", f"as version {commit.number}, {_time(commit.timestamp)}".rstrip(", ")),
        ("Digest of the vehicle's rows (SHA-256)", commit.digest),
        ("Parent version", known.get("parent", "") or "none: the first commit"),
        ("Program", known.get("program", "")),
        ("Message", known.get("message", "")),
        *([("Fitted in spite of errors, because", known["forced"])] if known.get("forced") else []),
        ("Campaign", known.get("campaign", "")),
        ("Facility", known.get("facility", "")),
        ("Frame of the campaign", known.get("frame", "")),
        ("Frame of the database", f"{PROGRAM} (SNAME)"),
        ("Provenance", " ".join(known.get("provenance", "").split())),
        ("Options of the fit", "; ".join(options) or "none"),
    ]


def _ranges(term: Term, rows: pd.DataFrame) -> list[str]:
    """What the runs cover along each axis, in database units."""
    ranges = []
    for name in term.axes:
        axis = catalogue.axes()[name]
        values = sorted(rows[axis.column].unique())
        unit = "" if axis.unit == "1" else f" {axis.unit}"
        if len(values) == 1:
            text = f"{_figure(values[0])}{unit} only"
        elif name == "D0":
            text = ", ".join(_figure(v) for v in values) + unit
        else:
            text = f"{_figure(values[0])} to {_figure(values[-1])}{unit} ({len(values)})"
        ranges.append(f"{name}: {text}")
    return ranges


def _notes(term: Term, rows: pd.DataFrame) -> list[str]:
    """What a reader should know before trusting the coefficient off its points."""
    columns = {a: c for c, a in axis_columns().items()}
    single = [a for a in term.axes if rows[columns[a]].nunique() == 1]
    notes = [f"one {a} only: used at every {a}" for a in single]
    if {"alpha", "beta"} <= set(term.axes) - set(single):
        both = (rows[columns["alpha"]] != 0.0) & (rows[columns["beta"]] != 0.0)
        if not both.any():
            notes.append("no run has alpha and beta together: superposed")
    if (rows["origin"] == "published").any():
        notes.append("given by the source as a coefficient, not by runs")
    elif not (rows["origin"] == "measured").any():
        notes.append("all from the partner plane's runs by the mirror")
    return notes


def _coverage(vehicle: Vehicle, rows: pd.DataFrame, factors: dict[str, float]) -> list[dict[str, Any]]:
    """One row a term of the vehicle's set, with data or absent."""
    coverage = []
    for term in vehicle_terms(vehicle):
        of_term = rows[rows["coefficient"] == term.name]
        parts = parts_of(term, vehicle)
        row: dict[str, Any] = {
            "symbol": term.name,
            "group": term.group,
            "part": parts[0] if len(parts) == 1 else f"{of_term['part'].nunique()} of {len(parts)} sections",
            "equation": equations(term),
            "multiplier": term.multiplier or "1",
            "tests": " ".join(term.tests),
            "absent": of_term.empty,
        }
        if not of_term.empty:
            origin = of_term["origin"].value_counts()
            # In the order of the vocabulary: of words with one factor a set has any order.
            words = [q for q in factors if q in set(of_term["quality"])]
            row |= {
                "measured": int(origin.get("measured", 0) + origin.get("published", 0)),
                "mirror": int(origin.get("mirror", 0)),
                "symmetry": int(origin.get("symmetry", 0)),
                "ranges": _ranges(term, of_term),
                "quality": words[-1] if words else "",
                "worst_points": int((of_term["quality"] == words[-1]).sum()) if words else 0,
                "worst": float(of_term["worst_residual"].max()),
                "rules": [f"{a}: {r}" for a, r in term.extrapolation.items()],
                "notes": _notes(term, of_term),
            }
        coverage.append(row)
    return coverage


def _signs(coefficients: Coefficients, rows: pd.DataFrame) -> dict[str, Any]:
    """Derivatives at the largest tabulated speed and depth, where most data are."""
    columns = {a: c for c, a in axis_columns().items()}
    speed, depth = (float(rows[columns[a]].max()) for a in ("U", "D0"))
    if not coefficients.vehicle.terms_of.tabulated:
        # Constant coefficients have the same derivatives at every speed and depth.
        speed, depth = 1.0, 0.0
    if speed > 0.0:
        signs = derivatives(coefficients, _UNIT, speed, 0.0 if depth != depth else depth)
    else:
        signs = []
    sources = list(dict.fromkeys(c.source for c in checks() if c.suboff is not None))
    return {"speed": speed, "depth": depth, "rows": signs, "passed": sum(d.ok for d in signs), "sources": sources}


def _vocabulary(commit: Version, rows: pd.DataFrame) -> list[dict[str, Any]]:
    """Quality words by rising factor, with the number of points behind each."""
    known = commit.stored("quality", {})
    counts = rows["quality"].value_counts()
    words = sorted({*known, *(q for q in counts.index if q)}, key=lambda w: known.get(w, {}).get("factor", 1.0))
    words.sort(key=lambda w: (known.get(w, {}).get("factor", 1.0), list(known).index(w) if w in known else 0))
    return [
        {
            "word": w,
            "factor": known.get(w, {}).get("factor"),
            "meaning": known.get(w, {}).get("meaning", "not in the commit's vocabulary"),
            "points": int(counts.get(w, 0)),
        }
        for w in words
    ]


def _calibration(commit: Version, vehicle: Vehicle, number: int) -> dict[str, Any] | None:
    """What the version was calibrated with, with verdicts and a figure; None for captive versions."""
    from ident.calibration.figure import prior_and_posterior
    from ident.calibration.result import MultiplierGroup

    stored = commit.stored("calibration", {})
    if not stored:
        return None
    stamp = f"{vehicle.name}, database version {number}; program frame: {PROGRAM}"
    groups = [MultiplierGroup.of(one) for one in stored["groups"]]
    said = [one | {"verdict": group.verdict} for one, group in zip(stored["groups"], groups, strict=True)]
    return stored | {"groups": said, "figure": prior_and_posterior(groups, stamp)}


_ERRATA = ("equation", "printed", "corrected", "consequence")


def _errata(vehicle: Vehicle) -> list[dict[str, str]]:
    """What is printed wrong in the vehicle's source; none where its file names no table.

    Raises
    ------
    InputError
        When the table cannot be read or has other columns.
    """
    if vehicle.errata is None:
        return []
    try:
        with open(vehicle.errata, encoding="utf-8", newline="") as stream:
            table = csv.DictReader(stream)
            if tuple(table.fieldnames or ()) != _ERRATA:
                raise InputError(f"{vehicle.errata}, row 1", ", ".join(table.fieldnames or ()), ", ".join(_ERRATA))
            return list(table)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(vehicle.errata, f"cannot be read: {error}", "a CSV file in UTF-8") from error


def _content(
    db: str,
    number: int,
    vehicle: Vehicle,
    rows: pd.DataFrame,
    commit: Version,
    vocabulary: list[dict[str, Any]],
) -> dict[str, Any]:
    """Everything the template shows but the pictures and what refers to them."""
    from markupsafe import Markup

    coverage = _coverage(vehicle, rows, {q["word"]: q["factor"] or 1.0 for q in vocabulary})
    columns = {a: c for c, a in axis_columns().items()}
    combined = (rows[columns["alpha"]].fillna(0.0) != 0.0) & (rows[columns["beta"]].fillna(0.0) != 0.0)
    return {
        "many_runs": _MANY_RUNS,
        "script": Markup((files("ident") / "report" / "report.js").read_text("utf-8")),
        "vehicle": vehicle,
        "version": number,
        "frame": str(PROGRAM),
        "provenance": [(k, v) for k, v in _provenance(db, number, commit, vehicle) if v],
        "steps": steps(commit.stored("conversions", {})),
        "inputs": commit.stored("inputs", {}),
        "coverage": {g: [c for c in coverage if c["group"] == g] for g in dict.fromkeys(c["group"] for c in coverage)},
        "present": [c for c in coverage if not c["absent"]],
        "absent": [c for c in coverage if c["absent"]],
        "combined": int(combined.sum()),
        "rules": RULES,
        "points": len(rows),
        "signs": _signs(Coefficients(vehicle, rows), rows),
        "warnings": group_warnings(stored_warnings(commit)),
        "unused": group_unused(stored_unused(commit)),
        "checks": commit.stored("checks", []) if "checks" in commit.metadata else None,
        "severities": _severities(commit.stored("checks", []) if "checks" in commit.metadata else None),
        "calibration": _calibration(commit, vehicle, number),
        "vocabulary": vocabulary,
        "colours": quality_colours(q["word"] for q in vocabulary),
        "errata": _errata(vehicle),
    }


def _pictured(vehicle: Vehicle, rows: pd.DataFrame, runs: dict[str, Run], pictures: list[Picture]) -> dict[str, Any]:
    """Pictures, and the pages of terms that refer to them."""
    pages = term_pages(vehicle_terms(vehicle), rows, pictures, runs)
    return {
        "pictures": pictures,
        "term_pages": pages,
        "drawn": {p.symbol: [anchor for anchor, _ in p.figures] for p in pages},
        "runs": list(runs.values()),
    }


def _severities(findings: list[dict[str, Any]] | None) -> dict[str, int] | None:
    """Number of quality findings by severity; None where the commit holds none of them."""
    if findings is None:
        return None
    return {s: sum(f.get("severity") == s for f in findings) for s in reversed(SEVERITIES)}


def reported_vehicles(db: str, version: int | None) -> list[str]:
    """Bundled vehicles of a version, for which a page can be written without a vehicle file.

    Raises
    ------
    InputError
        When database or version do not exist, or every vehicle needs its file.
    """
    names = sorted(read_rows(db, version)[0]["vehicle"].unique())
    known = [name for name in names if name in bundled("vehicles")]
    if not known:
        raise InputError(db, f"coefficients of {', '.join(names)}", "--vehicle FILE, the vehicle file of one of them")
    return known


def _drawn(db: str, number: int, vehicle: str) -> tuple[pd.DataFrame, dict[str, Run]]:
    rows, _ = read_rows(db, number, vehicle)
    return rows, runs_of(rows, own_version(db, vehicle, number))


def write_report(
    db: str,
    version: int | None,
    out: Path,
    vehicle: str,
    interactive: bool = False,
    beside: Sequence[int] = (),
    workers: int = 1,
    scoreboard: Path | None = None,
) -> dict[str, Any]:
    """Write the report of one vehicle at one database version.

    Parameters
    ----------
    db : Folder or object-store URL of the database.
    version : Version number, latest when None.
    out : Folder for the page; created when absent.
    vehicle : Bundled name or path to a vehicle file.
    interactive : Write a page with figures to turn and slice beside it, ``<vehicle>_v<version>_interactive.html``.
    beside : Other versions drawn in the interactive figures.
    workers : Processes that draw the figures; 0 for all cores. The page does not depend on it.
    scoreboard : JSON of ``ident validate --all`` of the same version: its errors stand on the page, each leading to the
        values that its flight was computed from.

    Returns
    -------
    What was written, for a program to read: ``file`` (``<vehicle>_v<version>.html``: images,
    style and all in the one file), vehicle, version and digest, and how much it shows.

    Raises
    ------
    InputError
        When database, version or vehicle do not exist, the scoreboard is of another version, or the page cannot be
        written.
    """
    boat = load_vehicle(vehicle)
    rows, number = read_rows(db, version, boat.name)
    rows = rows.reset_index(drop=True)
    commit = own_version(db, boat.name, number)
    path = Path(out) / f"{re.sub(r'[^A-Za-z0-9._-]', '_', boat.name)}_v{number}.html"
    page_of_figures = path.with_name(f"{path.stem}_interactive.html")
    vocabulary = _vocabulary(commit, rows)
    colours = quality_colours(q["word"] for q in vocabulary)
    with figures_begun(boat, rows, colours, number, workers) as pictures:
        if interactive:
            shown = [Drawn(n, *_drawn(db, n, boat.name)) for n in dict.fromkeys((number, *beside))]
            write_interactive(boat, shown, page_of_figures, path.name)
        content = _content(db, number, boat, rows, commit, vocabulary) | {
            "interactive": page_of_figures.name if interactive else "",
            "score": read_score(scoreboard, commit.digest, len(rows)) if scoreboard else None,
        }
        content |= _pictured(boat, rows, runs_of(rows, commit), pictures())
    page = _template().render(content)
    with whole(path) as part:
        part.write_text(page, encoding="utf-8")
    said = {
        "file": str(path),
        "interactive": str(page_of_figures) if interactive else None,
        "vehicle": boat.name,
        "database": {"path": db, "version": number, "digest": commit.digest},
    }
    return said | _counts(content, len(rows), commit)


def _template() -> Template:
    """The page with its filters."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    templates = Environment(
        loader=PackageLoader("ident", "report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters |= {"spans": spans, "term_anchor": term_anchor, "plain": _figure}
    return templates.get_template("report.html.j2")


def _counts(content: dict[str, Any], rows: int, commit: Version) -> dict[str, Any]:
    """How much a page shows."""
    return {
        "rows": rows,
        "coefficients": len(content["present"]),
        "absent": [row["symbol"] for row in content["absent"]],
        "signs": {"expected": content["signs"]["passed"], "of": len(content["signs"]["rows"])},
        "findings": _severities(content["checks"]),
        "warnings": len(commit.stored("warnings", [])),
        "unused": len(commit.stored("unused", [])),
    }
