"""Single samples that no boat made: found against their neighbours, left out, and said."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ident.checks.findings import Finding, spans
from ident.timeseries import MAD_TO_SIGMA
from ident.trials.reading import Recording

Array = NDArray[np.float64]
_ANGLES = ("psi", "course")
# So many robust standard deviations from the median of five.
_FAR = 12.0


def _away(value: Array, angle: bool) -> Array:
    """Distance of each sample from the median of five around it."""
    padded = np.pad(value, 2, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, 5)
    if angle:
        turned = np.angle(np.exp(1j * (around - value[:, None])))
        return np.asarray(np.median(turned, axis=1))
    return np.asarray(np.median(around, axis=1) - value)


def without_spikes(one: Recording) -> Recording:
    """A recording less its spikes, with a finding for each channel that has some."""
    channels, findings = dict(one.channels), list(one.findings)
    for name, record in one.channels.items():
        if len(record) < 9 or name in ("dH", "dV", "dH_order", "n"):
            continue
        away = np.abs(_away(record.value, name in _ANGLES))
        usual = MAD_TO_SIGMA * float(np.median(away))
        steps = np.abs(np.diff(record.value))
        if name in _ANGLES:
            steps = np.abs(np.angle(np.exp(1j * np.diff(record.value))))
        limit = max(_FAR * usual, 5.0 * float(np.percentile(steps, 95)), 1e-9)
        bad = away > limit
        if not bad.any() or bad.mean() > 0.05:
            continue
        rows = tuple(one.row_at(float(t)) for t in record.abscissa[bad])
        size = float(record.value[bad][0])
        shown = math.degrees(size) if record.unit.startswith("rad") else size
        what = f"{int(bad.sum())} single samples far from their neighbours, the first {shown:.4g} (row {spans(rows)})"
        remedy = "they are left out; look at the recorder, or blank the cells"
        findings.append(Finding("spikes", "warning", one.file, rows, (one.headers[name],), what, remedy))
        channels[name] = record.kept(~bad)
    return one.with_(channels=channels, findings=tuple(findings))
