"""What a campaign states of the runs of a file, beside the file: constants, names in paths, limits of use."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pandas as pd

from ident.captive.headers import column
from ident.captive.other_loads import quantity_of
from ident.captive.patterns import search
from ident.captive.quantities import owner, suffixed
from ident.captive.readers.text import Dialect
from ident.captive.run_table import DIRECT, STATES, TEXT
from ident.captive.source import Source
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError

_PLAIN = Dialect()


# By how much of itself a limit of [source.within] is widened.
_SLACK = 1e-9


# Signs and decimal points as file names have them: m08, p08, n4, neg4, plus4, 04p5, 4,5, 0d5 (which is no 0e5).
_IN_NAMES = re.compile(r"(?P<sign>[mpnMPN+-]?|[Mm]inus|[Pp]lus|[Nn]eg|[Pp]os)_?(?P<whole>\d+)(?:[pPdD,](?P<part>\d+))?")


def outside_excluded(table: pd.DataFrame, source: Source, where: str) -> pd.DataFrame:
    """Runs with every load excluded where their state is outside ``[source.within]``.

    Parameters
    ----------
    table : Runs in SI, in the campaign's own frame.
    source : Its ``within``: state with a suffix unit -> lowest and highest value.
    where : The campaign file.

    Returns
    -------
    ``table`` with ``exclude`` and ``reason`` filled in for these runs, so that fit and checks
    leave them out and say why.

    Raises
    ------
    InputError
        For a state that is not one, has no unit, or that no run of the files gives.
    """
    out = table
    for name, (low, high) in source.within.items():
        place = f"{where}, key source.within.{name}"
        if name not in suffixed() or suffixed()[name][0] not in STATES:
            known = ", ".join(c for c, (q, _) in suffixed().items() if q in ("U", "alpha", "beta", "r"))
            raise InputError(place, "no state of a run with its unit", known + " and the like")
        quantity, factor = suffixed()[name]
        if quantity not in out or out[quantity].isna().all():
            raise InputError(place, f"no {quantity} in the runs of {source.files}", "a state that the runs give")
        value = out[quantity].astype(float)
        # A limit that stands in the file in other digits is still inside.
        slack = _SLACK * max(abs(low), abs(high)) * factor
        outside = (value < low * factor - slack) | (value > high * factor + slack)
        loads = " ".join(o for o in (*OUTPUTS, *DIRECT) if o in out)
        out = out.assign(
            exclude=out["exclude"].mask(outside, loads),
            reason=out["reason"].mask(outside, f"{name} beyond {low:g} to {high:g}"),
        )
    return out


def constants(
    folder: Path, path: Path, source: Source, of_many: str = ""
) -> tuple[dict[str, str], dict[str, float], set[str]]:
    """What the campaign says of every run of a file: ``constants``, and ``match`` on its path.

    Parameters
    ----------
    folder : The campaign's.
    path, source : A file of one ``[[source]]``.
    of_many : The table that is read, where ``table`` stands for several; behind the path for ``match``.

    Returns
    -------
    words : Text columns.
    numbers : Quantities in SI.
    primed : Those that are dimensionless.

    Raises
    ------
    InputError
        For a path that does not match, an unknown quantity, or no finite number.
    """
    toml = str(folder / "campaign.toml")
    where = f"{toml}, key source.constants"
    given: dict[str, Any] = dict(source.constants)
    if source.match:
        name = path.relative_to(folder).as_posix() + (f"/{of_many}" if of_many else "")
        hit = search(source.match, name)
        if not hit:
            raise InputError(f"{folder / 'campaign.toml'}, key source.match", f"{name!r} does not match", source.match)
        named = {k: v for k, v in hit.groupdict().items() if v is not None}
        given |= {k: _of_name(k, v, name[: hit.start(hit.re.groupindex[k])], toml) for k, v in named.items()}
    words: dict[str, str] = {}
    numbers: dict[str, float] = {}
    primed: set[str] = set()
    for key, value in given.items():
        if key in TEXT:
            words[key] = str(value).strip()
            continue
        place = f"{where}.{key}"
        if key in suffixed() or not isinstance(value, str):
            kind = column(key, None, where)
            number = _PLAIN.number(str(value))
            if number is None:
                raise InputError(place, repr(str(value)[:60]), "a finite number")
            numbers[kind.quantity] = number * kind.factor
            primed |= {kind.quantity} if kind.primed else set()
        elif owner(key):
            # A standard error is a column of its load's name: sigma_Y is s_Y.
            numbers[key.replace("sigma_", "s_", 1) if key.startswith("sigma_") else key] = quantity_of(
                value, owner(key), place
            )
        else:
            raise InputError(place, repr(value[:60]), "a quantity, or one of " + ", ".join(TEXT))
    return words, numbers, primed


def signed(quantity: str) -> bool:
    """Whether a quantity may be below zero."""
    return quantity not in ("U", "D0", "rel_sigma", "KT", "KQ", "time", "frequency") and not quantity.startswith("s_")


def _of_name(key: str, text: str, before: str, where: str) -> str:
    """A number out of a path with its sign and point as file names write them; other text as it is.

    Raises
    ------
    InputError
        For a mark of a sign right before the digits that the group leaves out.
    """
    if key in TEXT or not re.search(r"\d", text):
        return text
    quantity = suffixed()[key][0] if key in suffixed() else key
    mark = re.search(r"(?:^|[^A-Za-z])([mpnMPN])$", before)
    if mark and text[:1].isdigit() and signed(quantity):
        misplaced = f"{mark[1]!r} right before {text!r}, outside of the group {key}"
        raise InputError(f"{where}, key source.match", misplaced, f"(?P<{key}>[mp]?...): m and n are minus, p is plus")
    hit = _IN_NAMES.fullmatch(text)
    if hit is None:
        return text
    sign = "-" if hit["sign"] and hit["sign"][0] in "mMnN-" else ""
    return f"{sign}{hit['whole']}" + (f".{hit['part']}" if hit["part"] else "")


Stated = tuple[dict[str, str], dict[str, float], set[str]]
