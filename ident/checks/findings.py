"""What a quality check is: its rule in ``data/checks.csv``, its evidence, its findings."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.run_table import excluded, excludes, run_table

if TYPE_CHECKING:
    from ident.captive.campaign import Campaign
    from ident.captive.histories import Reduced
    from sim.boat.vehicle import Vehicle

Array = NDArray[np.float64]
SEVERITIES = ("info", "warning", "error")
# Part of a run of the whole hull, named or not.
HULL = ("hull", "")
# An angle [rad] or a rate [rad/s] below this is none.
NONE = 1e-6


@dataclass(frozen=True)
class Finding:
    """One thing a check found.

    Attributes
    ----------
    check : Name of the check.
    severity : ``info``, ``warning`` or ``error``.
    file : File it stands in.
    rows : Rows of that file, the header being row 1; empty when it concerns the whole file.
    columns : Columns concerned.
    what : What was found, with numbers.
    remedy : What to do.

    Examples
    --------
    >>> import ident
    >>> (checked,) = ident.check("my-boat/captive")
    >>> finding = checked.findings[0]
    >>> finding.severity, finding.file.endswith((".csv", ".toml"))
    ('warning', True)
    """

    check: str
    severity: str
    file: str
    rows: tuple[int, ...]
    columns: tuple[str, ...]
    what: str
    remedy: str

    def as_json(self) -> dict[str, Any]:
        """The finding for a program to read."""
        return asdict(self) | {"rows": list(self.rows), "columns": list(self.columns)}

    def with_words(self, more: str) -> Finding:
        """The same finding with ``more`` words added to what was found."""
        return replace(self, what=self.what + more)

    @property
    def shown_rows(self) -> str:
        """Rows as ``2-5, 9``."""
        return spans(self.rows)


def spans(rows: Iterable[int]) -> str:
    """Row numbers as ``2-5, 9``."""
    ranges: list[list[int]] = []
    for row in sorted(set(rows)):
        if ranges and row == ranges[-1][1] + 1:
            ranges[-1][1] = row
        else:
            ranges.append([row, row])
    return ", ".join(f"{a}-{b}" if b > a else str(a) for a, b in ranges)


@dataclass(frozen=True)
class Rule:
    """One row of ``data/checks.csv``: severity, limits with their basis, remedy."""

    name: str
    title: str
    severity: str
    limits: dict[str, float]
    finds: str
    remedy: str
    basis: str

    def finding(
        self,
        file: str,
        rows: Iterable[int],
        columns: Sequence[str],
        what: str,
        severity: str = "",
    ) -> Finding:
        """A finding of this check, with the rule's severity unless another is given."""
        places = tuple(sorted({int(r) for r in rows}))
        return Finding(self.name, severity or self.severity, file, places, tuple(columns), what, self.remedy)


@cache
def rules() -> dict[str, Rule]:
    """Every check by name, from ``data/checks.csv``: the one list of checks."""
    with (files("ident") / "data" / "checks.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return {r["check"]: Rule(r["check"], r["title"], r["severity"], _limits(r), *_texts(r)) for r in rows}


def _limits(row: dict[str, str]) -> dict[str, float]:
    return {k: float(v) for k, v in (item.split(":") for item in row["limits"].split())}


def _texts(row: dict[str, str]) -> tuple[str, str, str]:
    return row["finds"], row["remedy"], row["basis"]


@dataclass(frozen=True)
class Body:
    """The tested body, at the scale of the run table.

    Attributes
    ----------
    length : Reference length L [m].
    density : Water density [kg/m^3].
    mass : Displaced mass [kg].
    inertia : Moments of inertia about x, y, z [kg m^2].
    draught : d [m] of a norm 1/2 rho L d; None for a submarine.
    file : File that states them.
    """

    length: float
    density: float
    mass: float | None = None
    inertia: tuple[float, float, float] | None = None
    draught: float | None = None
    file: str = ""


@dataclass(frozen=True)
class Evidence:
    """What checks look at; a check whose evidence is missing finds nothing.

    Attributes
    ----------
    runs : Run table as of ``Campaign.runs``; see ``run_table`` for a table of your own.
    body : The tested body.
    vehicle : For planes, their mirror and their position.
    campaign : The whole campaign, when the runs are one.
    fitted : Columns coefficient, part, worst (largest residual of its runs, in their standard errors), run.
    constants : Columns coefficient, part, value, stderr: what has no axis, of any part.
    tabulated : The same of coefficients with axes, a row a point.
    derivatives, reference : Columns coefficient, value, file, row; the second in the norm
        the first claims.
    labels : Columns sheet, column, description, file, row.
    configurations : Columns configuration, appendages, file, row.
    times : File or column name -> time stamps [s].
    histories : Reduced time histories, with their clocks and verdicts.
    tested_length : Length of the body the loads were measured on, at the body's scale [m].
    between : Error between facilities of each load (``ident.identification.facilities.Between``).
    folder : Where the campaign lies.
    memo : What two checks share, by name.
    """

    runs: pd.DataFrame = field(default_factory=lambda: run_table({}))
    body: Body | None = None
    vehicle: Vehicle | None = None
    campaign: Campaign | None = None
    fitted: pd.DataFrame | None = None
    constants: pd.DataFrame | None = None
    tabulated: pd.DataFrame | None = None
    derivatives: pd.DataFrame | None = None
    reference: pd.DataFrame | None = None
    labels: pd.DataFrame | None = None
    configurations: pd.DataFrame | None = None
    times: Mapping[str, Array] = field(default_factory=dict)
    histories: tuple[Reduced, ...] = ()
    tested_length: float | None = None
    between: Sequence[Any] = ()
    folder: Path | None = None
    memo: dict[str, Any] = field(default_factory=dict, init=False, repr=False)


# What only identified runs give: nobody else may say it to the checks.
OF_FIT = ("fitted", "constants", "tabulated", "derivatives", "between")


class NotYetError(Exception):
    """A check asks for what only identified runs give, before they are."""


class RunsAlone(Evidence):
    """Evidence before the runs are identified; a check that looks at what they give is told so.

    Raises
    ------
    NotYetError
        For what is of the fit: ``OF_FIT``.
    """

    def __getattribute__(self, name: str) -> Any:
        if name in OF_FIT:
            raise NotYetError(name)
        return super().__getattribute__(name)


Function = Callable[[Evidence, Rule], Iterable[Finding]]
_FUNCTIONS: dict[str, Function] = {}


def check(name: str) -> Callable[[Function], Function]:
    """Register a function for a row of ``data/checks.csv``; one check may have several."""
    if name not in rules():
        raise KeyError(f"data/checks.csv has no check {name!r}")

    def enter(function: Function) -> Function:
        _FUNCTIONS[function_name(name, function)] = function
        return function

    return enter


def registered() -> dict[str, list[Function]]:
    """The functions of every check, in the order of ``data/checks.csv``."""
    return {name: [f for k, f in _FUNCTIONS.items() if k.split(".")[0] == name] for name in rules()}


def function_name(name: str, function: Function) -> str:
    """The name of a function of a check."""
    return f"{name}.{getattr(function, '__name__', '')}"


def together(runs: pd.DataFrame) -> pd.Series:
    """What runs were made together: their file, or the glob of a source with a file a run."""
    if "files" not in runs:
        return runs["file"].astype(str)
    return runs["file"].astype(str).where(runs["files"].isna() | (runs["files"] == ""), runs["files"]).astype(str)


def rows_of(group: pd.DataFrame) -> list[int]:
    """Rows of runs that stand in one file; none where each has a file of its own."""
    return [int(r) for r in group["row"]] if group["file"].nunique() == 1 else []


def printed_place(runs: pd.DataFrame, names: Sequence[str], part: str = "") -> tuple[str, list[int]]:
    """File and rows of published values, of a part alone where it is named; of identified ones no rows."""
    printed = runs[runs["coefficient"].isin(names)] if "coefficient" in runs else runs.iloc[:0]
    printed = printed[printed["part"] == part] if part else printed
    if printed["file"].nunique() != 1:
        return "identified coefficients", []
    return str(printed["file"].iloc[0]), rows_of(printed)


def dynamic(runs: pd.DataFrame, body: Body) -> pd.Series:
    """1/2 rho (U^2 + (Omega L)^2) L^2 [N] of every run; NaN for a body at rest."""
    rate2 = sum(runs[c].fillna(0.0) ** 2 for c in ("p", "q", "r"))
    pressure = 0.5 * body.density * body.length**2 * (runs["U"].fillna(0.0) ** 2 + rate2 * body.length**2)
    return pressure.where(pressure > 0.0)


def prime(runs: pd.DataFrame, output: str, body: Body) -> pd.Series:
    """Dimensionless load of every run: forces over ``dynamic``, moments over that times L."""
    return runs[output] / dynamic(runs, body) / (1.0 if output in "XYZ" else body.length)


def of_air(density: float) -> bool:
    """Whether a density [kg/m^3] is that of a wind tunnel, whose speeds keep no law of Froude's."""
    return density < rules()["fluid"].limits["air_high"]


def kept(runs: pd.DataFrame, output: str) -> pd.Series:
    """True where a load is given and not excluded by the campaign."""
    given = runs[output].notna()
    return given & ~excluded(runs, output) if excludes(runs, output) else given


def factors(evidence: Evidence, runs: pd.DataFrame) -> pd.Series:
    """Factor that the campaign's quality word puts on the standard error of each run."""
    known = evidence.campaign.header.quality if evidence.campaign else {}
    return runs["quality"].map({k: q.factor for k, q in known.items()}).astype(float).fillna(1.0)


def declared(evidence: Evidence, runs: pd.DataFrame) -> pd.Series:
    """True for runs that the campaign itself already trusts less."""
    return factors(evidence, runs) > 1.0


def milder(rule: Rule, known: bool) -> str:
    """The rule's severity, one step less when the campaign already says so."""
    return SEVERITIES[max(SEVERITIES.index(rule.severity) - 1, 0)] if known else rule.severity
