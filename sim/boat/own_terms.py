"""The terms that a vehicle adds to its set, from a CSV file beside its own.

A row is held against itself and against the set before anything is fitted: a term that the set has
already under another name would take both coefficients away (no run can tell them apart), one without a
test, or one that the port/starboard mirror makes zero, would never be found.
"""

from __future__ import annotations

import csv
import math
from functools import cache

from sim.boat import catalogue
from sim.boat.catalogue import ACCELERATIONS, MIRRORED_FACTORS, OUTPUTS, PLANE_FEATURES, CatalogueError, Term
from sim.boat.forces import boat_features, multiplier
from sim.files.errors import InputError

# Columns of a vehicle's own term file; the others of the table are the defaults below.
COLUMNS = ("name", "output", "power", "multiplier", "part", "test")
_DEFAULTS = {
    "group": "own",
    "norm": "rho/2 L",
    "axes": "",
    "parity": "",
    "extrapolation": "",
    "equation": "",
    "share_of": "",
    "note": "",
}
# Exponents of length and time of the factors that are not m/s.
_DIMENSIONS = (
    dict.fromkeys(("p", "q", "r", "|p|", "|q|", "|r|", "n", "|n|"), (0, -1))
    | dict.fromkeys(("up", "uq", "ur", "vp", "vq", "vr", "wp", "wq", "wr", "udot", "vdot", "wdot"), (1, -2))
    | dict.fromkeys(("pq", "qr", "rp", "pdot", "qdot", "rdot"), (0, -2))
    | dict.fromkeys(("sgn(v)", "sgn(w)", "alpha", "beta", "J", "v/U", "slip", "delta", "deflection"), (0, 0))
    | {"r/U": (-1, 0), "v/r": (1, 0), "w/q": (1, 0), "D0": (1, 0)}
)
# States at which two products of factors are compared: any, with every sign; ahead, as the runs of a tank are.
_SIDES = ((1, 1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, 1), (-1, 1, -1), (2, -1, -1))
_STATES = tuple(
    ((2.0 + 0.3 * k, 0.31 * a, -0.17 * b), (0.11 * b, 0.05 * c, -0.07 * a * c)) for k, (a, b, c) in enumerate(_SIDES)
)


@cache
def own_terms(path: str, term_set: str, changed: int = 0) -> tuple[Term, ...]:
    """Rows that a vehicle adds to its term set, from a CSV file beside its own.

    Parameters
    ----------
    path : Of the file: columns ``name output power multiplier part test``, perhaps others of ``data/terms.csv``.
    term_set : The set they are added to.
    changed : Time of its last change, so that a file is read again after one.

    Raises
    ------
    InputError
        For a file that cannot be read, a column that is missing or unknown, a name or a product of the set, or
        a row that contradicts itself.
    """
    rows = _rows(path)
    terms_of_file: list[Term] = []
    taken = list(catalogue.terms(term_set))
    for number, row in enumerate(rows, start=2):
        place = f"{path}, row {number}"
        given = {k: (v or "").strip() for k, v in row.items() if isinstance(k, str)}
        if given["name"] in {t.name for t in taken}:
            raise InputError(f"{place}, column name", repr(given["name"]), f"a name the set {term_set} does not have")
        if given["output"] not in OUTPUTS or not given["power"].isdigit() or not 0 < int(given["power"]) < 10:
            raise InputError(
                place, f"output {given['output']}, power {given['power']}", "X Y Z K M N and a whole number"
            )
        made = catalogue.read_term({**_DEFAULTS, "sets": term_set, **given})
        try:
            catalogue.check(made)
        except CatalogueError as error:
            text = "factors, axes and parities as in data/terms.csv, joined by *"
            raise InputError(place, str(error), text) from error
        _usable(made, taken, place)
        taken.append(made)
        terms_of_file.append(made)
    if not terms_of_file:
        raise InputError(path, "no row", "at least one term")
    return tuple(terms_of_file)


def _rows(path: str) -> list[dict[str, str]]:
    """The rows of the file, each with the columns that it needs and no others than there are."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as stream:
            rows = list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(path, f"cannot be read: {error}", "a CSV file of terms in UTF-8") from error
    known = (*COLUMNS, *_DEFAULTS)
    for number, row in enumerate(rows, start=2):
        wrong = [k for k in row if k not in known] + [c for c in COLUMNS if not (row.get(c) or "").strip()]
        if wrong:
            found = "nothing" if wrong[0] in row and wrong[0] in known else "unknown or not there"
            names = f"columns {', '.join(known)}, with commas between"
            raise InputError(f"{path}, row {number}, column {str(wrong[0])[:60]}", found, names)
    return rows


def _usable(made: Term, taken: list[Term], place: str) -> None:
    """Refuse a term that no run could give, or that is there already."""
    known = sorted({test for name in catalogue.SETS for t in catalogue.terms(name) for test in t.tests})
    for test in made.tests:
        if test not in known:
            raise InputError(f"{place}, column test", repr(test), f"tests of runs: {', '.join(known)}")
    of_plane = [f for f in made.factors if f in PLANE_FEATURES]
    if of_plane and made.part in ("hull", "section", "propeller"):
        text = f"a plane as the part that carries it: {of_plane[0]} is that of one plane"
        raise InputError(f"{place}, column part", repr(made.part), text)
    if made.part == "hull" and not made.axes and made.mirror_sign() < 0:
        text = f"a product that a boat of two like sides can have in {made.output}: "
        text += f"{_odd(made)}; its mirror image makes the coefficient zero"
        raise InputError(f"{place}, column multiplier", made.multiplier, text)
    _dimensions(made, place)
    for other in taken:
        if (other.output, other.part) == (made.output, made.part) and not made.axes and _alike(made, other):
            text = "another product: no run can tell two coefficients of one product from each other"
            raise InputError(f"{place}, column multiplier", f"{made.multiplier}, which is {other.name}'s", text)


def _odd(made: Term) -> str:
    """What the factors that change sign with the side would have to be."""
    mirrored = [f for f in made.factors if f in MIRRORED_FACTORS]
    even = made.output in ("X", "Z", "M")
    words = "an even number of factors that change sign with the side"
    return words if even else words.replace("even", "odd") + (f", as {mirrored[0]}*|{mirrored[0]}|" if mirrored else "")


def _dimensions(made: Term, place: str) -> None:
    """The product has to be a load over density and a power of length, or the coefficient depends on the scale."""
    if not made.norm.startswith("rho"):
        return
    length, time = (sum(_DIMENSIONS.get(f, (1, -1))[i] for f in made.factors) for i in (0, 1))
    if time != -2:
        text = f"a product in 1/s^2, so that the coefficient has no unit: v*v*v is v*v*v/U; not 1/s^{-time}"
        raise InputError(f"{place}, column multiplier", made.multiplier, text)
    power = (4 if made.output in "XYZ" else 5) - length
    if made.power != power:
        text = f"{power}: {made.output} over 1/2 rho {made.multiplier} is a length to that power"
        raise InputError(f"{place}, column power", str(made.power), text)


def _alike(one: Term, other: Term) -> bool:
    """Whether two products are the same but for a number, ahead and at any drift and turn."""
    if other.axes or (set(one.factors) & {*ACCELERATIONS, *PLANE_FEATURES, "n", "|n|", "J", "slip", "uslip"}):
        return sorted(one.factors) == sorted(other.factors) and not other.axes
    ratios = []
    for velocity, rates in _STATES:
        features = boat_features(velocity, rates, 30.0)
        a, b = multiplier(one, features), multiplier(other, features)
        if math.isnan(b) or b == 0.0 or a == 0.0:
            return False
        ratios.append(a / b)
    return max(ratios) - min(ratios) <= 1e-9 * abs(ratios[0])
