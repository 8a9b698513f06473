"""The report of one database version: a single self-contained HTML page."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from ident.checks.findings import SEVERITIES, spans
from ident.database.provenance import steps
from ident.fitting.notes import group_unused, group_warnings, stored_unused, stored_warnings
from ident.output import whole
from ident.report.coverage import QualityWord, coverage, quality_words
from ident.report.figures import Picture, figures_begun, quality_colours
from ident.report.interactive import Drawn, write_interactive
from ident.report.score import read_score
from ident.report.values import Run, runs_of, term_anchor, term_pages
from ident.report.values import number as _figure
from sim.boat.catalogue import RULES
from sim.boat.coefficients import Coefficients
from sim.boat.database import Version, axis_columns, own_version, read_rows
from sim.boat.delta_log import Origin
from sim.boat.mass import Environment
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files import inputs
from sim.files.errors import InputError
from sim.files.frames import PROGRAM
from sim.files.toml_files import bundled

if TYPE_CHECKING:
    from jinja2 import Template

    from ident.analysis.derivatives import Derivative

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


@dataclass(frozen=True)
class Signs:
    """Signs of the linear derivatives beside those of a stable boat.

    Attributes
    ----------
    speed, depth : At which they are taken [m/s, m].
    rows : The derivatives.
    sources : Of the expectations.
    """

    speed: float
    depth: float
    rows: list[Derivative]
    sources: list[str]

    @property
    def passed(self) -> int:
        """How many are as expected."""
        return sum(d.ok for d in self.rows)


def _signs(coefficients: Coefficients, rows: pd.DataFrame) -> Signs:
    """Derivatives at the largest tabulated speed and depth, where most data are."""
    # Imported here, when other processes draw already: compiled functions take longer to load than to call.
    from ident.analysis.derivatives import checks, derivatives

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
    return Signs(speed, depth, signs, sources)


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
    inputs.check_regular(Path(vehicle.errata))
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
    vocabulary: list[QualityWord],
) -> dict[str, Any]:
    """Everything the template shows but the pictures and what refers to them."""
    from markupsafe import Markup

    terms = coverage(vehicle, rows, {q.word: q.factor or 1.0 for q in vocabulary})
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
        "coverage": {g: [c for c in terms if c.group == g] for g in dict.fromkeys(c.group for c in terms)},
        "present": [c for c in terms if not c.absent],
        "absent": [c for c in terms if c.absent],
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
        "colours": quality_colours(q.word for q in vocabulary),
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


@dataclass(frozen=True)
class Additions:
    """What stands on a report or beside it by request.

    Attributes
    ----------
    interactive : Write a page with figures to turn and slice beside it, ``<vehicle>_v<version>_interactive.html``.
    beside : Other versions drawn in the interactive figures.
    scoreboard : JSON of ``ident validate --all`` of the same version: its errors stand on the page, each leading to
        the values that its flight was computed from.
    """

    interactive: bool = False
    beside: Sequence[int] = ()
    scoreboard: Path | None = None


@dataclass(frozen=True)
class Written:
    """A report that was written, and how much it shows.

    Attributes
    ----------
    file : ``<vehicle>_v<version>.html``: images, style and all in the one file.
    interactive : The page of figures beside it, where it was asked for.
    vehicle : Its name.
    database : ``path``, ``version`` and ``digest``.
    rows, coefficients : Numbers of values and of terms with data.
    absent : Terms without data.
    signs : ``expected``, how many are as a stable boat has them, ``of`` how many.
    findings : Of the quality checks by severity; None where the commit holds none.
    warnings, unused : Numbers of warnings of the fit and of loads that it left out.
    """

    file: str
    interactive: str | None
    vehicle: str
    database: Origin
    rows: int
    coefficients: int
    absent: list[str]
    signs: dict[str, int]
    findings: dict[str, int] | None
    warnings: int
    unused: int

    def to_dict(self) -> dict[str, Any]:
        """For a program to read."""
        return asdict(self)


def write_report(
    db: str,
    version: int | None,
    out: Path,
    vehicle: str,
    additions: Additions | None = None,
    workers: int = 1,
) -> Written:
    """Write the report of one vehicle at one database version.

    Parameters
    ----------
    db : Folder or object-store URL of the database.
    version : Version number, latest when None.
    out : Folder for the page; created when absent.
    vehicle : Bundled name or path to a vehicle file.
    additions : What stands on the page or beside it by request.
    workers : Processes that draw the figures; 0 for all cores. The page does not depend on it.

    Returns
    -------
    Written

    Raises
    ------
    InputError
        When database, version or vehicle do not exist, the scoreboard is of another version, or the page cannot be
        written.
    """
    additions = additions or Additions()
    boat = load_vehicle(vehicle)
    rows, number = read_rows(db, version, boat.name)
    rows = rows.reset_index(drop=True)
    commit = own_version(db, boat.name, number)
    path = Path(out) / f"{re.sub(r'[^A-Za-z0-9._-]', '_', boat.name)}_v{number}.html"
    page_of_figures = path.with_name(f"{path.stem}_interactive.html")
    vocabulary = quality_words(commit, rows)
    colours = quality_colours(q.word for q in vocabulary)
    with figures_begun(boat, rows, colours, number, workers) as pictures:
        if additions.interactive:
            shown = [Drawn(n, *_drawn(db, n, boat.name)) for n in dict.fromkeys((number, *additions.beside))]
            write_interactive(boat, shown, page_of_figures, path.name)
        content = _content(db, number, boat, rows, commit, vocabulary) | {
            "interactive": page_of_figures.name if additions.interactive else "",
            "score": read_score(additions.scoreboard, commit.digest, len(rows)) if additions.scoreboard else None,
        }
        content |= _pictured(boat, rows, runs_of(rows, commit), pictures())
    page = _template().render(content)
    with whole(path) as part:
        part.write_text(page, encoding="utf-8")
    signs, checked = content["signs"], content["checks"]
    return Written(
        file=str(path),
        interactive=str(page_of_figures) if additions.interactive else None,
        vehicle=boat.name,
        database={"path": db, "version": number, "digest": commit.digest},
        rows=len(rows),
        coefficients=len(content["present"]),
        absent=[term.symbol for term in content["absent"]],
        signs={"expected": signs.passed, "of": len(signs.rows)},
        findings=_severities(checked),
        warnings=len(commit.stored("warnings", [])),
        unused=len(commit.stored("unused", [])),
    )


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
