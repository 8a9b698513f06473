"""A batch of cases and the progress of a matrix on the screen."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ident.cfd.batch import Batch
from ident.cfd.progress import Progress
from ident.text import on_screen

if TYPE_CHECKING:
    from rich.console import Console


def show_batch(batch: Batch, console: Console) -> None:
    """Print the surface's numbers beside the vehicle file's, and what was written or why nothing was."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(title="the surface beside the vehicle file", title_justify="left")
    for name in ("number", "surface", "vehicle", "off", "allowed"):
        table.add_column(name, justify="left" if name == "number" else "right")
    for one in batch.lines.checks:
        words = ["-" if math.isnan(v) else f"{v:.5g}" for v in (one.surface, one.vehicle, one.off, one.tolerance)]
        table.add_row(escape(one.name), *words)
    console.print(table)
    if not any("by panels" in one.name for one in batch.lines.checks):
        text = (
            "added mass by panels is not compared: it needs the extra panels, and a surface of at most 3000 triangles"
        )
        console.print(f"  {text}", highlight=False)
    if batch.outstanding:
        text = f"  {len(batch.outstanding)} cases of earlier batches are not back and count as run: "
        console.print(text + " ".join(batch.outstanding[:20]), highlight=False)
    if batch.matrix is None and batch.unreached:
        text = "no case written: every run of the facility that would help is computed, and these are known worse"
        console.print(f"[bold]{text}[/]: {escape(' '.join(batch.unreached))}", highlight=False)
        return
    if batch.matrix is None:
        console.print("[bold]every wanted standard error is reached: no case written[/]", highlight=False)
        return
    for run, why in batch.matrix.left_out.items():
        console.print(f"  [yellow]left out[/] {escape(run)}: {escape(why)}", highlight=False)
    new = [c for c in batch.matrix.cases if c.run_id in set(batch.matrix.new)]
    for kind in dict.fromkeys(c.kind for c in new):
        of_kind = [c for c in new if c.kind == kind]
        console.print(f"  {kind}: {' '.join(c.run_id for c in of_kind)}", highlight=False)
    folders = sum(len(c.grids) for c in new)
    place = on_screen(batch.matrix.folder)
    console.print(f"[bold]{len(new)} runs, {folders} cases[/] in {place}; {place}/Allrun runs them", highlight=False)


def show_progress(progress: Progress, console: Console) -> None:
    """Print how far each run is, the end of the log of every dead one, and what to start again."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=on_screen(f"{progress.matrix.folder}: {len(progress.matrix.cases)} runs"), title_justify="left")
    for name in ("run", "test", "part", "made by", "grids", "loads"):
        table.add_column(name)
    for case in progress.matrix.cases:
        of_run = [s for s in progress.states if s.run_id == case.run_id]
        words = [f"{s.grid} {s.word}" + (f" {100 * s.share:.0f} %" if s.word == "running" else "") for s in of_run]
        back = all(s.word == "done" for s in of_run)
        bad = [why for run, why in progress.unconverged.items() if run == case.run_id]
        loads = "" if not back else f"[yellow]{escape(bad[0])}[/]" if bad else "[green]converged[/]"
        table.add_row(case.run_id, escape(case.test), escape(case.part), case.kind, ", ".join(words), loads)
    console.print(table)
    for state in (*progress.of("died"), *progress.of("stopped")):
        console.print(f"[red]{state.run_id} {state.grid} {state.word}[/] in {escape(state.step)}:", highlight=False)
        for line in state.end.splitlines():
            console.print(on_screen(line), highlight=False, soft_wrap=True)
    for command, why in progress.restart:
        console.print(f"  start again: {on_screen(command)}   ({escape(why)})", highlight=False)
    counts = ", ".join(
        f"{len(progress.of(w))} {w}" for w in ("done", "running", "waiting", "died", "stopped") if progress.of(w)
    )
    console.print(f"[bold]{len(progress.states)} cases: {counts}[/]", highlight=False)
