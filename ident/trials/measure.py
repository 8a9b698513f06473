"""Metrics of a recorded maneuver, each with a standard error, by the estimators that flights are measured with.

The estimators of ``ident.metrics`` are applied to the most likely smooth path of each channel, and to
draws from its posterior, with execute and base course drawn from their errors: the spread of a metric
over the draws about its value, and what a second smoothing changes, make its standard error: noise and
sampling, the bias of an extreme and the bias of smoothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.timeseries.smoothing import SmoothPath
from ident.trials.alignment import Start
from ident.trials.drawn import Drawn, Metrics
from ident.trials.earth import place_of
from ident.trials.estimators import estimator, run_out
from ident.trials.keeping import Steering, rudder_used, steering_of
from ident.trials.maneuvers import Maneuver, control_of, turn_ends
from ident.trials.reading import Recording
from ident.trials.spec import TrialFile

Array = NDArray[np.float64]
Place = tuple[float, float] | None
DRAWS = 200
_STEP_S, _GRID = 0.15, (1200, 3000)
# No record says when and where more closely than this, in the unit of the metric.
_LEAST = {"deg": 1e-3, "s": 1e-3, "m": 1e-3, "deg/s": 1e-4, "m/s": 1e-4, "-": 1e-5, "%": 1e-3, "deg s/deg": 1e-3}


@dataclass(frozen=True)
class Value:
    """A metric: value, standard error, unit."""

    value: float
    sigma: float
    unit: str

    def to_dict(self) -> dict[str, float | str]:
        """For a machine to read."""
        return {"value": self.value, "sigma": self.sigma, "unit": self.unit}


def unit_of(name: str) -> str:
    """Unit of a metric, by its name."""
    for end, unit in (
        ("_degps", "deg/s"),
        ("_mps", "m/s"),
        ("_deg", "deg"),
        ("_percent", "%"),
        ("_m", "m"),
        ("_s", "s"),
        ("_rps", "1/s"),
    ):
        if name.endswith(end):
            return unit
    return "deg/s" if "degps" in name and not name.endswith("deg") else "-"


def _grid(begin: float, end: float) -> Array:
    """Times at which draws are measured: fine enough for straight lines between them."""
    return np.linspace(begin, end, int(np.clip((end - begin) / _STEP_S, *_GRID)))


def _most_likely(paths: dict[str, SmoothPath], grid: Array, start: Start, origin: Place) -> Drawn:
    values = {k: p(grid) for k, p in paths.items()}
    return Drawn(grid, values, {k: p(grid, 1) for k, p in paths.items()}, start.angle, origin)


def _draws(
    paths: dict[str, SmoothPath], grid: Array, start: Start, origin: Place, count: int, seed: int
) -> list[Drawn]:
    """Draws of every channel, of the execute and of the base course."""
    rng = np.random.default_rng(seed)
    moved = start.time_sigma * rng.standard_normal(count)
    base = None if start.angle is None else start.angle + start.angle_sigma * rng.standard_normal(count)
    drawn = {name: path.drawn(count, rng) for name, path in paths.items()}
    draws = []
    for i in range(count):
        one = {name: d[i] for name, d in drawn.items()}
        at = np.clip(grid + moved[i], *_range(one)) if moved[i] else grid
        values, rates = {k: p(at) for k, p in one.items()}, {k: p(at, 1) for k, p in one.items()}
        draws.append(Drawn(at - moved[i], values, rates, None if base is None else float(base[i]), origin))
    return draws


def _repeated(
    paths: dict[str, SmoothPath], grid: Array, start: Start, origin: Place, pairs: int, seed: int = 1
) -> list[Drawn]:
    """Channels as the same record would give them with other noise, each noise with its opposite."""
    rng = np.random.default_rng(seed)
    made = {name: path.repeated(pairs, rng) for name, path in paths.items()}
    return [
        _most_likely({name: several[i][side] for name, several in made.items()}, grid, start, origin)
        for i in range(pairs)
        for side in (0, 1)
    ]


def _range(paths: dict[str, SmoothPath]) -> tuple[float, float]:
    """Times that every path has."""
    return max(float(p.knots[4]) for p in paths.values()), min(float(p.knots[-5]) for p in paths.values())


def _measured_on(measure: Callable[[Drawn], Metrics], several: list[Drawn], names: Metrics) -> dict[str, list[float]]:
    """Values of each metric on some draws, as far as they have it."""
    samples: dict[str, list[float]] = {name: [] for name in names}
    for one in several:
        for name, value in measure(one).items():
            if name in samples and value is not None:
                samples[name].append(value)
    return samples


def with_errors(
    measure: Callable[[Drawn], Metrics], likely: Drawn, again: Drawn, draws: list[Drawn], repeated: list[Drawn]
) -> dict[str, Value]:
    """Metrics of the most likely path less their bias by noise, with their spread and the bias of smoothing.

    Parameters
    ----------
    measure : Measures a draw.
    likely, again : The most likely channels, and these smoothed once more.
    draws : From the posterior.
    repeated : Records with other noise about ``again``: what their metrics have more is the bias by noise. Where it
        is larger than the spread, a metric jumps (a swing that just leaves a band): it stays, and the spread is wider.
    """
    best, twice = measure(likely), measure(again)
    spread, noisy = _measured_on(measure, draws, best), _measured_on(measure, repeated, best)
    metrics = {}
    for name, value in best.items():
        drawn = np.array(spread[name])
        if value is None or drawn.size < 0.9 * len(draws):
            continue
        unit = unit_of(name)
        smoother = twice.get(name)
        bias = 0.0 if smoother is None else smoother - value
        size = float(np.std(drawn))
        high = 0.0 if smoother is None or len(noisy[name]) < len(repeated) else float(np.mean(noisy[name])) - smoother
        if abs(high) > size:
            high, size = 0.0, math.sqrt(float(np.mean((drawn - value) ** 2)))
        sigma = math.sqrt(size**2 + bias**2 + _LEAST.get(unit, 1e-6) ** 2)
        metrics[name] = Value(float(value) - high, sigma, unit)
    return metrics


def measured_until(one: Recording, maneuver: Maneuver, paths: dict[str, SmoothPath]) -> float:
    """Where the measurement ends on the record's clock [s]: a turn where the rudder leaves its side."""
    end = _range(paths)[1]
    if maneuver.kind == "turning_circle" and (control := control_of(one)) is not None:
        end = min(end, turn_ends(control) or end)
    return end


def measured(
    one: Recording, maneuver: Maneuver, start: Start, paths: dict[str, SmoothPath], spec: TrialFile, count: int = DRAWS
) -> dict[str, Value]:
    """Metrics of a recording, each with its standard error.

    Parameters
    ----------
    one, maneuver, start, paths : From reading, ``maneuver_of``, ``start_of`` and ``alignment.paths``.
    spec : Statements on the record.
    count : Draws from the posterior.

    Raises
    ------
    InputError
        When the record lacks a channel that the maneuver is measured on.
    """
    grid = _grid(start.time, measured_until(one, maneuver, paths))
    origin = place_of(one, spec, start.time)
    likely = _most_likely(paths, grid, start, origin)
    measure = estimator(one, maneuver, start, spec, likely)
    again = _most_likely({k: p.again() for k, p in paths.items()}, grid, start, origin)
    repeated = _repeated(paths, grid, start, origin, max(4, count // 4))
    metrics = with_errors(measure, likely, again, _draws(paths, grid, start, origin, count, 0), repeated)
    if maneuver.kind == "stopping" and "heading_change_deg" in metrics:
        metrics["heading_change_deg"] = _run_out(metrics["heading_change_deg"], likely)
    if maneuver.kind == "course_keeping":
        metrics = _after_a_push(metrics, steering_of(one, start, spec))
    return metrics | _approach_speed(one, paths, start)


def _run_out(change: Value, likely: Drawn) -> Value:
    """The change of heading with the error of how the boat turns on below the speed at which its record is left.

    Half the turn at its last rate is added: none, or all of it, is as likely.
    """
    turned = run_out(likely)
    return Value(change.value, math.hypot(change.sigma, abs(math.degrees(turned)) / math.sqrt(12.0)), change.unit)


def _after_a_push(metrics: dict[str, Value], steering: Steering | None) -> dict[str, Value]:
    """Metrics of course keeping with the error of when the autopilot took over, and the rudder it used."""
    if steering is None:
        return metrics
    if "settling_s" in metrics:
        one = metrics["settling_s"]
        metrics["settling_s"] = Value(one.value, math.hypot(one.sigma, steering.sigma), one.unit)
    used = rudder_used(steering)
    if used is not None:
        metrics["rudder_rms_deg"] = Value(used[0], math.hypot(used[1], _LEAST["deg"]), "deg")
    return metrics


def _approach_speed(one: Recording, paths: dict[str, SmoothPath], start: Start) -> dict[str, Value]:
    """Speed at the execute, by the log, else by the track."""
    at = start.time
    for name in ("U", "u"):
        if name in paths:
            value, sigma = float(paths[name](at)), float(paths[name].deviation(at)[0])
            return {"approach_speed_mps": Value(abs(value), math.hypot(sigma, 1e-4), "m/s")}
    if "north" in paths:
        vn, ve = float(paths["north"](at, 1)), float(paths["east"](at, 1))
        sigma = float(paths["north"].deviation(at, 1)[0])
        return {"approach_speed_mps": Value(math.hypot(vn, ve), math.hypot(sigma, 1e-4), "m/s")}
    return {}
