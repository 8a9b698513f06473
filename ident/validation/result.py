"""What a validation gives: a flight, its errors against references, its metrics."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ident.output import html_table
from ident.validation.flown_case import FlownCase
from sim.boat.database import version_words
from sim.boat.delta_log import Origin

if TYPE_CHECKING:
    from collections.abc import Callable

    import pandas as pd

    from ident.metrics.in_waves import InWaves
    from ident.metrics.metric import Metrics
    from ident.metrics.turning import SpiralPoint
    from ident.validation.band_summary import BandSummary
    from ident.validation.bands import Bands
    from ident.validation.boats import Boat
    from ident.validation.coverage import OutsideUse
    from ident.validation.other_boat import Saturated
    from ident.validation.sweep import SweepPoint
    from sim.flight.case import Case
    from sim.flight.series import Series
    from sim.flight.simulation import Simulation


@dataclass(frozen=True)
class ChannelError:
    """How far a flight is from one channel of one reference.

    Attributes
    ----------
    rmse : Root mean square difference at the reference's own times or path lengths.
    unit : Of the reference and so of every error here.
    n : Number of the reference's points, as far as the flight went.
    published_model_rmse : The same of the published model; None without one.
    ratio : ``rmse`` over that.
    reference_sigma : Root mean square of the reference's own standard error; None when not given.

    Examples
    --------
    >>> import ident
    >>> done = ident.validate("my-boat/zigzag.toml", db="coeff_db")
    >>> error = done.errors["TRIAL"]["psi"]
    >>> error.unit, error.n, error.rmse < 3.0
    ('deg', 100, True)
    """

    rmse: float
    unit: str
    n: int
    published_model_rmse: float | None = None
    ratio: float | None = None
    reference_sigma: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """The error for a program to read."""
        return asdict(self)


@dataclass(frozen=True)
class Validation:
    """One flown case, held against its references.

    Attributes
    ----------
    case : What was flown, with the name of the vehicle that flew it.
    simulation : The flight, program frame, SI and radians.
    reference : What it is held against, source and channel to a record, SI and radians.
    boat : The vehicle with its coefficients.
    db : Path or URL of the database.
    errors : Source -> channel -> error.
    metrics : ITTC metric -> ``simulated``, each source and ``published_model``, value or None.
    as_started : Flights from the start of a source's own record, by source.
    outside_tables : Every use of a term beyond its data.
    constant_axes : Term -> axes along which it was measured at one value only.
    curve : Points of a spiral; None for other maneuvers.
    grid : Points of a sweep over speed and depth; None without one.
    in_waves : Harmonics or statistics of a flight in waves.
    passed : Whether the run is complete and every tolerance of the case is met.
    bands : Error bands from sampled coefficients; None when none were flown.
    saturated : Actuators that lay at their limit.
    notes : What was left out, scaled or limited because another boat flew the case.

    Examples
    --------
    >>> import ident
    >>> done = ident.validate("my-boat/zigzag.toml", db="coeff_db")
    >>> done.passed, done.version
    (True, 0)
    >>> done.table.loc[("TRIAL", "psi"), "unit"]
    'deg'
    >>> round(done.metrics["overshoot_1_deg"]["simulated"])
    8
    >>> done.simulation["psi"].shape == done.simulation["t"].shape
    True
    """

    case: Case
    simulation: Simulation
    reference: Series
    boat: Boat
    db: str
    errors: dict[str, dict[str, ChannelError]]
    metrics: Metrics
    as_started: dict[str, Simulation]
    outside_tables: list[OutsideUse]
    constant_axes: dict[str, list[str]]
    curve: list[SpiralPoint] | None
    grid: list[SweepPoint] | None
    in_waves: InWaves
    passed: bool
    bands: Bands | None = None
    saturated: list[Saturated] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def metrics_sigma(self) -> dict[str, dict[str, float]]:
        """Metric -> source -> standard error, of recorded trials."""
        return {name: metric.sigma for name, metric in self.metrics.items() if metric.sigma}

    @property
    def complete(self) -> bool:
        """Whether the flight went to its end in finite numbers."""
        return bool(np.isfinite(self.simulation.end).all())

    @property
    def version(self) -> int:
        """Number of the version that wrote the vehicle's coefficients."""
        return self.boat.commit.number

    @property
    def digest(self) -> str:
        """SHA-256 of the content of the vehicle's rows."""
        return self.boat.commit.digest

    @property
    def database(self) -> Origin:
        """Path, version and digest, as every JSON output names them."""
        return self.boat.commit.origin(self.db)

    @property
    def flown(self) -> FlownCase:
        """The case as its figures show it."""
        return FlownCase(
            case=self.case,
            simulation=replace(self.simulation, trim=None),
            reference=self.reference,
            as_started={source: replace(flight, trim=None) for source, flight in self.as_started.items()},
            curve=self.curve,
            grid=self.grid,
            in_waves=self.in_waves,
            bands=self.bands,
            database=self.database,
        )

    @property
    def table(self) -> pd.DataFrame:
        """One row a source and channel: the fields of ``ChannelError``."""
        import pandas as pd

        rows = {(s, c): e.to_dict() for s, channels in self.errors.items() for c, e in channels.items()}
        columns = list(ChannelError.__dataclass_fields__)
        index = pd.MultiIndex.from_tuples(list(rows), names=["source", "channel"]) if rows else None
        return pd.DataFrame(list(rows.values()), index=index, columns=columns)

    @cached_property
    def band_summary(self) -> BandSummary | None:
        """What the error bands say: references inside, coefficients that make them wide; None without bands."""
        from ident.validation.band_summary import summary

        return summary(self.bands, self.case, self.reference) if self.bands else None

    @property
    def coverage(self) -> dict[str, float] | None:
        """Level -> mean share of the references inside the band; None without bands or references."""
        from ident.validation.reliability import mean_shares

        return mean_shares([self.band_summary.inside]) if self.band_summary else None

    def with_bands(
        self,
        samples: int,
        seed: int = 0,
        each: Callable[[int], None] = lambda done: None,
        dask: str | None = None,
    ) -> Validation:
        """The same with error bands: the case flown with coefficient sets drawn from their errors.

        Parameters
        ----------
        samples : Number of coefficient sets, two or more.
        seed : Of the random generator; sample i depends on it and on i alone.
        each : Called with the number of samples flown since the last call.
        dask : Address of a Dask scheduler that flies them instead of this machine.

        Returns
        -------
        Validation
            With ``bands``: ``bands.band(channel, "95")`` gives lower and upper edge over ``bands.time``; and in
            ``metrics`` the quantiles ``q025``, ``q50`` and ``q975`` over the samples.

        Raises
        ------
        InputError
            When no sample has a self-propulsion state, or the cluster is not there.

        Examples
        --------
        >>> import ident
        >>> done = ident.validate("my-boat/zigzag.toml", db="coeff_db").with_bands(8)
        >>> low, high = done.bands.band("psi", "95")
        >>> bool((low <= high).all())
        True
        """
        from ident.validation.bands import Execution, fly_samples
        from ident.validation.reliability import with_intervals
        from ident.validation.sweep import sampled_grid

        bands = fly_samples(
            self.case, self.boat.vehicle, self.boat.rows, samples, seed, Execution(each=each, dask=dask)
        )
        bands = sampled_grid(self.case, self.boat.vehicle, self.boat.rows, bands)
        return replace(self, bands=bands, metrics=with_intervals(self.metrics, bands))

    def to_dict(self) -> dict[str, Any]:
        """The comparison for a program to read, as ``ident validate --json`` prints it."""
        trim = self.simulation.trim
        plain = {
            "case": self.case.name,
            "vehicle": self.case.vehicle,
            "database": self.database,
            "references": {s: {c: e.to_dict() for c, e in by.items()} for s, by in self.errors.items()},
            "metrics": {name: metric.to_dict() for name, metric in self.metrics.items()},
            "outside_tables": [asdict(use) for use in self.outside_tables],
            **({"curve": [asdict(point) for point in self.curve]} if self.curve else {}),
            **({"grid": [asdict(point) for point in self.grid]} if self.grid is not None else {}),
            "saturated": [asdict(one) for one in self.saturated],
            "notes": self.notes,
            **({"metrics_sigma": self.metrics_sigma} if self.metrics_sigma else {}),
            "trim_limited": list(trim.limited) if trim else [],
            "ends_s": float(self.simulation.end[0]),
            "passed": self.passed,
        }
        if self.band_summary is not None:
            plain |= {"bands": self.band_summary.to_dict(), "coverage": self.coverage}
        return plain

    def __repr__(self) -> str:
        verdict = "passed" if self.passed else "not passed"
        return f"Validation({self.case.name} by {self.case.vehicle}, version {self.version}: {verdict})"

    def _repr_html_(self) -> str:
        title = f"{self.case.title}, {self.case.vehicle}; {version_words(self.database)}"
        rows = [
            (s, c, f"{e.rmse:.4g}", e.unit, None if e.ratio is None else f"{e.ratio:.2f}")
            for s, channels in self.errors.items()
            for c, e in channels.items()
        ]
        errors = html_table(title, ("reference", "channel", "RMSE", "unit", "ratio to published model"), rows)
        labels = list(next(iter(self.metrics.values()), {}))
        measured = [
            (m, *(None if values[k] is None else f"{values[k]:.4g}" for k in labels))
            for m, values in self.metrics.items()
        ]
        return errors + (html_table("metrics", ("metric", *labels), measured) if measured else "")
