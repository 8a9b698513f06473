"""Single samples that no boat made: found against their neighbours, left out, and said."""

from __future__ import annotations

import math

from ident.checks.findings import Finding, spans
from ident.timeseries.neighbours import far_from_neighbours
from ident.trials.reading import Recording

_ANGLES = ("psi", "course")


def without_spikes(one: Recording) -> Recording:
    """A recording less its spikes, with a finding for each channel that has some."""
    channels, findings = dict(one.channels), list(one.findings)
    for name, record in one.channels.items():
        if name in ("dH", "dV", "dH_order", "n"):
            continue
        bad = far_from_neighbours(record.value, name in _ANGLES)
        if not bad.any():
            continue
        rows = tuple(one.row_at(float(t)) for t in record.abscissa[bad])
        size = float(record.value[bad][0])
        shown = math.degrees(size) if record.unit.startswith("rad") else size
        what = f"{int(bad.sum())} single samples far from their neighbours, the first {shown:.4g} (row {spans(rows)})"
        remedy = "they are left out; look at the recorder, or blank the cells"
        findings.append(Finding("spikes", "warning", one.file, rows, (one.headers[name],), what, remedy))
        channels[name] = record.kept(~bad)
    return one.with_(channels=channels, findings=tuple(findings))
