"""The term table: one declarative row for every hydrodynamic coefficient.

Every load is a sum of terms (Kim 2021, Eqs. 17-31, restated)::

    F_c = sum_j 1/2 rho L^n_j C_j(axes_j) m_j(state)

The rows live in ``data/terms.csv`` and the axes in ``data/axes.csv``. The forward
model, the normalisation, the decoupling, the database schema and the report are all
read from here; adding a coefficient is adding a row.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

OUTPUTS = ("X", "Y", "Z", "K", "M", "N")
# The state in its order: velocities in the body frame, position and angles in the earth frame.
STATES = ("u", "v", "w", "p", "q", "r", "x", "y", "z", "phi", "theta", "psi")
# Extrapolation rules of an axis; ``sim.boat.tables`` implements them.
RULES = {
    "hold": "the value at the last point",
    "linear": "the coefficient goes on straight",
    "linear_load": "coefficient times axis goes on straight, so the coefficient tends to a constant",
    "drift_odd": "in-plane form of Eq. (25) through all runs of a side, from the last run on, to 90 deg",
    "drift_even": "out-of-plane form of Eq. (25) with value and slope of the last two runs, to 90 deg",
    "absent": "no coefficient on a side without runs",
}

# Sign of each output and state factor under the port/starboard mirror.
MIRROR_OUTPUT = {"X": 1, "Y": -1, "Z": 1, "K": -1, "M": 1, "N": -1}
MIRRORED_FACTORS = {"v", "p", "r", "sgn(v)", "v/U", "r/U", "deflection", "vdot", "pdot", "rdot", "beta"}
MIRRORED_FACTORS |= {"up", "ur", "vq", "wp", "wr", "pq", "qr"}

# Everything a multiplier or an axis may name, in the order of the state-feature vector
# that the forward model fills. ``S`` is sqrt(v^2 + w^2); ``V``, ``delta_c`` and ``delta``
# belong to one plane and stand after these, see ``feature_index``.
BOAT_FEATURES = (
    *("u", "v", "w", "p", "q", "r", "|u|", "|v|", "|w|", "|p|", "|q|", "|r|"),
    *("U", "S", "sgn(v)", "sgn(w)", "alpha", "beta", "D0", "n", "|n|", "J"),
    *("up", "uq", "ur", "vp", "vq", "vr", "wp", "wq", "wr", "pq", "qr", "rp"),
    *("v/U", "r/U", "v/r", "w/q", "slip", "uslip"),
)
# Rates below this [rad/s] have no pivot v/r or w/q: what depends on it has vanished with the rate.
STILL = 1e-9
PLANE_FEATURES = ("V", "delta", "deflection")
# What a value that is no load may be a part of.
SHARES = ("", "thrust", "speed")
ACCELERATIONS = ("udot", "vdot", "wdot", "pdot", "qdot", "rdot")


class CatalogueError(ValueError):
    """A row of the term table contradicts itself."""


@dataclass(frozen=True)
class TermSet:
    """What holds for all terms of a set.

    Attributes
    ----------
    name : As a vehicle file states it.
    tabulated : Whether coefficients are tables over speed, angles and depth: derivatives then depend on them.
    constant : Whether the axes of its rows are dropped but for those of propulsion.
    rudder : Whether loads of a rudder come from its size and the propeller's wash.
    meaning, source : For people.
    """

    name: str
    tabulated: bool
    constant: bool
    rudder: bool
    meaning: str
    source: str


@cache
def term_sets() -> dict[str, TermSet]:
    """All term sets by name, from ``data/term_sets.csv``."""
    rows = csv.DictReader((files("sim") / "data" / "term_sets.csv").read_text("utf-8").splitlines())
    return {
        row["name"]: TermSet(
            name=row["name"],
            tabulated=row["tabulated"] == "yes",
            constant=row["constant"] == "yes",
            rudder=row["rudder"] == "yes",
            meaning=row["meaning"],
            source=row["source"],
        )
        for row in rows
    }


SETS = tuple(term_sets())


@dataclass(frozen=True)
class Axis:
    """One tabulation axis: its database column, unit, sign under the mirror, and the schema it came with."""

    name: str
    column: str
    unit: str
    mirror: int
    since: int
    meaning: str


@dataclass(frozen=True)
class Term:
    """One row of the term table.

    Attributes
    ----------
    name : Symbol in Gertler-Hagen/Feldman style, unique within a set.
    sets : Term sets the row belongs to, of ``SETS``.
    group : Physical group, for reports.
    output : Load component ``X Y Z`` [N] or ``K M N`` [N m]; empty for what is no load of its own, as ``t``.
    power : Power of the reference length.
    norm : ``rho/2 L`` (1/2 rho L^n), ``rho D`` (rho D^n), ``SI`` (the load over the monomial, with its
        dimension) or empty (the value itself).
    factors : Factors of the monomial m(state).
    sign : +1 or -1 in front of the monomial.
    part : Part of the boat that carries the load.
    axes : Names of the tabulation axes, in order.
    parity : Axis name -> +1 even / -1 odd under the port/starboard mirror.
    extrapolation : Axis name -> rule beyond the tabulated range, one of ``RULES``.
    tests : Captive tests that identify the coefficient.
    equation : Equation numbers of Kim (2021) (errata applied).
    share_of : What the value is a part of, ``thrust`` or ``speed``, so that its size is below 1; else empty.
    note : Free text.
    """

    name: str
    sets: tuple[str, ...]
    group: str
    output: str
    power: int
    norm: str
    factors: tuple[str, ...]
    sign: int
    part: str
    axes: tuple[str, ...]
    parity: dict[str, int]
    extrapolation: dict[str, str]
    tests: tuple[str, ...]
    equation: str
    share_of: str
    note: str

    @property
    def multiplier(self) -> str:
        """The monomial as written in the table."""
        return ("-" if self.sign < 0 else "") + "*".join(self.factors)

    @property
    def is_acceleration(self) -> bool:
        """True for added-mass terms, which belong on the left-hand side."""
        return bool(self.factors) and self.factors[0] in ACCELERATIONS

    def scale(self, rho: float, length: float, diameter: float) -> float:
        """Dimensional factor in front of the coefficient.

        Parameters
        ----------
        rho : Water density [kg/m^3].
        length : Reference length L [m].
        diameter : Propeller diameter D [m].

        Returns
        -------
        1/2 rho L^n, rho D^n or 1, by ``norm``.
        """
        if self.norm == "rho/2 L":
            return 0.5 * rho * length**self.power
        return rho * diameter**self.power if self.norm == "rho D" else 1.0

    def mirror_sign(self) -> int:
        """Sign of the coefficient under the port/starboard mirror, axes turned too."""
        sign = MIRROR_OUTPUT.get(self.output, 1)
        for factor in self.factors:
            sign *= -1 if factor in MIRRORED_FACTORS else 1
        return sign


def _pairs(text: str) -> dict[str, str]:
    return dict(item.split(":", 1) for item in text.split())


@cache
def axes() -> dict[str, Axis]:
    """All tabulation axes by name, from ``data/axes.csv``."""
    with (files("sim") / "data" / "axes.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return {
        r["axis"]: Axis(
            r["axis"], r["column"], r["unit"], 1 if r["mirrors"] == "+" else -1, int(r["since"]), r["meaning"]
        )
        for r in rows
    }


def read_term(row: dict[str, str]) -> Term:
    """A row of the term table, or of a vehicle's own term file, not yet checked."""
    text = row["multiplier"]
    parity = {a: 1 if v == "even" else -1 for a, v in _pairs(row["parity"]).items()}
    return Term(
        name=row["name"],
        sets=tuple(row["sets"].split()),
        group=row["group"],
        output=row["output"],
        power=int(row["power"]),
        norm=row["norm"],
        factors=tuple(text.lstrip("-").split("*")) if text else (),
        sign=-1 if text.startswith("-") else 1,
        part=row["part"],
        axes=tuple(row["axes"].split()),
        parity=parity,
        extrapolation=_pairs(row["extrapolation"]),
        tests=tuple(row["test"].split()),
        equation=row["equation"],
        share_of=row["share_of"],
        note=row["note"],
    )


def check(term: Term) -> None:
    """Refuse a row that contradicts itself.

    Raises
    ------
    CatalogueError
        For an unknown axis, factor, rule or set, or a parity that the port/starboard
        mirror does not give.
    """
    known = {*BOAT_FEATURES, *PLANE_FEATURES, *ACCELERATIONS}
    problems = [f"factor {f!r}" for f in term.factors if f not in known]
    problems += [f"axis {a!r}" for a in term.axes if a not in axes()]
    problems += [f"set {s!r}" for s in term.sets if s not in SETS]
    problems += [f"rule {r!r}" for r in term.extrapolation.values() if r not in RULES]
    if set(term.extrapolation) != set(term.axes):
        problems.append("an extrapolation rule for each axis and no other")
    if term.share_of not in SHARES or (term.share_of and term.output):
        problems.append(f"share of {term.share_of!r}, one of {', '.join(SHARES[1:])} of a row that is no load")
    # The angle of a plane is mirrored to that of its image, ``sim.boat.parts``.
    if "delta" not in term.axes:
        turned = {a: term.mirror_sign() for a in term.axes if a in axes() and axes()[a].mirror < 0}
        if turned != term.parity:
            problems.append(f"parity {term.parity}, the mirror gives {turned}")
    if problems:
        raise CatalogueError(f"term table, row {term.name}: {'; '.join(problems)}")


@cache
def terms(term_set: str) -> tuple[Term, ...]:
    """The rows of one term set, in table order.

    Parameters
    ----------
    term_set : ``reduced`` (Eqs. 26-31, tables) or ``gertler_hagen`` (Eqs. 17-22,
        constant coefficients: all axes but J and those of t are dropped), ``mmg`` (ships
        in surge, sway and yaw: constant coefficients of Yasukawa and Yoshimura 2015), ``auv``
        (slender vehicles as Prestero 2001 and da Silva et al. 2007 write them) or ``nps_auv``
        (Healey and Lienard 1993).

    Raises
    ------
    CatalogueError
        For an unknown set, a repeated name or an inconsistent row.
    """
    if term_set not in SETS:
        raise CatalogueError(f"unknown term set {term_set!r}; known: {', '.join(SETS)}")
    with (files("sim") / "data" / "terms.csv").open(encoding="utf-8") as stream:
        rows = [read_term(r) for r in csv.DictReader(stream)]
    chosen = [t for t in rows if term_set in t.sets]
    names = [t.name for t in chosen]
    if len(names) != len(set(names)):
        raise CatalogueError(f"term table: a name stands twice in the set {term_set!r}")
    for term in chosen:
        check(term)
    if term_sets()[term_set].constant:
        chosen = [t if t.group == "propulsion" else replace(t, axes=(), parity={}, extrapolation={}) for t in chosen]
    return tuple(chosen)


@cache
def term(name: str, term_set: str) -> Term:
    """One row by name. Raises ``CatalogueError`` when the set has no such row."""
    for row in terms(term_set):
        if row.name == name:
            return row
    raise CatalogueError(f"the set {term_set!r} has no term {name!r}")


@cache
def held(term_set: str) -> tuple[str, ...]:
    """Loads that no row of a set has: the motions they would drive are held.

    Examples
    --------
    >>> held("mmg")
    ('Z', 'K', 'M')
    """
    there = {t.output for t in terms(term_set)}
    return tuple(o for o in OUTPUTS if o not in there)


def feature_index(factor: str, plane: int = -1) -> int:
    """Position of a factor or axis in the feature vector of the forward model.

    Parameters
    ----------
    factor : Name in ``BOAT_FEATURES`` or ``PLANE_FEATURES``.
    plane : Index of the plane that carries the term, for plane features.
    """
    if factor in PLANE_FEATURES:
        return len(BOAT_FEATURES) + len(PLANE_FEATURES) * plane + PLANE_FEATURES.index(factor)
    return BOAT_FEATURES.index(factor)
