"""Rewrite what the documentation takes from the program: ``python docs/generate.py``.

Fits and calibrates the bundled campaign in a temporary database, flies every case and replaces
the marked blocks of README.md and docs/*.md; ``--check`` only says whether they are current,
and passes over the accuracy of the calibrated version, which takes minutes to renew.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# The documentation is of this checkout, whatever copy of the package is installed.
sys.path[:0] = [str(ROOT), str(ROOT / "docs")]

import choices
import evidence
import recipes
from reference_tables import axes_table, constants_table, key_tables, room_tables, table

import ident
from ident.analysis.derivatives import derivatives
from ident.checks.findings import rules
from ident.commands import times
from ident.validation.board import Scoreboard
from ident.validation.figures import case_figure
from sim.bench.guard import recorded
from sim.bench.step_errors import recorded as step_errors
from sim.boat import catalogue
from sim.boat.coefficients import Coefficients
from sim.boat.mass import Environment
from sim.flight.case import load_case

CASE = "hzz20"


def signs(coefficients: Coefficients) -> str:
    """Derivatives beside SUBOFF's."""
    case, _ = load_case(CASE)
    environment = Environment(case.environment.density_kgpm3, case.environment.gravity_mps2)
    found = derivatives(coefficients, environment, case.initial.speed_mps, case.initial.depth_m, 0.0)
    rows = [
        [
            f"`{d.symbol}`",
            f"{d.hull:+.4f}",
            f"{d.whole:+.4f}",
            "positive" if d.expected > 0 else "negative",
            "yes" if d.ok else "**no**",
            "-" if d.suboff is None else f"{d.suboff:+.4f}",
        ]
        for d in found
    ]
    return table(["derivative", "hull and sail", "whole boat", "expected", "as expected", "SUBOFF, appended"], rows)


def speed() -> str:
    """Recorded times and ratios of the simulator."""
    rows = [[line.label, f"{line.value:,.3g}", line.unit] for line in recorded()]
    return table(["", "", "unit"], rows)


def whole_commands() -> str:
    """Recorded times of whole commands."""
    rows = [
        [f"`{c.command}`", f"{c.wall_s:.1f}", f"{c.processor_s:.1f}", f"{c.memory_GB:.2f}"] for c in times.recorded()
    ]
    if not rows:
        return "Not recorded yet on a machine with nothing else to do."
    return table(["command, warm", "s", "s of processor", "GB"], rows)


def steps() -> str:
    """What the step of each bundled case costs in accuracy."""
    rows = []
    for e in step_errors():
        pairs = zip(e[2::2], e[3::2], strict=True)
        rows.append([e.case, f"{e.step_s:g} s", *(f"{off:.2g} / {size:.3g}" for off, size in pairs)])
    return table(["case", "step", "u, m/s", "D0, m", "theta, deg", "psi, deg", "place, m"], rows)


def number(value: float | None) -> str:
    """Three digits, or a dash."""
    return "-" if value is None else f"{value:.3g}"


def provenance(board: Scoreboard) -> str:
    """Which versions are compared, what they were trained on, and the geometric means."""
    lines = []
    for name, trained in board.trained_on.items():
        case = next(c for c in board.cases if c.validation and c.validation.case.vehicle == name)
        parent = case.parent
        before = f"from version {parent.version} (`{parent.digest[:16]}`)" if parent else "no parent"
        source = f"trained on {', '.join(trained)}" if trained else "predicted or as published, trained on no maneuver"
        database = case.database
        lines.append(f"* `{name}`: version {database['version']} (`{database['digest'][:16]}`), {before}, {source}.")
    ratios = [asdict(mean) for mean in (board.mean_ratio, board.mean_ratio_to_parent)]
    means = [
        [f"{kind} cases", *["-" if ratio[kind] is None else f"{ratio[kind]:.2f}" for ratio in ratios]]
        for kind in ("trained", "untrained")
    ]
    of = asdict(board.mean_ratio_by_version)
    versions = [["all cases", *["-" if x is None else f"{x:.2f}" for x in of.values()]]]
    columns = table(["to the published model", *[k.replace("_", " ") for k in of]], versions)
    header = ["geometric mean of the error ratios, calibrated", "to the published model", "to the predicted version"]
    worst = board.worst_ratio
    assert worst is not None
    place = f"{worst.case}, {worst.source}, `{worst.channel}`"
    return "\n".join([*lines, "", columns, "", table(header, means), "", f"Worst ratio: {worst.ratio:.2f} ({place})."])


def accuracy(board: Scoreboard) -> str:
    """Errors of every case beside the parent version and the published model, and the metrics of the main one."""
    keys = ("measured_only_rmse", "parent_rmse", "rmse", "published_model_rmse", "ratio", "ratio_to_parent")
    errors = [
        [case.name, source, f"`{channel}`", e["unit"], *[number(e[k]) for k in keys], yes_no(case.trained)]
        for case, source, channel, compared in board.comparisons
        for e in [compared.to_dict()]
    ]
    header = ["case", "reference", "channel", "unit", "measured only", "predicted", "calibrated", "published model"]
    header += ["ratio", "to predicted", "trained"]
    labels = ["simulated", "EXP", "CFD", "published_model"]
    main_case = next(one for one in board.flown if one.case.name == CASE)
    metrics = [
        [f"`{m}`", *[number(values[c]) for c in labels]]
        for m, values in main_case.metrics.items()
        if any(values[c] is not None for c in labels)
    ]
    return "\n\n".join(
        [
            provenance(board),
            table(header, errors),
            f"Metrics of `{CASE}`:",
            table(["metric", *[c.replace("_", " ") for c in labels]], metrics),
        ]
    )


def yes_no(value: bool) -> str:
    """A flag in words."""
    return "yes" if value else "no"


def errata() -> str:
    """The errata this program applies."""
    with (ROOT / "sim" / "vehicles" / "bb2" / "errata.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return table(list(rows[0]), [list(r.values()) for r in rows])


def check_table() -> str:
    """Every quality check with its limits and remedy, from ``ident/data/checks.csv``."""
    rows = [
        [
            f"`{r.name}`",
            r.severity,
            r.finds,
            ", ".join(f"{k} {v:g}" for k, v in r.limits.items()) or "-",
            r.basis,
            r.remedy,
        ]
        for r in rules().values()
    ]
    return table(["check", "severity", "finds", "limits", "because", "remedy"], rows)


def term_table() -> str:
    """Both term sets."""
    parts = []
    for name in catalogue.SETS:
        rows = [
            [
                f"`{t.name}`",
                t.part,
                f"{t.norm}^{t.power}" if t.norm else "-",
                f"`{t.multiplier}`" if t.factors else "-",
                " ".join(t.axes) or "constant",
                " ".join(f"{a}:{r}" for a, r in t.extrapolation.items()) or "-",
                " ".join(t.tests),
                t.equation,
            ]
            for t in catalogue.terms(name)
        ]
        head = ["coefficient", "part", "scale", "multiplier", "axes", "beyond the data", "test", "equation"]
        parts.append(f"## Set `{name}`: {len(rows)} terms\n\n{table(head, rows)}")
    return "\n\n".join(parts)


def replace(path: Path, blocks: dict[str, str]) -> str:
    """The file's text with its marked blocks replaced."""
    text = path.read_text(encoding="utf-8")
    for name, block in blocks.items():
        start, end = f"<!-- {name} -->\n", f"\n<!-- /{name} -->"
        if text.count(start) != 1 or text.count(end) != 1:
            raise SystemExit(f"{path.name}: the block {name} must stand once")
        head, rest = text.split(start)
        text = head + start + block + end + rest.split(end)[1]
    return text


def main() -> int:
    """Rewrite or check; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="exit 1 when a block is not current")
    parser.add_argument("--quick", action="store_true", help="leave what follows from a calibration as it is")
    chosen = parser.parse_args()
    only_check = chosen.check
    loaded = Path(ident.__file__).resolve().parents[1]
    if loaded != ROOT:
        raise SystemExit(f"ident was loaded from {loaded} before; run docs/generate.py by itself")
    with tempfile.TemporaryDirectory() as folder:
        db = str(Path(folder) / "coeff_db")
        fitted = ident.fit(ROOT / "raw_captive_data", db)[0]
        coefficients = Coefficients(fitted.campaign.vehicle, fitted.rows)
        readme = {"signs": signs(coefficients), "speed": speed(), "commands": whole_commands()}
        prediction: dict[str, str] = {}
        boats = {"vehicles": evidence.vehicles(), "appendages": evidence.suboff_differences()}
        boats["configurations"] = evidence.configurations()
        if not (only_check or chosen.quick):
            # A calibration takes minutes, so only a full run renews what follows from it.
            prediction["choices"] = choices.choices(db, fitted.campaign)
            ident.calibrate("bb2", db)
            board = ident.scoreboard(db)
            main_case = next(one for one in board.flown if one.case.name == CASE)
            case_figure(main_case.flown, ROOT / "docs" / f"{CASE}.png")
            readme["accuracy"] = accuracy(board)
            boats["predictions"] = evidence.predictions(db)
    wanted = {
        ROOT / "README.md": readme,
        ROOT / "docs" / "evidence.md": boats,
        ROOT / "docs" / "prediction.md": prediction,
        ROOT / "docs" / "errata.md": {"errata": errata()},
        ROOT / "docs" / "readers.md": recipes.blocks(),
        ROOT / "docs" / "integration.md": {"steps": steps()},
        ROOT / "docs" / "terms.md": {"terms": term_table()},
        ROOT / "docs" / "checks.md": {"checks": check_table()},
        ROOT / "docs" / "nomenclature.md": {"axes": axes_table(), "constants": constants_table()},
        ROOT / "docs" / "keys.md": {"keys": key_tables()},
        ROOT / "docs" / "architecture.md": {"rooms": room_tables()},
    }
    stale = [path for path, blocks in wanted.items() if replace(path, blocks) != path.read_text(encoding="utf-8")]
    if only_check:
        for path in stale:
            print(f"{path.name} is not current: run python docs/generate.py")
        return 1 if stale else 0
    for path in stale:
        path.write_text(replace(path, wanted[path]), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
