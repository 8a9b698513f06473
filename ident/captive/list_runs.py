"""`ident runs`: the run table of a campaign as it was read, with the verdicts of reductions."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ident.captive.campaign import Campaign, find_campaigns, read_campaign
from ident.text import on_screen
from sim.boat.catalogue import OUTPUTS

if TYPE_CHECKING:
    from rich.console import Console

_STATE = ("U", "alpha", "beta", "D0", "plane", "p", "q", "r", "udot", "vdot", "wdot", "pdot", "qdot", "rdot", "n", "J")


def read(folder: Path, none_yet: bool = False) -> list[Campaign]:
    """Every campaign at or below a folder; ``none_yet`` allows one whose runs are all still to come.

    Raises
    ------
    sim.files.errors.InputError
        For bad input in any of them.
    """
    return [read_campaign(path, none_yet=none_yet) for path in find_campaigns(folder)]


def as_json(campaign: Campaign) -> list[dict[str, Any]]:
    """The run table, SI and radians, program frame; blanks are null."""
    columns = ["run_id", "file", "row", "test", "part", "quality", *_STATE]
    columns += [*OUTPUTS, *(f"s_{o}" for o in OUTPUTS), "reduction"]
    records = campaign.runs[columns].to_dict("records")
    blank = {True: None}
    return [
        {str(k): blank.get(isinstance(v, float) and not math.isfinite(v), v) for k, v in record.items()}
        for record in records
    ]


def show(campaign: Campaign, console: Console) -> None:
    """Print how many runs each file and test gave, and every reduction's verdict."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=on_screen(f"{campaign.vehicle.title}: {campaign.header.name}"), title_justify="left")
    for column in ("file", "test", "part", "runs", "loads"):
        table.add_column(column, justify="right" if column == "runs" else "left")
    for (file, test, part), group in campaign.runs.groupby(["file", "test", "part"], sort=False):
        loads = " ".join(o for o in OUTPUTS if group[o].notna().any())
        table.add_row(escape(str(file)), escape(str(test)), escape(str(part)), str(len(group)), loads)
    console.print(table)
    for one in campaign.reduced:
        colour = "green" if one.fit.converged else "yellow"
        console.print(f"[{colour}]{escape(one.run_id)}[/]: {escape(one.words())}", highlight=False)
