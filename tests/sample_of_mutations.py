"""Slips of a hand in campaign, vehicle and run files, thousands of them: none ends in a traceback or half a table.

``python tests/sample_of_mutations.py 10000 sample.txt`` makes so many, counts what is refused, found by a check,
or accepted, and writes a hundred of those that nothing spoke against, each with the line that was changed and what
became of the coefficients, to be read by eye.
"""

from __future__ import annotations

import collections
import difflib
import random
import re
import shutil
import sys
import tempfile
import traceback
import warnings
from pathlib import Path

import numpy as np

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign
from ident.database.store import database_rows
from ident.identification.identify import identify
from sim.files.errors import InputError

STARTER = Path(__file__).parents[1] / "ident" / "starter" / "files"
FILES = (
    "my-boat.toml",
    "captive/campaign.toml",
    "captive/drift_horizontal.csv",
    "captive/rudders.csv",
    "captive/arm_r.csv",
)
TABLES = re.compile(r"(?s).*?files = \"\*\.csv\"\n")
NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:[eE][-+]?\d+)?(?![\w.])")


def slip(text: str, rng: random.Random) -> str:
    """A text with one slip: in a number, a word, a line or a column."""
    lines = text.split("\n")
    kind = rng.choice(
        ["number", "number", "number", "letter", "word", "drop", "twice", "swap", "column", "cell", "cut"]
    )
    at = rng.randrange(len(lines))
    if kind == "number":
        places = list(NUMBER.finditer(text))
        if not places:
            return text
        one = rng.choice(places)
        return text[: one.start()] + _number(one[0], rng) + text[one.end() :]
    if kind == "letter" and lines[at]:
        k = rng.randrange(len(lines[at]))
        lines[at] = lines[at][:k] + rng.choice("abcdeXYZ_-.,;'\"= 0123456789") + lines[at][k + rng.randrange(2) :]
    elif kind == "word":
        words = re.findall(r"[A-Za-z_]{2,}", text)
        old, new = rng.choice(words), rng.choice(words)
        return re.sub(rf"\b{old}\b", new, text, count=1)
    elif kind == "drop":
        del lines[at]
    elif kind == "twice":
        lines.insert(at, lines[at])
    elif kind == "swap":
        k = rng.randrange(len(lines))
        lines[at], lines[k] = lines[k], lines[at]
    elif kind in ("column", "cell"):
        cells = [line.split(",") for line in lines]
        wide = max(len(c) for c in cells)
        i, j = rng.randrange(wide), rng.randrange(wide)
        for k, one in enumerate(cells):
            if max(i, j) < len(one) and (kind == "column" or k == at):
                one[i], one[j] = one[j], one[i]
        lines = [",".join(c) for c in cells]
    elif kind == "cut":
        return text[: rng.randrange(len(text))]
    return "\n".join(lines)


def _number(text: str, rng: random.Random) -> str:
    digits = [i for i, c in enumerate(text) if c.isdigit()]
    k = rng.choice(digits)
    return rng.choice(
        [text[1:] if text.startswith("-") else f"-{text}", f"{float(text) * 10:g}", f"{float(text) / 1000:g}", "",
         text.replace(".", ","), text[:k] + rng.choice("0123456789") + text[k + 1 :], f"{text}.5.1", "nan", "1e999",
         f"{float(text) * 57.29578:g}", text[:k] + text[k + 1 :]]
    )  # fmt: skip


def outcome(folder: Path):
    """Rows and findings of the campaign, or the refusal."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            campaign = read_campaign(folder / "captive")
            found = identify(campaign)
            rows = database_rows(found)
            findings = check_campaign(campaign, folder / "captive", found)
        except InputError as error:
            return None, [], str(error)
    assert np.isfinite(rows[["value", "stderr"]].to_numpy()).all(), "not finite"
    own = rows.groupby(["coefficient", "part"], sort=False)["value"].apply(list)
    return {" ".join(k): v for k, v in own.items()}, [f.check for f in findings if f.severity != "info"], ""


def changes(before: dict[str, list[float]], after: dict[str, list[float]]) -> str:
    """Coefficients that changed, in words."""
    gone = [n for n in {**before, **after} if (n in before) != (n in after)]
    off = [n for n in before if n in after and before[n] != after[n]]
    words = [f"{n} {before[n][0]:.4g} -> {after[n][0]:.4g}" for n in off[:4]]
    words += [f"{n} gone" if n in before else f"{n} new" for n in gone[:3]]
    return "; ".join(words) + (f"; ... {len(off)} in all" if len(off) > 4 else "") or "nothing"


def sample(number: int, seed: int = 0) -> tuple[collections.Counter, list[str]]:
    """So many slips: counts of what became of them, and in words those that nothing spoke against."""
    rng, counts, accepted = random.Random(seed), collections.Counter(), []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "boat"
        shutil.copytree(STARTER, folder)
        # Histories take their time, and have mutations of their own.
        shutil.rmtree(folder / "captive" / "histories")
        for path in (folder / "captive").glob("*.csv"):
            if f"captive/{path.name}" not in FILES:
                path.unlink()
        tables = TABLES.match((folder / "captive" / "campaign.toml").read_text("utf-8"))[0]
        (folder / "captive" / "campaign.toml").write_text(tables, "utf-8")
        originals = {name: (folder / name).read_text("utf-8") for name in FILES}
        usual, loud, refused = outcome(folder)
        assert not refused, refused
        for k in range(number):
            name = FILES[k % len(FILES)]
            text = originals[name]
            slipped = slip(text, rng)
            if slipped == text:
                counts["the same file"] += 1
                continue
            (folder / name).write_text(slipped, "utf-8", errors="replace")
            try:
                rows, found, refused = outcome(folder)
            except Exception:
                diff = [d for d in difflib.ndiff(text.split("\n"), slipped.split("\n")) if d[0] in "+-"][:4]
                raise AssertionError(f"slip {k} of seed {seed} in {name}: {diff}\n{traceback.format_exc()}") from None
            if refused:
                counts["refused"] += 1
            elif sorted(found) != sorted(loud):
                counts["found by a check"] += 1
            else:
                same = rows == usual
                counts["accepted, nothing changed" if same else "accepted"] += 1
                diff = [d for d in difflib.ndiff(text.split("\n"), slipped.split("\n")) if d[0] in "+-"][:4]
                accepted.append(
                    f"{k} {name}\n  " + "\n  ".join(diff) + f"\n  => {'nothing' if same else changes(usual, rows)}"
                )
            (folder / name).write_text(text, "utf-8")
    return counts, accepted


def main(number: int, path: str) -> None:
    """Make so many slips and write the sample."""
    counts, accepted = sample(number)
    print(dict(counts))
    shown = random.Random(1).sample(accepted, min(100, len(accepted)))
    Path(path).write_text("\n".join(shown) + "\n", "utf-8")


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
