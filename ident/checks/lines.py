"""Slopes of runs against what the boat's lines give: a factor that stands in every file."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ident.checks.findings import Evidence, Finding, Rule, check
from ident.checks.physics import slope
from sim.files.errors import InputError
from sim.hull.derivatives import Derivative, derivatives

# Test, angle, load -> name of its slope in prime form.
SLOPES = (
    ("drift_horizontal", "beta", "Y", "Y_v"),
    ("drift_horizontal", "beta", "N", "N_v"),
    ("drift_vertical", "alpha", "Z", "Z_w"),
    ("drift_vertical", "alpha", "M", "M_w"),
)
# Factors on a dimensionless load that a slip puts into every file.
_KNOT = 1852.0 / 3600.0
_SLIPS = {
    "speeds in knots taken for m/s": _KNOT**2,
    "speeds in m/s taken for knots": _KNOT**-2,
    "speeds in km/h taken for m/s": 3.6**-2,
    "angles in radians taken for degrees": math.radians(1.0) ** -1,
}
_SIGN = "a sign of the angles or of the loads"


@check("lines")
def against_the_lines(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Slopes over drift and incidence of all files beside those of slender-body theory and lattice."""
    body, vehicle, runs = evidence.body, evidence.vehicle, evidence.runs
    if body is None or vehicle is None or vehicle.geometry is None or runs.empty:
        return
    # Loads kept by part: those of the hull are without its planes.
    by_part = bool(runs["part"].isin([p.name for p in vehicle.planes]).any())
    try:
        known = derivatives(vehicle, with_fins=not by_part)
    except InputError:
        return
    out: dict[str, float] = {}
    files: set[str] = set()
    for test, angle, output, name in SLOPES:
        of_test = runs[(runs["test"] == test) & runs["part"].isin(["", "hull"])]
        value = slope(of_test, angle, output, body)
        if not math.isfinite(value) or value == 0.0:
            continue
        ratio = beyond(value, known[name], rule.limits["errors"])
        if not 1.0 / rule.limits["factor"] <= ratio <= rule.limits["factor"]:
            out[name] = ratio
            files |= set(of_test["file"].astype(str))
    if not out:
        return
    named = ", ".join(f"{name} {ratio:.2g} times" for name, ratio in out.items())
    what = f"{named} what slender-body theory and a lattice make of the lines"
    slip = _slip(list(out.values()), rule.limits["apart"]) if len(out) > 1 else ""
    what += f"; {slip}?" if slip else ""
    # A sign may be the campaign's own; a unit is never.
    severity = "error" if slip and slip != _SIGN else ""
    yield rule.finding(", ".join(sorted(files)), [], sorted({n[0] for n in out}), what, severity)


def beyond(value: float, known: Derivative, errors: float) -> float:
    """Ratio of a slope to the nearest end of what the lines allow; 1 inside.

    Example
    -------
    >>> round(beyond(-0.02, Derivative(-0.05, 0.005, {}), 2.0), 3)
    0.5
    """
    low, high = known.value - errors * known.sigma, known.value + errors * known.sigma
    if low <= value <= high:
        return 1.0
    edge = min((low, high), key=lambda end: abs(end - value))
    return value / edge if edge * value > 0.0 else value / known.value


def _slip(ratios: list[float], apart: float) -> str:
    """The slip that explains every ratio, each within ``apart`` of its factor."""
    if all(r < 0.0 for r in ratios):
        return _SIGN
    likely = [n for n, f in _SLIPS.items() if all(r > 0.0 and abs(math.log(r / f)) < math.log(apart) for r in ratios)]
    return likely[0] if likely else ""
