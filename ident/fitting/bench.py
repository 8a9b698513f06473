"""What a fit costs as a campaign grows: ``python -m ident.fitting.bench CAMPAIGN --check``.

Every run of a campaign is repeated with noise on its loads, four and forty times; both campaigns
are fitted, each in a process of its own, and processor time and memory of the larger are put over
those of the smaller. Ten times the runs may cost at most ten times as much; a step that compares
all runs with all costs a hundred. ``data/fit_ratios.csv`` holds the ratios of the last change that
was meant to change them.
"""

from __future__ import annotations

import argparse
import csv
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd

from ident.captive.quantities import owner, suffixed
from sim.boat.catalogue import OUTPUTS

# How often each run stands in the two campaigns.
_TIMES = (4, 40)
# A ratio may be worse than the recorded one by this share.
_TOLERANCE = 0.25
_FIT = """
import json, resource, sys, time
from pathlib import Path
from ident.fitting.fit import fit
start, used = time.perf_counter(), time.process_time()
(done,) = fit(Path(sys.argv[1]), sys.argv[2])
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**30 if sys.platform == "darwin" else 2**20)
print(json.dumps({"runs": len(done.campaign.runs), "seconds": round(time.perf_counter() - start, 2),
    "processor_s": round(time.process_time() - used, 2), "memory_GB": round(peak, 3)}))
"""


def repeated_campaign(folder: Path, out: Path, times: int, noise: float = 0.01, seed: int = 1) -> Path:
    """A campaign with every run of another repeated, its loads with noise.

    Parameters
    ----------
    folder : Campaign of CSV files, a row a run.
    out : Where the new one is written; created.
    times : Rows that stand for each run. The name of a run gets ``#1``, ``#2``, ...; a copy is
        the copy of the repetition with its own number.
    noise : Standard deviation of the factor on each load.
    seed : Of the generator; copies get noise of their own, as the check for copies would find
        them otherwise.

    Returns
    -------
    ``out``.

    Examples
    --------
    >>> folder = repeated_campaign(Path("raw_captive_data/bb2"), Path("x10"), 10)  # doctest: +SKIP
    """
    random = np.random.default_rng(seed)
    out.mkdir(parents=True, exist_ok=True)
    for path in sorted(folder.iterdir()):
        if path.suffix != ".csv":
            shutil.copy(path, out / path.name)
            continue
        table = pd.read_csv(path, dtype=str, keep_default_na=False)
        whole = table.loc[table.index.repeat(times)].reset_index(drop=True)
        number = np.tile(np.arange(times) + 1, len(table)).astype(str)
        for column in ("run_id", "copy_of"):
            if column in whole:
                whole[column] = [f"{name}#{k}" if name else "" for name, k in zip(whole[column], number, strict=True)]
        for column in map(str, whole):
            if owner(suffixed().get(column, ("", 1.0))[0]) in OUTPUTS and not column.startswith("sigma_"):
                given = pd.to_numeric(whole[column])
                made = given * (1.0 + noise * random.standard_normal(len(whole)))
                whole[column] = [f"{x:.6g}" if x == x else "" for x in made]
        whole.to_csv(out / path.name, index=False)
    return out


@dataclass(frozen=True)
class FitCost:
    """What a fit of a campaign costs.

    Attributes
    ----------
    runs : Rows of its run table.
    seconds, processor_s : By the clock, and of all processors.
    memory_GB : At its peak.
    """

    runs: int
    seconds: float
    processor_s: float
    memory_GB: float


@dataclass(frozen=True)
class Growth:
    """What ten times the runs cost.

    Attributes
    ----------
    fits : Of the smaller and of the larger campaign.
    time_ratio, memory_ratio : Of the larger over the smaller, of the processor and at the peak.
    """

    fits: tuple[FitCost, FitCost]
    time_ratio: float
    memory_ratio: float

    @property
    def ratios(self) -> dict[str, float]:
        """By the names of ``data/fit_ratios.csv``."""
        return {"time_ratio": self.time_ratio, "memory_ratio": self.memory_ratio}


def fitted(folder: Path, scratch: Path) -> FitCost:
    """Fit a campaign in a process of its own.

    Parameters
    ----------
    folder : The campaign.
    scratch : Where the database goes; one that is there is removed.
    """
    db = scratch / f"db_{folder.name}"
    shutil.rmtree(db, ignore_errors=True)
    command = [sys.executable, "-c", _FIT, str(folder), str(db)]
    process = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return FitCost(**json.loads(process.stdout.splitlines()[-1]))


def measure(folder: Path) -> Growth:
    """Fits of a campaign's runs repeated, and what ten times the runs cost."""
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        made = [repeated_campaign(folder, scratch / f"x{times}", times) for times in _TIMES]
        small, large = (fitted(one, scratch) for one in made)
    time, memory = large.processor_s / small.processor_s, large.memory_GB / small.memory_GB
    return Growth((small, large), round(time, 3), round(memory, 3))


def recorded() -> dict[str, float]:
    """The ratios of ``data/fit_ratios.csv`` by name."""
    with (files("ident") / "data" / "fit_ratios.csv").open(encoding="utf-8") as stream:
        return {row["name"]: float(row["ratio"]) for row in csv.DictReader(stream)}


def worse(measured: Mapping[str, float]) -> list[str]:
    """What is to be said of ratios that are worse than the recorded ones by more than a quarter."""
    limits = {name: (1.0 + _TOLERANCE) * ratio for name, ratio in recorded().items()}
    return [f"{k} {measured[k]:.3g}, at most {most:.3g}" for k, most in limits.items() if measured[k] > most]


def main() -> None:
    """Print the fits and their ratios; exit 1 with ``--check`` when one is worse than recorded."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("campaign", type=Path, help="campaign of CSV files, a row a run")
    parser.add_argument("--check", action="store_true", help="exit 1 when a ratio is worse than data/fit_ratios.csv")
    parser.add_argument("--json", metavar="PATH|-", help="write the result as JSON")
    options = parser.parse_args()
    costs = measure(options.campaign)
    if options.json == "-":
        print(json.dumps(asdict(costs), indent=2))
    else:
        for one in costs.fits:
            used = f"{one.processor_s:.1f} s of processor, {one.memory_GB:.2f} GB"
            print(f"{one.runs:7d} runs {one.seconds:7.1f} s, {used}")
        print(f"ten times the runs: {costs.time_ratio:.2f} the time, {costs.memory_ratio:.2f} the memory")
        if options.json:
            Path(options.json).write_text(json.dumps(asdict(costs), indent=2) + "\n", encoding="utf-8")
    if options.check and (said := worse(costs.ratios)):
        sys.exit("the fit grows faster with the runs than recorded: " + "; ".join(said))


if __name__ == "__main__":
    main()
