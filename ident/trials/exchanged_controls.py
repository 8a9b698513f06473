"""Rudder, planes and angles under one another's names, told by which angle answers to which control."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ident.checks.findings import Finding
from ident.trials.exchanged_pairs import PLAIN, pair_of
from ident.trials.maneuvers import steered
from ident.trials.reading import Recording
from sim.files.record import Record

_POINTS = 600
# By how much more a heading has to go with one control than with another, or with its rudder than that with it, to
# be steered by it: in records of boats and ships, 0.1 to 0.8.
_CLOSER = 0.2
# A heading that has turned so far has been steered before.
_TURNED = math.radians(2.0)


def exchanged_controls(one: Recording) -> Iterator[Finding]:
    """Rudder and planes, or two angles, exchanged: the maneuver shows under another control or angle only."""
    controls = [c for c in ("dH", "dV") if c in one.channels]
    if "dH" not in controls or "psi" not in one.channels:
        return
    forwards = _followed(one.channels["psi"], one.channels["dH"])
    if _followed(one.channels["dH"], one.channels["psi"]) > forwards + _CLOSER:
        what = f"{one.headers['dH']} turns as a heading does when {one.headers['psi']} is its rudder"
        yield pair_of(one, "psi", "dH", what)
        return
    by_rudder, turns = steered(one, "psi", "dH"), _leaves(one.channels["psi"], _TURNED)
    if by_rudder and "dV" in controls and steered(one, "psi", "dV"):
        rudder, planes = (_followed(one.channels["psi"], one.channels[c]) for c in ("dH", "dV"))
        if planes > rudder + _CLOSER:
            what = f"{one.headers['psi']} follows {one.headers['dV']} more closely than {one.headers['dH']}"
            yield pair_of(one, "dH", "dV", what)
            return
    if by_rudder and (turns is None or (_moved_at(one.channels["dH"]) or 0.0) <= turns):
        return
    for other in (c for c in PLAIN if c in one.channels and c not in ("psi", "r", "north", "east", "dH")):
        record = one.channels[other]
        if not record.unit.startswith("rad"):
            # Degrees under the header of another unit.
            record = replace(record, value=record.value / math.degrees(1.0))
        if steered(one, "psi", other, record) and (_moved_at(record) or 0.0) <= (turns or 0.0):
            what = f"{one.headers['psi']} answers to {one.headers[other]} and not to {one.headers['dH']}"
            yield pair_of(one, "dH", other, what)
            return
    if by_rudder:
        return
    if not ("dV" in controls and "theta" in one.channels and steered(one, "theta", "dV")):
        for angle in ("theta", "phi"):
            if angle in one.channels and "r" not in one.channels and steered(one, angle, "dH"):
                what = f"{one.headers[angle]} answers to {one.headers['dH']}, and {one.headers['psi']} does not"
                yield pair_of(one, "psi", angle, what)
                return


def _followed(angle: Record, control: Record) -> float:
    """Largest correlation of an angle's rate with a control some time before, within a tenth of the record."""
    lo, hi = max(angle.abscissa[0], control.abscissa[0]), min(angle.abscissa[-1], control.abscissa[-1])
    t = np.linspace(lo, hi, _POINTS)
    rate, moved, later = np.gradient(angle.at(t), t), control.at(t), _POINTS // 10
    if min(float(np.ptp(rate)), float(np.ptp(moved))) <= 0.0:
        return 0.0
    pairs = ((rate[k:], moved[: _POINTS - k]) for k in range(0, later, max(1, later // 20)))
    return max(abs(float(np.corrcoef(a, b)[0, 1])) if np.ptp(a) and np.ptp(b) else 0.0 for a, b in pairs)


def _leaves(record: Record, size: float) -> float | None:
    """When a channel has left its first value by a size for good as a median of three; None where it does not."""
    x = record.value
    middle = np.median(np.lib.stride_tricks.sliding_window_view(x, 3), axis=1)
    away = np.flatnonzero(np.abs(middle - float(np.median(x[:3]))) > size)
    return float(record.abscissa[int(away[0]) + 1]) if away.size else None


def _moved_at(control: Record) -> float | None:
    """When a control first moves; at once where it begins at its angle."""
    most = float(np.max(np.abs(control.value)))
    if abs(float(np.median(control.value[:3]))) > 0.5 * most:
        return float(control.abscissa[0])
    return _leaves(control, 0.2 * most)
