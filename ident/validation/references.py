"""What of a reference can be compared with a flight, and what of it is left out."""

from __future__ import annotations

import re
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

from ident.timeseries.neighbours import far_from_neighbours
from ident.validation.reference_limits import limits
from sim.files.errors import InputError
from sim.files.record import Record
from sim.flight.case import Case
from sim.flight.series import Series, place_of
from sim.flight.simulation import CHANNELS, Simulation

Array = NDArray[np.float64]
# A reference over a smaller part of the run than this is of another unit of time, or of another run.
_PART = 0.05
# Points that show what is usual.
_ENOUGH = 30
# Of a misprint, at the least, on the line of each neighbour.
_HALF = 0.3
_PLAIN = {c.lower().replace("_", ""): c for c in CHANNELS}


def check_reference(case: Case, reference: Series, where: str) -> list[str]:
    """Refuse sources, channels and units that cannot be compared.

    Returns
    -------
    Notes on channels of the file that no simulation has.

    Raises
    ------
    InputError
        Naming the case file, what was found and what is allowed.
    """
    if case.reference is None or not reference.data:
        return []
    named = {*case.reference.compare, *([case.reference.published_model] if case.reference.published_model else [])}
    for source in sorted(named - set(reference.data)):
        raise InputError(f"{where}, key reference", f"source {source!r}", f"one of {', '.join(reference.data)}")
    for channel in case.reference.channels:
        if channel not in CHANNELS:
            raise InputError(f"{where}, key reference.channels", repr(channel), ", ".join(CHANNELS))
        allowed = {CHANNELS[channel], CHANNELS[channel].replace("rad", "deg")}
        units = {reference[source][channel].shown.unit for source in named if channel in reference[source]}
        if not units:
            raise InputError(f"{where}, key reference.channels", repr(channel), "a channel of the reference file")
        for unit in sorted(units - allowed):
            text = f"{channel} in {unit!r}"
            raise InputError(case.reference.file or where, text, " or ".join(sorted(allowed)))
    said = [*_unknown(case.reference.file or where, reference, named), *_spikes(case, reference)]
    for source in case.reference.compare:
        for channel, record in reference[source].items():
            if channel in case.reference.channels and len(record) < 2:
                file = case.reference.file or where
                raise InputError(
                    place_of(reference, file, source, channel, 0), "one point", "two points or more of a series"
                )
    return said


def _spikes(case: Case, reference: Series) -> list[str]:
    """Single samples far from their neighbours: they are compared, and said."""
    said = []
    for source, channels in reference.data.items():
        for name in case.reference.channels if case.reference else ():
            record = channels.get(name)
            bad = _far(record) if record is not None else np.zeros(0, dtype=bool)
            if record is None or not bad.any():
                continue
            at = f"{reference.abscissa} = {float(record.abscissa[bad][0]):.4g}"
            text = f"{int(bad.sum())} of {len(bad)} points of {name} are far from their neighbours, the first at {at}"
            said.append(f"reference {source}: {text}: a misprint? They are compared as they stand")
    return said


def _far(record: Record) -> NDArray[np.bool_]:
    """Samples far from the median around them, or from the line between their two neighbours."""
    bad = far_from_neighbours(record.value)
    along, value = record.abscissa, record.value
    if len(record) < _ENOUGH:
        return bad
    share = (along[1:-1] - along[:-2]) / (along[2:] - along[:-2])
    off = value[1:-1] - (1.0 - share) * value[:-2] - share * value[2:]
    usual = float(np.percentile(np.abs(off), 95))
    beside = np.zeros(len(record), dtype=bool)
    # A control that stands still between its steps leaves no usual distance.
    beside[1:-1] = (np.abs(off) > limits()["off_line"] * usual) & (usual > 0.0)
    step = np.diff(along)
    beside[1:-1] &= np.maximum(step[1:], step[:-1]) < limits()["gap_of_even"] * float(np.median(step))
    # A misprint puts both its neighbours off their lines by half of it, the other way; a corner does not.
    beside[2:-2] &= (-off[:-2] * off[1:-1] > _HALF * off[1:-1] ** 2) & (-off[2:] * off[1:-1] > _HALF * off[1:-1] ** 2)
    return bad | beside


def _unknown(file: str, reference: Series, named: set[str]) -> list[str]:
    """Sources that nothing names, and channels that are none of a simulation's; a slip of spelling is refused."""
    said = []
    for source, channels in reference.data.items():
        if source not in named:
            rows = sum(len(record) for record in channels.values())
            like = get_close_matches(source, sorted(named), 1)
            more = f"; is it {like[0]!r}?" if like else ""
            said.append(f"reference: source {source!r} with {rows} rows is compared with nothing{more}")
        for name in channels:
            if name in CHANNELS:
                continue
            near = _PLAIN.get(re.sub(r"[\s_]", "", name).lower())
            if near:
                allowed = f"{near}? One of {', '.join(CHANNELS)}"
                raise InputError(f"{file}, column channel", f"{name[:60]!r} of {source[:60]}", allowed)
            said.append(f"reference {source}: channel {name!r} is none of a simulation's and is not compared")
    return said


def compared(along: Array, simulation: Simulation, abscissa: str, what: str) -> NDArray[np.bool_]:
    """Which points of a series lie within a flight.

    Parameters
    ----------
    along : (n,) time [s] or path length [m] of the points.
    simulation, abscissa : The flight, and what ``along`` is.
    what : Source and channel, for the message.

    Raises
    ------
    InputError
        When fewer than two do: an error of one point, mostly the start, says nothing.
    """
    end = float(simulation[abscissa][-1])
    flown = np.asarray(along <= end + 1e-9)
    if int(flown.sum()) >= 2:
        return flown
    unit = "s" if abscissa == "t" else "m"
    text = f"two points or more within the run, which ends at {abscissa} = {end:.4g} {unit}"
    if not flown.any():
        raise InputError(what, f"begins at {abscissa} = {along[0]:.4g}", text)
    wrong = (
        "one point" if len(along) == 1 else f"one of {len(along)} points; the next is at {abscissa} = {along[1]:.4g}"
    )
    raise InputError(what, wrong, text)


def beyond_the_run(
    case: Case, reference: Series, simulation: Simulation, as_started: dict[str, Simulation]
) -> list[str]:
    """Notes on points that lie beyond a flight, and on series that cover little of it.

    Parameters
    ----------
    case, reference : What was flown, and what it is held against.
    simulation, as_started : From ``ident.validation.validate.flights``.
    """
    said = []
    name = reference.abscissa
    for source in case.reference.compare if case.reference else []:
        flight = as_started.get(source, simulation)
        end = float(flight[name][-1])
        kept = {c: r.abscissa for c, r in reference[source].items() if case.reference and c in case.reference.channels}
        beyond = {c: int(np.sum(along > end + 1e-9)) for c, along in kept.items()}
        for number in sorted({n for n in beyond.values() if n}):
            channels = [c for c, n in beyond.items() if n == number]
            of = len(kept[channels[0]])
            text = f"{number} of {of} points of {', '.join(channels)} lie beyond the end of the run"
            said.append(f"reference {source}: {text} at {name} = {end:.4g} and are not compared")
        short = [c for c, along in kept.items() if along[-1] < _PART * end]
        if short:
            last = max(float(kept[c][-1]) for c in short)
            text = f"{', '.join(short)} end at {name} = {last:.4g}, the run at {end:.4g}"
            said.append(f"reference {source}: {text}: is {name} in {'s' if name == 't' else 'm'}?")
    return said
