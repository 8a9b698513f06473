"""What error bands say: how often references lie inside, and which coefficients make them wide."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ident.text import on_screen
from ident.validation.bands import LEVELS, Bands
from sim.flight.case import Case
from sim.flight.series import Series
from sim.kernel.products import product

if TYPE_CHECKING:
    from rich.console import Console

Array = NDArray[np.float64]
# Source -> channel -> level -> share of the reference's points inside the band.
Inside = dict[str, dict[str, dict[str, float]]]
# Instants of a record that stand for it: a band changes little from one to the next.
_INSTANTS = 400
# Probability that chance alone lists a coefficient as a cause of a channel's width.
_BY_CHANCE = 0.01


@dataclass(frozen=True)
class VarianceShare:
    """How much of a channel's variance goes with a coefficient.

    Attributes
    ----------
    coefficient : Its symbol.
    share : Of the variance, 0 to 1.
    standard_error : Of the share.

    Examples
    --------
    >>> import ident
    >>> ident.VarianceShare("N_v", 0.6, 0.1).share
    0.6
    """

    coefficient: str
    share: float
    standard_error: float


@dataclass(frozen=True)
class BandSummary:
    """What the bands of one case say.

    Attributes
    ----------
    samples, failed : Coefficient sets that flew, and that have no state of self-propulsion.
    seed : Of the random generator.
    inside : Source -> channel -> level -> share of the reference's points inside the band.
    variance_shares : Channel -> coefficients, surest first.

    Examples
    --------
    >>> import ident
    >>> done = ident.validate("my-boat/zigzag.toml", db="coeff_db", version=0)
    >>> summary = done.with_bands(8, seed=1).band_summary
    >>> summary.samples, sorted(summary.inside["TRIAL"]["psi"])
    (8, ['50', '95'])
    """

    samples: int
    failed: int
    seed: int
    inside: Inside
    variance_shares: dict[str, list[VarianceShare]]

    def to_dict(self) -> dict[str, Any]:
        """The summary for a program to read."""
        return asdict(self)


def inside(bands: Bands, case: Case, reference: Series) -> Inside:
    """How often each reference lies inside the bands: share of its points, by source, channel and level."""
    shares: Inside = {}
    for source in case.reference.compare if case.reference else []:
        for channel in case.reference.channels if case.reference else []:
            if channel not in reference[source]:
                continue
            time, value = reference[source][channel].abscissa, reference[source][channel].value
            if reference.abscissa == "s":
                # Path length to time by the median flight.
                time = np.interp(time, np.nanmedian(bands.of(source)["s"], axis=0), bands.time)
            entry = {}
            for level in LEVELS:
                low, high = (np.interp(time, bands.time, edge) for edge in bands.band(channel, level, source))
                entry[level] = float(np.mean((value >= low) & (value <= high)))
            shares.setdefault(source, {})[channel] = entry
    return shares


def _without_each(scores: Array, along: Array, diagonal: Array) -> tuple[float, Array]:
    """Share of the variance of a channel that goes with the scores, of all samples and without each.

    Parameters
    ----------
    scores : (samples, rank), mean zero.
    along : (samples, rank) G times the scores, with G the products of the samples' departures from
        the mean of the channel, summed over the record.
    diagonal : (samples,) of G.

    Returns
    -------
    share : Sum of the squared correlations, averaged over the record with the variance as weight.
    without : (samples,) the same without one sample.
    """
    samples = len(scores)
    # What a sum of products about the mean loses with a sample is this times the sample's product.
    lost = samples / (samples - 1.0)
    total = float(diagonal.sum())
    square, size = (scores * along).sum(axis=0), (scores**2).sum(axis=0)
    left = square - 2.0 * lost * scores * along + (lost * scores) ** 2 * diagonal[:, None]
    without = (left / (size - lost * scores**2)).sum(axis=1) / (total - lost * diagonal)
    return float((square / size).sum()) / total, without


def variance_shares(bands: Bands, channel: str, most: int = 8) -> list[VarianceShare]:
    """Which coefficients cause the width of a channel's band.

    The share of the variance that a linear function of all values of a coefficient
    accounts for: the squared correlations of the channel with the coefficient's independent
    scores, averaged over some 400 instants of the record with the variance as weight, less what chance gives
    (1/samples a score). Its standard error is the jackknife's, from the shares without one sample
    each (Efron and Stein 1981). By chance alone, the samples times the squared correlations are
    chi-square distributed with a degree of freedom a score; a coefficient is listed when its
    share lies beyond what, of all coefficients together, one in a hundred draws exceeds.
    Coefficients whose errors are correlated each have what they share, so that the shares may sum
    to more than one.

    Parameters
    ----------
    bands, channel : Flown samples, and which channel of them.
    most : Number of coefficients listed.

    Returns
    -------
    Surest share (share less twice its standard error) first.
    """
    from scipy.special import chdtri

    values = bands.channels[channel]
    complete = np.flatnonzero(np.isfinite(values).all(axis=0))
    spread = values[:, complete[:: max(1, complete.size // _INSTANTS)]]
    spread -= spread.mean(axis=0)
    if len(values) < 3 or not spread.any():
        return []
    every = bands.scores()
    columns = np.concatenate(list(every.values()), axis=1)
    along = product(spread, product(spread.T, columns))
    size = product(np.ones((1, spread.shape[1])), (spread * spread).T)[0]
    del columns
    shares, first = [], 0
    for coefficient, independent in every.items():
        samples, rank = independent.shape
        share, without = _without_each(independent, along[:, first : first + rank], size)
        first += rank
        if samples * share <= chdtri(rank, _BY_CHANCE / len(every)):
            continue
        error = np.sqrt((samples - 1.0) / samples * ((without - without.mean()) ** 2).sum())
        shares.append(VarianceShare(coefficient, min(share - rank / samples, 1.0), float(error)))
    shares.sort(key=lambda one: 2.0 * one.standard_error - one.share)
    return shares[:most]


def summary(bands: Bands, case: Case, reference: Series) -> BandSummary:
    """What the bands of a case say, channel by channel on all cores."""
    channels = case.reference.channels if case.reference else []
    bands.scores()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        shares = dict(zip(channels, pool.map(lambda channel: variance_shares(bands, channel), channels), strict=True))
    return BandSummary(len(bands.draws), bands.failed, bands.seed, inside(bands, case, reference), shares)


def show(of: BandSummary, console: Console) -> None:
    """Print how often the references lie inside, and what makes the bands wide."""
    from rich.table import Table

    failed = f", {of.failed} without self-propulsion" if of.failed else ""
    if not of.inside and not of.variance_shares:
        console.print(f"{of.samples} samples{failed}; the case has no series to hold them against")
        return
    table = Table("reference", "channel", "inside 50 %", "inside 95 %", title=f"{of.samples} samples{failed}")
    for source, channels in of.inside.items():
        for channel, by_level in channels.items():
            shown = [f"{100 * by_level[level]:.0f} %" for level in LEVELS]
            table.add_row(on_screen(source), channel, *shown)
    console.print(table)
    table = Table("channel", "variance share by coefficient, ± its standard error")
    for channel, shares in of.variance_shares.items():
        texts = [f"{s.coefficient} {100 * s.share:.0f} ± {100 * s.standard_error:.0f} %" for s in shares]
        table.add_row(channel, ", ".join(texts))
    console.print(table)
