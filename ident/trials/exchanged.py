"""Channels under one another's names: the checks for them, the surest first.

Pairs that mend every broken relation (``exchanged_pairs``) and controls under the wrong name (``exchanged_controls``)
are sure; without either, what a channel should be by the others is looked for in another column.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ident.checks.findings import Finding
from ident.timeseries.smoothing import SmoothPath
from ident.trials.consistency import RATES, expected_rate, path_of, regressed
from ident.trials.exchanged_controls import exchanged_controls
from ident.trials.exchanged_pairs import exchanged_pairs, pair_of
from ident.trials.reading import Recording

Array = NDArray[np.float64]
# Correlation below which a channel is not what its name says, and from which another column is.
_NOT, _IS = 0.8, 0.97
# How far the size of that column may be off, and how much nearer it has to be.
_SIZE, _NEARER = 0.15, 0.3
_FEWEST = 16


def exchanged(one: Recording) -> list[Finding]:
    """Columns that hold what others should, one finding a pair.

    Parameters
    ----------
    one : In program axes.
    """
    path = cache(lambda name: path_of(one.channels[name]))
    sure = [*exchanged_pairs(one, path), *exchanged_controls(one)]
    if sure:
        return sure
    of_columns: dict[frozenset[str], Finding] = {}
    for finding in (*_along_the_track(one, path), *_abeam(one), *_rates(one, path)):
        of_columns.setdefault(frozenset(finding.columns), finding)
    return list(of_columns.values())


def _others(one: Recording, *but: str) -> list[str]:
    moving = (k for k, r in one.channels.items() if len(r) >= _FEWEST and float(np.ptp(r.value)) > 0.0)
    return [k for k in moving if k not in but]


def _rates(one: Recording, path: Callable[[str], SmoothPath]) -> Iterator[Finding]:
    """A rate that is not that of its angle, where another column is the rate, or the angle."""
    for name, angle in RATES.items():
        if name not in one.channels or angle not in one.channels or name == "udot":
            continue
        rate = one.channels[name]
        t = _shared(rate.abscissa, one.channels[angle].abscissa)
        if t.size < _FEWEST:
            continue
        pair = regressed(t, rate.at(t), expected_rate(one, name, path, t))
        if pair is not None and abs(pair.correlation) >= _NOT:
            continue
        best: tuple[float, str, str, str] = (_IS, "", "", "")
        pair = regressed(t, one.channels[angle].at(t), path(name)(t, 1))
        if pair is not None and abs(pair.correlation) > _IS:
            best = (abs(pair.correlation), name, angle, f"{one.headers[angle]} is the rate of {one.headers[name]}")
        for other in _others(one, name, angle):
            shared = _shared(t, one.channels[other].abscissa)
            if shared.size < _FEWEST:
                continue
            held, rates = one.headers[other], path(other)(shared, 1)
            pair = regressed(shared, one.channels[other].at(shared), path(angle)(shared, 1))
            if pair is not None and abs(pair.correlation) > best[0] and _alike(pair.slope):
                best = (abs(pair.correlation), name, other, f"the rate of {one.headers[angle]} stands in {held}")
            pair = regressed(shared, rate.at(shared), rates)
            if pair is not None and abs(pair.correlation) > best[0]:
                best = (abs(pair.correlation), angle, other, f"{one.headers[name]} is the rate of {held}")
        if best[1]:
            yield pair_of(one, *best[1:])


def _alike(slope: float) -> bool:
    """One size, in units that may be degrees or radians."""
    size = abs(slope)
    return any(abs(size / one - 1.0) < _SIZE for one in (1.0, math.degrees(1.0), math.radians(1.0)))


def _along_the_track(one: Recording, path: Callable[[str], SmoothPath]) -> Iterator[Finding]:
    """Speeds ahead and abeam against those of the track, and against one another."""
    if not {"north", "east", "psi"} <= set(one.channels):
        return
    t = _shared(_shared(one.channels["north"].abscissa, one.channels["psi"].abscissa), one.channels["east"].abscissa)
    if t.size < _FEWEST:
        return
    psi, dn, de = one.channels["psi"].at(t), path("north")(t, 1), path("east")(t, 1)
    should = {"u": dn * np.cos(psi) + de * np.sin(psi), "v": de * np.cos(psi) - dn * np.sin(psi)}
    for name, like in should.items():
        if name not in one.channels:
            continue
        size = float(np.sqrt(np.mean(like**2)))
        off = _away(one, name, t, like)
        for other in _others(one, name, "north", "east", "psi"):
            away = _away(one, other, t, like)
            pair = regressed(t, one.channels[other].at(t), like)
            like_it = pair is not None and pair.correlation > _NOT
            if off > _SIZE * size and away < _NEARER * off and away < _SIZE * size and (like_it or name == "u"):
                yield pair_of(one, name, other, f"the {_WORDS[name]} of the track stands in {one.headers[other]}")


def _abeam(one: Recording) -> Iterator[Finding]:
    """A boat that begins its maneuver going sideways: speeds ahead and abeam exchanged, told without a track."""
    if not {"u", "v"} <= set(one.channels) or "north" in one.channels:
        return
    ahead, abeam = (one.channels[name].value for name in ("u", "v"))
    first = max(_FEWEST, ahead.size // 50)
    if abs(float(np.median(abeam[:first]))) > 2.0 * abs(float(np.median(ahead[:first]))):
        yield pair_of(one, "u", "v", f"the boat begins by going sideways, at the speed in {one.headers['v']}")


_WORDS = {"u": "speed ahead", "v": "speed abeam"}


def _away(one: Recording, name: str, t: Array, like: Array) -> float:
    """Root mean square by which a channel differs from what it should be."""
    record = one.channels[name]
    inside = (t >= record.abscissa[0]) & (t <= record.abscissa[-1])
    return float(np.sqrt(np.mean((record.at(t[inside]) - like[inside]) ** 2))) if inside.any() else math.inf


def _shared(a: Array, b: Array) -> Array:
    return a[(a >= b[0]) & (a <= b[-1])]
