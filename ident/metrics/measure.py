"""Which metrics a case has, measured on the flight and on every reference series alike."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.metrics import in_waves as sea_cases
from ident.metrics import turning, vertical
from ident.metrics.in_waves import InWaves
from ident.metrics.metric import Metric, Metrics, Values
from ident.metrics.turning import SpiralPoint
from ident.metrics.zigzag import roll_decay, zigzag
from sim.flight.case import Case
from sim.flight.maneuver import CONTROLS, STATE
from sim.flight.series import Series
from sim.flight.simulation import Simulation

Array = NDArray[np.float64]
Channels = dict[str, Array]
_DERIVED = ("U", "D0", "s")
_HORIZONTAL = 1


def channels_of(simulation: Simulation) -> Channels:
    """Every channel of a flight, with the end of the run as last sample."""
    channels = {name: simulation[name] for name in (*simulation.columns, *_DERIVED)}
    time, state = simulation.end[0], simulation.end[1:]
    if time <= channels["t"][-1] + 1e-9 or not np.isfinite(state).all():
        return channels
    last = {name: values[-1] for name, values in channels.items()} | {"t": time}
    last |= dict(zip(simulation.columns[STATE:CONTROLS], state, strict=True))
    last["U"] = math.sqrt(float(state[:3] @ state[:3]))
    last["D0"] = last["z"] + simulation.depth_offset
    last["s"] += math.hypot(last["x"] - channels["x"][-1], last["y"] - channels["y"][-1])
    return {name: np.append(values, last[name]) for name, values in channels.items()}


def reference_channels(reference: Series, source: str) -> Channels:
    """Channels of a source on the abscissa of its first channel, in radians."""
    series = reference.measured_on(source)
    if not series:
        return {}
    along = next(iter(series.values())).abscissa
    channels = {name: record.at(along) for name, record in series.items()}
    return channels | {reference.abscissa: along}


def _step_ends(case: Case, simulation: Simulation, key: str) -> list[tuple[float, float]]:
    """Value [rad] or [rad/s] and end [s] of each step of dH that came to its end."""
    times = [float(t) for t, axis, _ in simulation.steps if int(axis) == _HORIZONTAL]
    values = [math.radians(getattr(s, key) or 0.0) for s in case.command.dH.step]
    return list(zip(values, times, strict=False))


def _first_step_end(simulation: Simulation, axis: int) -> float | None:
    times = [float(t) for t, number, _ in simulation.steps if int(number) == axis]
    return times[0] if times else None


def _surfaced(case: Case, simulation: Simulation) -> bool:
    """Whether a point that the case watches is at the surface at the end."""
    state = simulation.end[1:]
    sine, cosine = math.sin(state[10]), math.cos(state[10])
    for event in case.run.stop:
        if event.channel == "point_depth" and event.point_m:
            x, y, z = event.point_m
            depth = state[8] - sine * x + cosine * (math.sin(state[9]) * y + math.cos(state[9]) * z)
            if depth <= 1e-6:
                return True
    return False


def _flown_only(case: Case, simulation: Simulation, waves: InWaves) -> tuple[Values, list[SpiralPoint] | None]:
    """Metrics that need the programme of the flight, and the curve of a spiral."""
    channels = channels_of(simulation)
    kind = case.maneuver
    if kind == "direct_spiral":
        return turning.direct_spiral(channels, _step_ends(case, simulation, "value_deg"))
    if kind == "reverse_spiral":
        return turning.reverse_spiral(channels, _step_ends(case, simulation, "yaw_rate_degps"))
    if kind == "pull_out":
        return turning.pull_out(channels, _step_ends(case, simulation, "value_deg")), None
    if kind == "stopping":
        return turning.stopping(channels, bool(channels["u"][-1] <= 1e-6)), None
    if kind == "meander":
        pitch = float(simulation.trim.state[10]) if simulation.trim else float(channels["theta"][0])
        return vertical.meander(channels, _first_step_end(simulation, 0), pitch), None
    if kind == "depth_change":
        return vertical.depth_change(channels, case.command.dV.step[-1].distance_m), None
    if kind == "course_keeping":
        return vertical.course_keeping(channels, _first_step_end(simulation, _HORIZONTAL)), None
    if kind == "regular_waves":
        return sea_cases.regular_waves(waves.harmonics), None
    if kind == "irregular_waves":
        return sea_cases.irregular_waves(waves.statistics, simulation), None
    if kind == "rise":
        return vertical.rise(channels, _surfaced(case, simulation)), None
    return {}, None


def _label(case: Case, source: str) -> str:
    return "published_model" if case.reference and source == case.reference.published_model else source


def _sources(case: Case) -> list[str]:
    if case.reference is None:
        return []
    published = case.reference.published_model
    return [*case.reference.compare, *([published] if published else [])]


def _transposed(columns: dict[str, Values]) -> Metrics:
    names = list(dict.fromkeys(name for column in columns.values() for name in column))
    return {name: Metric({label: column.get(name) for label, column in columns.items()}) for name in names}


@dataclass(frozen=True)
class Measured:
    """What was measured on a flight and on its references.

    Attributes
    ----------
    metrics : By name.
    curve : The points of a spiral, or None.
    in_waves : Harmonics or statistics of the flight, which the metrics are from.
    """

    metrics: Metrics
    curve: list[SpiralPoint] | None
    in_waves: InWaves


def measured(case: Case, simulation: Simulation, reference: Series, as_started: dict[str, Simulation]) -> Measured:
    """Metrics of the flight, of the flights from a source's own start, and of the references.

    Parameters
    ----------
    case, simulation, reference : What was flown and what it is held against.
    as_started : Flights from the start of a source's record, by source.
    """
    flights = {"simulated": simulation} | {f"simulated_as_{k}": v for k, v in as_started.items()}
    waves = {label: sea_cases.in_waves(case, flight) for label, flight in flights.items()}
    curve = None
    columns: dict[str, Values]
    if case.maneuver == "turning_circle":
        columns = {label: turning.turning_circle(channels_of(flight)) for label, flight in flights.items()}
        if case.waves:
            columns = {label: turn | sea_cases.turn_drift(flights[label]) for label, turn in columns.items()}
        for source in _sources(case):
            channels = reference_channels(reference, source)
            if {"x", "y"} <= set(channels):
                columns[_label(case, source)] = turning.turning_circle(channels)
    elif case.maneuver is not None:
        columns = {}
        for label, flight in flights.items():
            columns[label], points = _flown_only(case, flight, waves[label])
            curve = points if label == "simulated" else curve
    elif case.initial.heel_deg and case.initial.state == "as_given":
        columns = _of_angle(case, reference, flights, "phi", None, lambda t, x, _: roll_decay(t, x))
    elif "zigzag" in (case.command.dV.law, case.command.dH.law):
        columns = _zigzags(case, reference, flights)
    else:
        columns = {}
    for value in case.published:
        for column in columns.values():
            column.setdefault(value.metric, None)
        columns.setdefault(value.source, {})[value.metric] = value.value
    return Measured(_transposed(columns), curve, waves["simulated"])


def _of_angle(
    case: Case,
    reference: Series,
    flights: dict[str, Simulation],
    angle: str,
    rate: str | None,
    measure: Callable[[Array, Array, tuple[Array, Array] | None], Values],
) -> dict[str, Values]:
    """Metrics of one angle, and its rate if there is one, by label."""
    columns = {}
    for label, flight in flights.items():
        columns[label] = measure(flight["t"], flight[angle], (flight["t"], flight[rate]) if rate else None)
    for source in _sources(case):
        series = reference.measured_on(source)
        if angle not in series or reference.abscissa != "t":
            continue
        turn = (series[rate].abscissa, series[rate].value) if rate and rate in series else None
        columns[_label(case, source)] = measure(series[angle].abscissa, series[angle].value, turn)
    return columns


def _zigzags(case: Case, reference: Series, flights: dict[str, Simulation]) -> dict[str, Values]:
    horizontal = case.command.dH.law == "zigzag"
    command = case.command.dH if horizontal else case.command.dV
    angle, rate, name = ("psi", "r", "yaw") if horizontal else ("theta", "q", "pitch")
    check, sense = math.radians(command.check_deg), 1 if command.first_deg > 0 else -1

    def measure(t: Array, x: Array, turn: tuple[Array, Array] | None) -> Values:
        return zigzag(t, x, turn, check, sense, name)

    columns = _of_angle(case, reference, flights, angle, rate, measure)
    for label, flight in flights.items():
        # The flight knows its executes exactly.
        for i, (time, _) in enumerate(flight.executes[1:4]):
            columns[label][f"execute_{i + 2}_s"] = float(time)
        if not horizontal:
            t, z, execute = flight["t"], flight["z"], columns[label]["execute_2_s"]
            columns[label]["depth_overshoot_1_m"] = vertical.depth_overshoot(t, z, execute, sense)
    length = flights["simulated"].length
    for source in _sources(case) if not horizontal else []:
        label = _label(case, source)
        if label in columns and "dz_over_L0" in reference.measured_on(source):
            dz = reference.measured_on(source)["dz_over_L0"]
            execute = columns[label]["execute_2_s"]
            over = vertical.depth_overshoot(dz.abscissa, dz.value * length, execute, sense)
            columns[label]["depth_overshoot_1_m"] = over
    return columns
