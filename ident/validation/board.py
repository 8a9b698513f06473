"""The scoreboard as values: every case of a version, each error beside that of other versions and models."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from ident.output import html_table
from ident.validation.coverage import used_rows
from ident.validation.reliability import Reliability, mean_shares, ranks, reliability
from sim.boat.database import version_words
from sim.boat.delta_log import Origin

if TYPE_CHECKING:
    import pandas as pd

    from ident.validation.result import ChannelError, Validation


def geometric_mean(ratios: list[float]) -> float | None:
    """Geometric mean of positive numbers; None of none."""
    return math.exp(sum(math.log(r) for r in ratios) / len(ratios)) if ratios else None


@dataclass(frozen=True)
class ComparedError:
    """How far a flight is from one channel of one reference, and how far other versions of the boat are.

    Attributes
    ----------
    error : Of the version, beside the published model.
    parent_rmse : Of the version that it came from, in the same unit; None without one.
    measured_only_rmse : Of what the runs alone gave; None where the version has no estimates.

    Examples
    --------
    >>> import ident
    >>> ident.ComparedError(ident.ChannelError(1.5, "deg", 40), parent_rmse=3.0).ratio_to_parent
    0.5
    """

    error: ChannelError
    parent_rmse: float | None = None
    measured_only_rmse: float | None = None

    @property
    def ratio_to_parent(self) -> float | None:
        """Error over that of the parent version; None without one."""
        return self.error.rmse / self.parent_rmse if self.parent_rmse else None

    def to_dict(self) -> dict[str, Any]:
        """The error for a program to read."""
        return self.error.to_dict() | {
            "parent_rmse": self.parent_rmse,
            "ratio_to_parent": self.ratio_to_parent,
            "measured_only_rmse": self.measured_only_rmse,
        }


@dataclass(frozen=True)
class Parent:
    """The version that a vehicle's coefficients came from.

    Attributes
    ----------
    version, digest : Its number, and SHA-256 of its rows.
    """

    version: int
    digest: str


@dataclass(frozen=True)
class BoardCase:
    """One case of the scoreboard.

    Attributes
    ----------
    name : Of the case.
    database : Path, version and digest of the vehicle's coefficients.
    trained : Whether the version was calibrated on the case, or on any source of it.
    parent : What the coefficients came from; None when they are the first.
    errors : Source -> channel -> error.
    validation : The flight; None where there was none.
    failed : Why there was none: no state of self-propulsion to start from.

    Examples
    --------
    >>> import ident
    >>> case = ident.BoardCase("zigzag", {"version": 0}, trained=False, failed="no self-propulsion")
    >>> case.to_dict()["failed"]
    'no self-propulsion'
    """

    name: str
    database: Origin
    trained: bool
    parent: Parent | None = None
    errors: dict[str, dict[str, ComparedError]] | None = None
    validation: Validation | None = None
    failed: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """The case for a program to read: as ``Validation.to_dict``, with ``parent`` and ``trained``.

        ``rows`` names the values behind the flight: term to places among the version's rows of the vehicle.
        """
        if self.validation is None:
            nothing: dict[str, Any] = {"references": {}, "metrics": {}, "outside_tables": [], "passed": False}
            plain = {"case": self.name, "database": self.database, **nothing, "failed": self.failed}
        else:
            plain = self.validation.to_dict()
            done = self.validation
            plain["rows"] = used_rows(done.simulation, done.boat.coefficients, done.boat.model(done.case))
            plain["references"] = {
                source: {channel: e.to_dict() for channel, e in channels.items()}
                for source, channels in (self.errors or {}).items()
            }
        return plain | {"parent": asdict(self.parent) if self.parent else None, "trained": self.trained}


class Comparison(NamedTuple):
    """One error of a board, with its place."""

    case: BoardCase
    source: str
    channel: str
    compared: ComparedError


def comparisons(cases: Iterable[BoardCase]) -> Iterator[Comparison]:
    """Every error of some cases of a board."""
    for case in cases:
        for source, channels in (case.errors or {}).items():
            for channel, compared in channels.items():
                yield Comparison(case, source, channel, compared)


@dataclass(frozen=True)
class ByTraining:
    """Geometric mean of a ratio over the cases that a version was trained on, and over the others; None of none."""

    trained: float | None
    untrained: float | None


@dataclass(frozen=True)
class ByVersion:
    """Geometric mean of the error ratios to the published model, by what the coefficients are from; None of none."""

    measured_only: float | None
    predicted: float | None
    calibrated: float | None


@dataclass(frozen=True, order=True)
class WorstRatio:
    """The comparison with the largest ratio to the published model."""

    ratio: float
    case: str
    source: str
    channel: str


@dataclass(frozen=True)
class Scoreboard:
    """Every case flown from one version.

    Attributes
    ----------
    database : Path, version and digest.
    cases : In the order they were asked for.
    trained_on : Vehicle -> what its coefficients were trained on: names of cases, or case:source.
    passed_over : Files of the folder of cases that are none -> what they are.

    Examples
    --------
    >>> import ident
    >>> board = ident.scoreboard(db="coeff_db", cases="my-boat")
    >>> [case.name for case in board.cases], board.table["rmse"].gt(0.0).all().item()
    (['my-zigzag'], True)
    >>> list(board.passed_over.values())
    ['calibration', 'vehicle']
    """

    database: Origin
    cases: tuple[BoardCase, ...]
    trained_on: dict[str, list[str]]
    passed_over: dict[str, str] = field(default_factory=dict)

    @property
    def flown(self) -> list[Validation]:
        """The validations; a case without a state to start from is not among them."""
        return [case.validation for case in self.cases if case.validation is not None]

    @cached_property
    def comparisons(self) -> tuple[Comparison, ...]:
        """Every error of the board."""
        return tuple(comparisons(self.cases))

    @property
    def table(self) -> pd.DataFrame:
        """One row a case, source and channel: the fields of ``ComparedError.to_dict``."""
        import pandas as pd

        rows = {(c.case.name, c.source, c.channel): c.compared.to_dict() for c in self.comparisons}
        index = pd.MultiIndex.from_tuples(list(rows), names=["case", "source", "channel"]) if rows else None
        return pd.DataFrame(list(rows.values()), index=index)

    def __repr__(self) -> str:
        return f"Scoreboard({len(self.cases)} cases; {version_words(self.database)})"

    def _repr_html_(self) -> str:
        rows = [
            (c.case.name, c.source, c.channel, f"{e.rmse:.4g}", e.unit, None if e.ratio is None else f"{e.ratio:.2f}")
            for c in self.comparisons
            for e in (c.compared.error,)
        ]
        heads = ("case", "reference", "channel", "RMSE", "unit", "ratio to published model")
        return html_table(f"{len(self.cases)} cases; {version_words(self.database)}", heads, rows)

    @property
    def mean_ratio(self) -> ByTraining:
        """Of the error ratios to the published model."""
        return self._means([(c.case.trained, c.compared.error.ratio) for c in self.comparisons])

    @property
    def mean_ratio_to_parent(self) -> ByTraining:
        """Of the error ratios to the parent version."""
        return self._means([(c.case.trained, c.compared.ratio_to_parent) for c in self.comparisons])

    @staticmethod
    def _means(ratios: list[tuple[bool, float | None]]) -> ByTraining:
        trained, untrained = (geometric_mean([r for t, r in ratios if t is of and r]) for of in (True, False))
        return ByTraining(trained, untrained)

    @property
    def mean_ratio_by_version(self) -> ByVersion:
        """Of measured-only, predicted and calibrated coefficients; the parent of a calibrated version is predicted."""
        calibrated = any(self.trained_on.values())
        rated = [c.compared for c in self.comparisons if c.compared.error.published_model_rmse]

        def mean(errors: list[float | None]) -> float | None:
            published = [c.error.published_model_rmse for c in rated]
            return geometric_mean([e / p for e, p in zip(errors, published, strict=True) if e and p])

        of_version, parent = [c.error.rmse for c in rated], [c.parent_rmse for c in rated]
        return ByVersion(
            measured_only=mean([c.measured_only_rmse for c in rated]),
            predicted=mean(parent if calibrated else [*of_version]),
            calibrated=mean([*of_version]) if calibrated else None,
        )

    @property
    def worst_ratio(self) -> WorstRatio | None:
        """None where no published model stands beside."""
        rated = [c for c in self.comparisons if c.compared.error.ratio]
        if not rated:
            return None
        return max(WorstRatio(c.compared.error.ratio or 0.0, c.case.name, c.source, c.channel) for c in rated)

    def with_validations(self, done: list[Validation]) -> Scoreboard:
        """The same board with other flights of its cases, ``done`` with error bands."""
        by_name = {one.case.name: one for one in done}
        cases = [replace(case, validation=by_name.get(case.name, case.validation)) for case in self.cases]
        return replace(self, cases=tuple(cases))

    @cached_property
    def coverage(self) -> dict[str, float] | None:
        """Level -> share of all references inside the band; None without bands or references."""
        return mean_shares(one.band_summary.inside for one in self.flown if one.band_summary)

    @cached_property
    def reliability(self) -> list[Reliability]:
        """Share of all references inside the band of each level; empty without bands or references."""
        return reliability(r for one in self.flown if one.bands for r in ranks(one.bands, one.case, one.reference))

    def to_dict(self) -> dict[str, Any]:
        """The board for a program to read, as ``ident validate --all --json`` prints it."""
        worst = self.worst_ratio
        plain = {
            "database": self.database,
            "cases": [case.to_dict() for case in self.cases],
            "geometric_mean_ratio": asdict(self.mean_ratio),
            "geometric_mean_ratio_to_parent": asdict(self.mean_ratio_to_parent),
            "geometric_mean_ratio_of": asdict(self.mean_ratio_by_version),
            "trained_on": self.trained_on,
            "worst_ratio": asdict(worst) if worst else None,
        }
        if self.passed_over:
            plain["passed_over"] = self.passed_over
        if any(one.bands for one in self.flown):
            plain |= {"coverage": self.coverage, "reliability": [asdict(point) for point in self.reliability]}
        return plain
