"""Every published value of a bundled boat by itself: of the other sign, in another unit, of the next row; is it named?

    python tests/slips_in_published_values.py suboff kvlcc2 remus100

Standard errors go with the value. What is named is a finding more than the files as they lie have.
"""

from __future__ import annotations

import argparse
import collections
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from ident.captive.campaign import read_campaign
from ident.checks.check import evidence_of
from ident.checks.coefficients import constant_values
from ident.checks.findings import Evidence, registered, rules
from ident.identification.identify import identify

CAPTIVE = Path(__file__).parents[1] / "raw_captive_data"
# Checks that look at values without an axis.
CHECKS = (
    "coefficient", "proportion", "munk", "reciprocal", "turning", "plane_sign", "added_lever", "lift", "size",
    "inertia_sign", "revolution", "norm", "open_water",
)  # fmt: skip
FACTORS = {"sign": -1.0, "x 10": 10.0, "x 0.1": 0.1, "x 1000": 1000.0, "x 4.45": 4.448222, "x 0.225": 1 / 4.448222}


def named(evidence: Evidence, values: pd.DataFrame) -> collections.Counter[tuple[str, str]]:
    """Check and severity of what is found of a table of values, published as they stand."""
    runs = evidence.runs.copy()
    for row in values.to_dict("records"):
        runs.loc[(runs["coefficient"] == row["coefficient"]) & (runs["part"] == row["part"]), "value"] = row["value"]
    hull = values[values["part"] == "hull"].drop(columns="part").reset_index(drop=True)
    hull = hull.assign(file="values", row=hull.index + 1)
    seen = replace(evidence, runs=runs, constants=values, derivatives=hull)
    every = (f for name in CHECKS for one in registered()[name] for f in one(seen, rules()[name]))
    return collections.Counter((f.check, f.severity) for f in every)


def main() -> None:
    """Count what is named of each kind, and list what is not."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("boats", nargs="+")
    counts: collections.Counter[tuple[str, bool]] = collections.Counter()
    for boat in parser.parse_args().boats:
        campaign = read_campaign(CAPTIVE / boat)
        evidence, values = evidence_of(campaign), constant_values(identify(campaign))
        left: dict[str, list[str]] = collections.defaultdict(list)
        with np.errstate(all="ignore"):
            usual = named(evidence, values)
            for i, value in enumerate(values["value"]):
                others = {n: value * f for n, f in FACTORS.items()}
                for kind, other in {**others, "next row": values["value"].iloc[(i + 1) % len(values)]}.items():
                    if other == value or not value:
                        continue
                    changed = values.copy()
                    changed.loc[i, ["value", "stderr"]] = other, changed["stderr"][i] * abs(other / value)
                    more = bool(named(evidence, changed) - usual)
                    counts[kind, more] += 1
                    if not more:
                        left[kind].append(str(values["coefficient"][i]))
        for kind, names in left.items():
            print(f"{boat}, {kind}, not named: {' '.join(names)}")
    for kind in (*FACTORS, "next row"):
        print(f"{kind:10} {counts[kind, True]} of {counts[kind, True] + counts[kind, False]} named")


if __name__ == "__main__":
    main()
