"""Two columns under one another's names, told by what all channels of one boat have to do with one another.

A record of one boat fulfils relations: rates are those of their angles, speeds those of the track. Where some are
broken, two columns are exchanged on trial; when that mends every broken one and breaks none, they stand under one
another's names.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from ident.checks.findings import Finding
from ident.timeseries.smoothing import SmoothPath
from ident.trials.body import body_rate, velocities
from ident.trials.consistency import finding_of, regressed
from ident.trials.reading import Recording

Array = NDArray[np.float64]
Channels = dict[str, Array]
# Relations: what is measured -> channels by which it is known.
_RELATIONS = {
    "r": ("psi",),
    "p": ("phi",),
    "q": ("theta",),
    "u": ("north", "east", "psi"),
    "v": ("north", "east", "psi"),
    "w": ("north", "east", "psi", "theta", "phi", "z"),
}
# Angles that stand between a body and those: what they are off breaks the relation too.
_INCLINED = {"r": ("phi", "theta"), "p": ("theta", "psi"), "q": ("phi", "psi"), "u": (), "v": (), "w": ()}
PLAIN = ("psi", "phi", "theta", "r", "p", "q", "u", "v", "w", "north", "east", "z", "dH", "dV")
# Correlation and slope from which a relation holds, and beyond which it is broken.
_HOLDS, _SLOPE = 0.9, 0.15
_BROKEN, _FAR = 0.8, 0.35
_FEWEST, _POINTS = 16, 600
# What moves by less than so many standard errors says nothing.
_MOVES = 4.0
_DEGREES = math.degrees(1.0)
# No boat that is steered heels further; what stands under that name is another channel.
_MOST_HEEL = math.radians(60.0)
_WORDS = {"north": "x", "east": "y"}


def exchanged_pairs(one: Recording, path: Callable[[str], SmoothPath]) -> Iterator[Finding]:
    """Pairs of columns whose exchange mends every relation that is broken.

    Parameters
    ----------
    one : In program axes.
    path : The smooth path of a channel.
    """
    names = [n for n in PLAIN if n in one.channels and len(one.channels[n]) >= _FEWEST and _moves(one, n)]
    too_far = _heels_too_far(one) and "phi" in names
    if not set(_RELATIONS) & set(names) and not too_far:
        return
    paths = {n: path(n) for n in names}
    lo = max(float(p.knots[4]) for p in paths.values())
    hi = min(float(p.knots[-5]) for p in paths.values())
    if not hi > lo:
        return
    t = np.linspace(lo, hi, _POINTS)
    values, rates = {n: p(t) for n, p in paths.items()}, {n: p(t, 1) for n, p in paths.items()}
    quiet = {n: float(np.median(p.deviation(t[:: _POINTS // 6], 1))) for n, p in paths.items()}
    before = _states(t, values, rates, quiet)
    broken = {k for k, state in before.items() if state is False}
    if too_far:
        yield from _instead_of_heel(one, t, values, rates)
        return
    if not broken:
        return
    best: tuple[float, str, str] | None = None
    for a, b in itertools.combinations(names, 2):
        if not any({a, b} & {k, *_RELATIONS[k], *_INCLINED[k]} for k in broken) or {a, b} == {"north", "east"}:
            continue
        for to_b, to_a in _scales(one, a, b):
            other = values | {a: to_a * values[b], b: to_b * values[a]}
            slopes = rates | {a: to_a * rates[b], b: to_b * rates[a]}
            after = _states(t, other, slopes, quiet | {a: to_a * quiet[b], b: to_b * quiet[a]})
            # None of them broken any more, and one of those that were sound beyond doubt.
            if any(s is False for s in after.values()) or not any(after.get(k) for k in broken):
                continue
            if any(k not in after for k in broken):
                continue
            size = _size(t, other, slopes, broken)
            if best is None or size > best[0]:
                best = (size, a, b)
    if best is not None:
        yield _finding(one, best[1], best[2], ", ".join(sorted(f"{_named(one, k)}" for k in broken)))


def _heels_too_far(one: Recording) -> bool:
    """Whether the heel is that of no boat, beside angles that move."""
    phi = one.channels.get("phi")
    away = None if phi is None else np.abs(phi.value - float(np.median(phi.value[:3])))
    return away is not None and len(away) >= _FEWEST and float(np.percentile(away, 90.0)) > _MOST_HEEL


def _instead_of_heel(one: Recording, t: Array, values: Channels, rates: Channels) -> Iterator[Finding]:
    """A heel that no boat has: the coordinate of the track that goes with the speed in its place, if one does."""
    size, there = _DEGREES * float(np.max(np.abs(values["phi"]))), one.headers["phi"]
    if not {"phi", "north", "east"} <= set(values) or not {"u", "U"} & set(values):
        remedy = f"the unit of {there}, or what the column is: [channels] in trial.toml"
        what = f"a heel of {size:.0f} deg, which no boat that is steered has"
        yield finding_of(one, "impossible_heel", ("phi",), float(one.rows[0][0]), what, remedy)
        return
    speed = values["u" if "u" in values else "U"]
    away: dict[str, float] = {}
    for name in ("north", "east"):
        other = "east" if name == "north" else "north"
        # Degrees were read, metres stand there; the coordinate holds degrees of heel.
        made = np.hypot(_DEGREES * rates["phi"], rates[other])
        away[name] = float(np.sqrt(np.mean((made - speed) ** 2)))
    now = float(np.sqrt(np.mean((np.hypot(rates["north"], rates["east"]) - speed) ** 2)))
    name = min(away, key=lambda n: away[n])
    if away[name] < now and float(np.ptp(values[name])) / _DEGREES < _MOST_HEEL:
        coordinate = one.headers[name]
        what = (
            f"a heel of {size:.0f} deg, and the speed is that of the track when {coordinate} and {there} change places"
        )
        yield pair_of(one, "phi", name, what)


def _moves(one: Recording, name: str) -> bool:
    return float(np.ptp(one.channels[name].value)) > 0.0


def _known(name: str, values: Channels, rates: Channels) -> Array | None:
    """What a channel should be, by the others; None where they do not say it."""
    if any(n not in values for n in _RELATIONS[name]):
        return None
    if name in ("u", "v", "w"):
        return velocities(values, rates if "z" in values else {k: v for k, v in rates.items() if k != "z"})[name]
    return body_rate(name, values, rates)


def _states(t: Array, values: Channels, rates: Channels, quiet: dict[str, float]) -> dict[str, bool | None]:
    """Of each relation whether it holds, is broken, or neither (None)."""
    states: dict[str, bool | None] = {}
    for name in _RELATIONS:
        should = _known(name, values, rates) if name in values else None
        if should is None:
            continue
        if name in ("u", "v"):
            speed = float(np.sqrt(np.mean(np.hypot(rates["north"], rates["east"]) ** 2)))
            away = float(np.sqrt(np.mean((values[name] - should) ** 2))) / max(speed, 1e-12)
            states[name] = True if away < 0.5 * _SLOPE else False if away > _SLOPE else None
            continue
        angle = "z" if name == "w" else _RELATIONS[name][0]
        if float(np.std(should)) < _MOVES * quiet[angle]:
            continue
        pair = regressed(t, values[name], should)
        off = math.inf if pair is None else abs(pair.slope - 1.0)
        held = pair is not None and pair.correlation > _HOLDS and off < _SLOPE
        states[name] = True if held else False if pair is None or pair.correlation < _BROKEN or off > _FAR else None
    return states


def _size(t: Array, values: Channels, rates: Channels, names: set[str]) -> float:
    """The least correlation of some relations."""
    pairs = [(values[n], _known(n, values, rates)) for n in names]
    return min(float(np.corrcoef(a, b)[0, 1]) for a, b in pairs if b is not None)


def _scales(one: Recording, a: str, b: str) -> list[tuple[float, float]]:
    """Factors of a's numbers under b's header, and the other way round: degrees may be taken for metres."""
    angular = [one.channels[n].unit.startswith("rad") for n in (a, b)]
    if angular[0] == angular[1]:
        units = [one.channels[n].unit for n in (a, b)]
        return (
            [(1.0, 1.0)]
            if units[0] == units[1]
            else [(1.0, 1.0), (_DEGREES, 1.0 / _DEGREES), (1.0 / _DEGREES, _DEGREES)]
        )
    to_b = _DEGREES if angular[0] else 1.0 / _DEGREES
    return [(to_b, 1.0 / to_b), (1.0, 1.0)]


def _named(one: Recording, name: str) -> str:
    return f"{one.headers[name]} and {one.headers[_RELATIONS[name][0]]}"


def _finding(one: Recording, a: str, b: str, broken: str) -> Finding:
    """The first of the two is the one that a relation names."""
    a, b = sorted((a, b), key=lambda n: n not in _RELATIONS)
    what = f"{broken} do not go together, and do when {one.headers[a]} and {one.headers[b]} change places"
    return pair_of(one, a, b, what)


def pair_of(one: Recording, a: str, b: str, what: str) -> Finding:
    """The finding that two columns stand under one another's names, and how to say so.

    Parameters
    ----------
    one : In program axes.
    a, b : The two channels.
    what : By what it is known.
    """
    header, there = one.headers[a], one.headers[b]
    text = f"{what}: channels exchanged, {header} and {there}"
    names = [_WORDS.get(n, n) for n in (a, b)]
    remedy = f'trial.toml: [channels] "{there}" = "{names[0]} [UNIT]" and "{header}" = "{names[1]} [UNIT]", '
    return finding_of(one, "exchanged_channels", (a, b), float(one.rows[0][0]), text, remedy + "or mend the file")
