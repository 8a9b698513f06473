"""A plan as a test matrix a laboratory can run, and as a table on the screen."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ident.captive.campaign import Campaign, at_origin, to_full_scale, turn
from ident.captive.run_table import STATES
from ident.output import html_table, whole
from ident.text import on_screen
from sim.boat.parts import Point

if TYPE_CHECKING:
    from rich.console import Console

Place = tuple[str, str, Point]
_ANGLES = ("alpha", "beta", "plane")
_UNITS = {"U": "mps", "D0": "m", "p": "radps", "q": "radps", "r": "radps", "n": "rps", "J": ""}


@dataclass(frozen=True)
class Need:
    """One tabulated value that is wanted.

    Attributes
    ----------
    name, part, point : Coefficient and where in its table.
    why : ``no run``, ``standard error``, or the range that is left.
    size : What its standard error is relative to: root mean square of the term's values, or
        the median of its kind where the term has none.
    now, planned : Relative standard error before and after; NaN without a value.
    tests : Tests that identify it.

    Examples
    --------
    >>> import ident
    >>> plan = ident.plan("my-boat/captive", target_rel=0.2)
    >>> sorted({need.why for need in plan.needs})
    ['no run', 'standard error']
    """

    name: str
    part: str
    point: Point
    why: str
    size: float
    tests: tuple[str, ...]
    now: float = math.nan
    planned: float = math.nan


@dataclass(frozen=True)
class Plan:
    """A test matrix and what it is for.

    Attributes
    ----------
    campaign : What was measured so far.
    target : Relative standard error asked for.
    needs : Every wanted value.
    runs : One row a run in the program frame, SI and radians, with repeats and what it identifies.
    untestable : Wanted terms that no test of the facility reaches, with the tests that would.

    Examples
    --------
    >>> import ident
    >>> plan = ident.plan("my-boat/captive", target_rel=0.2)
    >>> list(plan.matrix.columns[:3])
    ['run_id', 'test', 'part']
    """

    campaign: Campaign
    target: float
    needs: tuple[Need, ...]
    runs: pd.DataFrame
    untestable: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def terms(self) -> pd.DataFrame:
        """One row a term and reason: values wanted, worst relative error now and planned."""
        return pd.DataFrame(self.summary())

    @property
    def matrix(self) -> pd.DataFrame:
        """The test matrix in the campaign's own frame and scale, units in the header."""
        return matrix(self.runs, self.campaign)

    def to_dict(self) -> dict[str, Any]:
        """Terms, runs and what is out of reach, for a program to read."""
        runs = [{k: v for k, v in row.items() if v == v} for row in self.matrix.to_dict("records")]
        return {
            "campaign": self.campaign.header.name,
            "target": self.target,
            "terms": self.summary(),
            "runs": runs,
            "no_test_planned": {name: list(tests) for name, tests in self.untestable.items()},
        }

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the test matrix as CSV.

        Parameters
        ----------
        path : Of the file; one that is there is replaced.

        Raises
        ------
        InputError
            When the file cannot be written.
        """
        with whole(Path(path)) as part:
            self.matrix.to_csv(part, index=False)

    def __repr__(self) -> str:
        return f"Plan({self.campaign.header.name}: {len(self.runs)} states for a relative error of {self.target:g})"

    def _repr_html_(self) -> str:
        title = f"{self.campaign.header.name}: {len(self.runs)} states for a relative error of {self.target:g}"
        table = self.matrix
        return html_table(title, table.columns, table.itertuples(index=False))

    def summary(self) -> list[dict[str, Any]]:
        """One row a term and reason: values wanted, worst error now and planned."""
        groups: dict[tuple[str, str, str], list[Need]] = {}
        for need in self.needs:
            groups.setdefault((need.name, need.part, need.why), []).append(need)
        return [
            {
                "coefficient": name,
                "part": part,
                "why": why,
                "values": len(needs),
                "tests": list(needs[0].tests),
                "size": needs[0].size,
                "now": _worst(n.now for n in needs),
                "planned": _worst(n.planned for n in needs),
                "reached": all(n.planned <= self.target * (1.0 + 1e-6) for n in needs),
            }
            for (name, part, why), needs in groups.items()
        ]


def _worst(values: Iterable[float]) -> float | None:
    known = [v for v in values if math.isfinite(v)]
    return max(known) if known else None


def matrix(runs: pd.DataFrame, campaign: Campaign) -> pd.DataFrame:
    """The runs of a plan in the campaign's frame and scale, units in the header."""
    frame, pivot = campaign.header.frame.frame, campaign.header.motion_point
    table = to_full_scale(runs, 1.0 / campaign.header.scale.ratio)
    if pivot is not None:
        # A rotation without way on is about the origin whatever the pivot.
        way = table["U"] > 0.0
        there = [-x for x in frame.vector([pivot.x_m, pivot.y_m, pivot.z_m])]
        table = pd.concat([at_origin(table[way], there), table[~way]]).sort_index()
    table = turn(table, frame, campaign.header.frame.angles)
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


def show(plan: Plan, console: Console) -> None:
    """Print what is wanted, what the plan reaches, and the number of runs by test."""
    from rich.markup import escape
    from rich.table import Table

    title = f"{plan.campaign.vehicle.title}: values wanted at a relative standard error of {plan.target:g}"
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
        text = f"  {test}, {part}: {len(group)} states, {group['repeats'].sum()} runs"
        console.print(on_screen(text), highlight=False)
    total = int(plan.runs["repeats"].sum()) if len(plan.runs) else 0
    console.print(f"[bold]{len(plan.runs)} states, {total} runs[/]", highlight=False)
