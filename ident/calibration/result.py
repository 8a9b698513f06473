"""What a calibration gives: priors and posteriors of every group, the series, what was left out."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from ident.output import html_table
from ident.text import on_screen

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

    from ident.calibration.crossed import CrossedSeries
    from ident.calibration.posterior import Sampled
    from ident.calibration.sensitivity import Sensitivity


# Shares of the variance that are printed; the JSON has them all.
_SHARES = 4


@dataclass(frozen=True)
class Prior:
    """What is known of a multiplier before any maneuver.

    Attributes
    ----------
    mean, sigma : Normal distribution of the multiplier (of a shift, in the units of its values).
    method : Where it is from: captive, stated, or a named estimate.
    estimate : Whether that is an estimate.
    source : Its source in words.

    Examples
    --------
    >>> import ident
    >>> ident.Prior(1.0, 0.2, "stated", estimate=False, source="trials of a sister").sigma
    0.2
    """

    mean: float
    sigma: float
    method: str
    estimate: bool
    source: str


@dataclass(frozen=True)
class Known:
    """A value with its standard deviation."""

    value: float
    sigma: float


@dataclass(frozen=True)
class MultiplierGroup:
    """A group of coefficients and its multiplier.

    Attributes
    ----------
    name, title : As the calibration file has them.
    kind : ``multiplier`` or ``shift``.
    terms : Patterns of its coefficients.
    values : Number of tabulated values it multiplies.
    prior : Before the maneuvers.
    captive_sigma : Standard deviation that the captive errors of its values allow.
    posterior : After the maneuvers.
    maneuvers_alone : What they say without the prior; None where that is next to nothing.
    away_from_prior : Distance of that from the prior, in their joint standard deviations.
    beyond_captive : Whether the captive error alone does not allow the posterior.
    chosen : False for a group that the calibration held at its prior mean.
    evidence : Change of the log evidence by its freedom, the others as chosen; positive where the maneuvers ask for it.

    Examples
    --------
    >>> import ident
    >>> _ = ident.fit("my-boat/captive", db="summary_db")
    >>> done = ident.calibrate("my-boat/calibration.toml", db="summary_db", left_out=False)
    >>> group = done.summary.groups[0]
    >>> group.name, group.posterior.sigma < group.prior.sigma
    ('rudders', True)
    """

    name: str
    title: str
    kind: str
    terms: list[str]
    values: int
    prior: Prior
    captive_sigma: float
    posterior: Known
    maneuvers_alone: Known | None
    away_from_prior: float | None
    beyond_captive: bool
    chosen: bool = True
    evidence: float | None = None

    @property
    def verdict(self) -> str:
        """What a posterior says: of an estimate, whether it agrees; of the captive error, whether it allows it."""
        if not self.chosen:
            return "held at its prior: the maneuvers do not ask for it"
        words = []
        if self.prior.estimate and self.away_from_prior is not None:
            agrees = "agrees" if self.away_from_prior < 2.0 else "disagrees"
            words.append(f"{agrees} with the estimate ({self.away_from_prior:.1f} sigma)")
        if self.beyond_captive:
            words.append("captive error alone does not allow it")
        return "; ".join(words) or "within the captive error"

    @classmethod
    def of(cls, stored: dict[str, Any]) -> MultiplierGroup:
        """A group as the metadata of a version has it ``stored``."""
        alone = stored["maneuvers_alone"]
        parts = {"prior": Prior(**stored["prior"]), "posterior": Known(**stored["posterior"])}
        return cls(**stored | parts | {"maneuvers_alone": None if alone is None else Known(**alone)})


@dataclass(frozen=True)
class TrainedSeries:
    """One channel of one source that the calibration was held against.

    Attributes
    ----------
    case, source, channel : Of the reference.
    rmse : What the posterior leaves, in the unit of the reference.
    sigma : Standard deviation that the channel was weighted with.

    Examples
    --------
    >>> import ident
    >>> ident.TrainedSeries("zigzag", "TRIAL", "psi", rmse=0.8, sigma=1.0).rmse
    0.8
    """

    case: str
    source: str
    channel: str
    rmse: float
    sigma: float


@dataclass(frozen=True)
class LeftOut:
    """The calibration without one source of one case.

    Attributes
    ----------
    case, source : Left out.
    value, sigma : (groups,) posterior without it.
    shift_in_sigma : (groups,) how far that is from the whole posterior.
    rmse_predicted, rmse_trained : Channel -> error of what was left out, predicted and when trained on.

    Examples
    --------
    >>> import ident
    >>> ident.LeftOut("zigzag", "TRIAL", [1.1], [0.1], [0.5], {"psi": 2.0}, {"psi": 1.0}).shift_in_sigma
    [0.5]
    """

    case: str
    source: str
    value: list[float]
    sigma: list[float]
    shift_in_sigma: list[float]
    rmse_predicted: dict[str, float]
    rmse_trained: dict[str, float]


@dataclass(frozen=True)
class CalibrationSummary:
    """A calibration in numbers, as the metadata of its version hold it.

    Attributes
    ----------
    calibration, vehicle : Names.
    parent, parent_digest : Captive version it started from.
    source, file_digest : Of the calibration file.
    trained : ``case:source`` of everything it was trained on.
    groups : Every group.
    covariance : (groups, groups) of the posterior.
    series : Every channel.
    left_out : The calibration without each source in turn; empty when that was not asked for.
    warnings : What to beware of.
    evidence : log evidence of the chosen groups and of all of them, less that of none.
    sampled : The posterior by draws, where that was asked for.
    sensitivity : What decides each channel over the priors, where that was asked for.
    cross_validation : Every series predicted by the other maneuvers, where that was asked for.

    Examples
    --------
    >>> import ident
    >>> _ = ident.fit("my-boat/captive", db="summary_db")
    >>> done = ident.calibrate("my-boat/calibration.toml", db="summary_db", left_out=False)
    >>> done.summary.parent, done.summary.trained
    (0, ['my-zigzag:TRIAL'])
    """

    calibration: str
    vehicle: str
    parent: int
    parent_digest: str
    source: str
    file_digest: str
    trained: list[str]
    groups: list[MultiplierGroup]
    covariance: list[list[float]]
    series: list[TrainedSeries]
    left_out: list[LeftOut]
    warnings: list[str]
    evidence: dict[str, float]
    sampled: Sampled | None = None
    sensitivity: list[Sensitivity] | None = None
    cross_validation: list[CrossedSeries] | None = None

    def to_dict(self) -> dict[str, Any]:
        """The summary for a program to read; without what was not asked for."""
        plain = asdict(self)
        return {k: v for k, v in plain.items() if v is not None}


@dataclass(frozen=True)
class Calibrated:
    """One calibration, committed.

    Attributes
    ----------
    summary : Priors, posteriors, series, what was left out and warnings.
    version : Number of the version that holds the calibrated rows.
    new : False when the latest version held them already.
    digest : SHA-256 of the content of the rows.

    Examples
    --------
    >>> import ident
    >>> _ = ident.fit("my-boat/captive", db="trained_db")
    >>> done = ident.calibrate("my-boat/calibration.toml", db="trained_db", left_out=False)
    >>> done.groups.loc["rudders", "verdict"]
    'within the captive error'
    """

    summary: CalibrationSummary
    version: int
    new: bool
    digest: str

    @property
    def groups(self) -> pd.DataFrame:
        """One row a group: prior, its sigma, captive error, posterior, its sigma, and the verdict."""
        import pandas as pd

        rows = [
            {
                "group": g.name,
                "prior": g.prior.mean,
                "prior_sigma": g.prior.sigma,
                "captive_sigma": g.captive_sigma,
                "posterior": g.posterior.value,
                "posterior_sigma": g.posterior.sigma,
                "verdict": g.verdict,
            }
            for g in self.summary.groups
        ]
        return pd.DataFrame(rows).set_index("group")

    def to_dict(self) -> dict[str, Any]:
        """The calibration for a program to read."""
        return {**self.summary.to_dict(), "version": self.version, "new": self.new, "digest": self.digest}

    def __repr__(self) -> str:
        return f"Calibrated({self.summary.calibration}: version {self.version})"

    def _repr_html_(self) -> str:
        title = f"{self.summary.calibration}: version {self.version}, digest {self.digest[:16]}"
        table = self.groups
        rows = [(name, *(f"{x:.3g}" for x in row[:5]), row[5]) for name, *row in table.itertuples()]
        return html_table(title, ("group", *table.columns), rows)


def _show_draws(summary: CalibrationSummary, console: Console) -> None:
    """Print the sampled posterior and what decides each channel."""
    from rich.table import Table

    sampled = summary.sampled
    if sampled is not None:
        title = f"Posterior by {sampled.independent:.0f} independent draws"
        table = Table("group", "mean", "2.5 %", "median", "97.5 %", "shift from the optimum", "width", title=title)
        for name, g in sampled.groups.items():
            numbers = [f"{x:.3f}" for x in (g.mean, g.q025, g.q50, g.q975)]
            table.add_row(on_screen(name), *numbers, f"{g.shift:+.2f} ± {g.shift_error:.2f}", f"{g.width:.2f}")
        console.print(table)
        console.print(on_screen(sampled.verdict), highlight=False)
    if summary.sensitivity:
        table = Table("case", "channel", "along", "total share of the variance over the priors, ± its standard error")
        for one in summary.sensitivity:
            shares = sorted(one.groups.items(), key=lambda g: -g[1].total)
            known = [f"{n} {100 * s.total:.0f} ± {100 * s.total_error:.0f} %" for n, s in shares[:_SHARES]]
            names = [on_screen(n) for n in (one.case, one.channel)]
            table.add_row(*names, f"{100 * one.along:.0f} %", on_screen(", ".join(known)))
        console.print(table)


def _show_crossed(crossed: list[CrossedSeries], console: Console) -> None:
    """Print what each maneuver gains by the others."""
    from rich.table import Table

    from ident.calibration.crossed import mean_gains

    title = "Each maneuver predicted by the others: RMSE on that without calibration, geometric means"
    table = Table("case", "source", "left out", title=title)
    for (case, source), gain in mean_gains(crossed).items():
        table.add_row(on_screen(case or "all series"), on_screen(source), f"{gain:.2f}")
    console.print(table)


def show(done: Calibrated, console: Console) -> None:
    """Print priors and posteriors, the series, what was left out, and what to beware of."""
    from rich.markup import escape
    from rich.table import Table

    summary = done.summary
    table = Table("group", "prior", "captive error", "posterior", "maneuvers alone", "evidence", "verdict")
    table.title = on_screen(f"{summary.calibration}: multipliers on version {summary.parent}")
    for g in summary.groups:
        alone, prior, after = g.maneuvers_alone, g.prior, g.posterior
        colour = "red" if g.beyond_captive else "green"
        table.add_row(
            on_screen(g.name),
            f"{prior.mean:.2f} ± {prior.sigma:.2f}",
            f"± {g.captive_sigma:.2f}",
            f"[{colour}]{after.value:.3f} ± {after.sigma:.3f}[/]",
            "-" if alone is None else f"{alone.value:.2f} ± {alone.sigma:.2f}",
            "-" if g.evidence is None else f"{g.evidence:+.1f}",
            g.verdict,
        )
    console.print(table)
    words = ", ".join(f"{k} {v:.1f}" for k, v in summary.evidence.items())
    console.print(f"log evidence over no group free: {words}", highlight=False)
    _show_draws(summary, console)
    table = Table("case", "source", "channel", "RMSE", "sigma", title="Training series, units of the references")
    for s in summary.series:
        names = [on_screen(name) for name in (s.case, s.source, s.channel)]
        table.add_row(*names, f"{s.rmse:.4g}", f"{s.sigma:.4g}")
    console.print(table)
    if summary.cross_validation:
        _show_crossed(summary.cross_validation, console)
    for one in summary.left_out:
        errors = ", ".join(f"{k} {v:.3g} ({one.rmse_trained[k]:.3g} trained)" for k, v in one.rmse_predicted.items())
        text = f"left out {one.case} {one.source}, predicted RMSE: {errors}"
        console.print(on_screen(text), highlight=False)
    for text in summary.warnings:
        console.print(f"[yellow]warning[/] {escape(text)}", highlight=False)
    state = "committed" if done.new else "unchanged, nothing committed: already"
    console.print(f"[bold]{state} version {done.version}[/]  digest {done.digest[:16]}", highlight=False)
