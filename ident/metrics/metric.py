"""One metric of a maneuver: as it was simulated, as each reference has it, and how far samples spread."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field

# Name -> value of one flight or of one recording; None where the maneuver does not come to it.
Values = dict[str, float | None]


@dataclass(frozen=True)
class Interval:
    """Spread of a metric over flights with sampled coefficients.

    Attributes
    ----------
    q025, q50, q975 : Quantiles over the samples that come to it; None where none does.
    without : Share of the samples that do not, 0 to 1.

    Examples
    --------
    >>> import ident
    >>> ident.Interval(7.1, 7.9, 8.8, 0.0).q50
    7.9
    """

    q025: float | None = None
    q50: float | None = None
    q975: float | None = None
    without: float = 1.0


@dataclass(frozen=True)
class Metric(Mapping[str, float | None]):
    """A metric, column by column.

    As a mapping it has every column by its name, with the quantiles ``q025``, ``q50``, ``q975`` and ``without`` where
    samples were flown.

    Attributes
    ----------
    columns : ``simulated``, ``simulated_as_<source>``, each source and ``published_model`` -> value, None where the
        maneuver does not come to it.
    interval : Over samples; None when none were flown.
    sigma : Column -> standard error, of recorded trials; not among the columns of the mapping.

    Examples
    --------
    >>> import ident
    >>> metric = ident.Metric({"simulated": 7.9, "EXP": 8.2})
    >>> metric.simulated, metric["EXP"]
    (7.9, 8.2)
    """

    columns: Values
    interval: Interval | None = None
    sigma: dict[str, float] = field(default_factory=dict)

    @property
    def simulated(self) -> float | None:
        """Of the case's own flight; None where it does not come to it."""
        return self.columns.get("simulated")

    def to_dict(self) -> Values:
        """Every column by its name."""
        return self.columns | (asdict(self.interval) if self.interval else {})

    def __getitem__(self, column: str) -> float | None:
        """The value of a column of ``to_dict``."""
        return self.to_dict()[column]

    def __iter__(self) -> Iterator[str]:
        return iter(self.to_dict())

    def __len__(self) -> int:
        return len(self.to_dict())


Metrics = dict[str, Metric]
