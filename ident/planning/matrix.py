"""A plan as a test matrix a laboratory can run, as JSON and as a table on the screen."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ident.captive.campaign import Campaign, to_full_scale, turn
from ident.captive.run_table import STATES
from ident.output import whole
from ident.planning.plan import Plan

if TYPE_CHECKING:
    from rich.console import Console

_ANGLES = ("alpha", "beta", "plane")
_UNITS = {"U": "mps", "D0": "m", "p": "radps", "q": "radps", "r": "radps", "n": "rps", "J": ""}


def matrix(plan: Plan, campaign: Campaign) -> pd.DataFrame:
    """The test matrix in the campaign's frame and scale, units in the header."""
    frame = campaign.header.frame.frame
    table = to_full_scale(turn(plan.runs, frame, campaign.header.frame.angles), 1.0 / campaign.header.scale.ratio)
    out = pd.DataFrame(
        {"run_id": [f"P{i + 1:03d}" for i in range(len(table))], "test": table["test"], "part": table["part"]}
    )
    for name in STATES:
        if table[name].notna().any():
            unit = "deg" if name in _ANGLES else _UNITS.get(name, "radps2" if name[0] in "pqr" else "mps2")
            values = np.rad2deg(table[name]) if name in _ANGLES else table[name]
            # Twelve digits, as in the tables: runs that share a product of speed and rate share a value.
            out[f"{name}_{unit}"] = [float(f"{v:.14g}") + 0.0 if math.isfinite(v) else math.nan for v in values]
    return out.assign(repeats=table["repeats"], identifies=table["identifies"])


def summary(plan: Plan, campaign: Campaign) -> dict[str, Any]:
    """Terms, runs and what is out of reach, for a program to read."""
    table = matrix(plan, campaign)
    runs = [{k: v for k, v in row.items() if v == v} for row in table.to_dict("records")]
    return {
        "campaign": campaign.header.name,
        "target": plan.target,
        "terms": plan.summary(),
        "runs": runs,
        "no_test_planned": {name: list(tests) for name, tests in plan.untestable.items()},
    }


def write_matrix(plan: Plan, campaign: Campaign, path: Path) -> None:
    """Write the test matrix as CSV.

    Raises
    ------
    InputError
        When the file cannot be written.
    """
    with whole(path) as part:
        matrix(plan, campaign).to_csv(part, index=False)


def show(plan: Plan, campaign: Campaign, console: Console) -> None:
    """Print what is wanted, what the plan reaches, and the number of runs by test."""
    from rich.markup import escape
    from rich.table import Table

    title = f"{campaign.vehicle.title}: values wanted at a relative standard error of {plan.target:g}"
    table = Table(title=escape(title), title_justify="left")
    for name in ("coefficient", "part", "why", "values", "now", "planned", "tests"):
        table.add_column(name, justify="right" if name in ("values", "now", "planned") else "left")
    for row in plan.summary():
        now, planned = ("-" if row[k] is None else f"{100 * row[k]:.3g} %" for k in ("now", "planned"))
        colour = "green" if row["reached"] else "red"
        cells = [row["coefficient"], row["part"], row["why"], str(row["values"]), now]
        table.add_row(*(escape(c) for c in cells), f"[{colour}]{planned}[/]", escape(" ".join(row["tests"])))
    console.print(table)
    for name, tests in plan.untestable.items():
        console.print(
            f"  {escape(name)}: no run, and none planned; {escape(' or '.join(tests))} gives it", highlight=False
        )
    for (test, part), group in plan.runs.groupby(["test", "part"], sort=False):
        console.print(f"  {test}, {part}: {len(group)} states, {group['repeats'].sum()} runs", highlight=False)
    total = int(plan.runs["repeats"].sum()) if len(plan.runs) else 0
    console.print(f"[bold]{len(plan.runs)} states, {total} runs[/]", highlight=False)
