"""``python -m sim.bench``."""

from __future__ import annotations

import json
import sys
from typing import Any

import click


@click.command()
@click.option("--tries", default=300, show_default=True, help="Of each time; the shortest counts.")
@click.option("--json", "to", help="Write the numbers as JSON to a file, or - for the screen.")
@click.option("--guard", is_flag=True, help="Fail when a ratio is worse than recorded by more than a quarter.")
@click.option("--record", "keep", is_flag=True, help="Make this run the recorded one.")
def main(tries: int, to: str | None, guard: bool, keep: bool) -> None:
    """Measure the simulator: times of this machine, and ratios that hold on any.

    Example: python -m sim.bench --json -
    """
    from sim.bench.guard import fallen, record, recorded
    from sim.bench.measure import fleets, jsbsim_us, ratios

    measured: dict[str, Any] = ratios(tries, lambda text: click.echo(f"measuring {text}", err=True))
    # The guard holds ratios: what has none is not waited for.
    measured |= jsbsim_us() if guard else fleets() | jsbsim_us()
    lines = fallen(measured) if guard else []
    if lines:
        # Other work on the machine may have met one of two times only: what fell, fell twice.
        click.echo("measuring once more", err=True)
        measured |= ratios(2 * tries)
        lines = fallen(measured)
    text = json.dumps(measured, indent=1)
    if to == "-":
        click.echo(text)
    else:
        for line in recorded():
            if line.name in measured:
                click.echo(f"{line.label:46s} {measured[line.name]:12.4g} {line.unit}".rstrip())
        if to:
            with open(to, "w", encoding="utf-8") as stream:
                stream.write(text + "\n")
    if keep:
        record(measured)
    for fell in lines:
        click.echo(fell, err=True)
    if lines:
        sys.exit(1)


if __name__ == "__main__":
    main()
