"""Tables of harmonics, a row an oscillation: as parts in phase and in quadrature, then as the four runs of each."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.campaign_file import CampaignFile
from ident.captive.channels import Moving
from ident.captive.left_behind import ARMS
from ident.captive.moving import moving_body
from ident.captive.oscillation import Oscillation, amplitude_of, states
from ident.captive.quantities import HARMONICS
from ident.captive.source import Source
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError

Array = NDArray[np.float64]
# Phases at which harmonics are summed and found again: exact up to the third, products of the first two among them.
_PHASES = 2.0 * math.pi * np.arange(16) / 16


def cartesian(table: pd.DataFrame, where: str) -> pd.DataFrame:
    """Amplitudes and phases of harmonics as parts in phase and in quadrature with the displacement.

    A sin(k w t + phase) = A cos(phase) sin(k w t) + A sin(phase) cos(k w t); a lag is a phase behind.

    Raises
    ------
    InputError
        For an amplitude without one of phase and lag, or beside parts of the same harmonic.
    """
    out = table
    for output, k in itertools.product(OUTPUTS, ("", "2", "3")):
        names = {kind: f"{output}_{kind}{k}" for kind in ("amp", "phase", "lag", "in", "out")}
        given = {kind for kind, name in names.items() if name in out}
        if not given & {"amp", "phase", "lag"}:
            continue
        if given not in ({"amp", "phase"}, {"amp", "lag"}):
            wrong = " ".join(sorted(names[kind] for kind in given))
            text = (
                f"{names['amp']} with one of {names['phase']} (ahead of the displacement) and {names['lag']} (behind)"
            )
            raise InputError(f"{where}, key source.columns", wrong, text)
        phase = out[names["phase"]] if "phase" in given else -out[names["lag"]]
        parts = {names["in"]: out[names["amp"]] * np.cos(phase), names["out"]: out[names["amp"]] * np.sin(phase)}
        out = out.drop(columns=[names[kind] for kind in given]).assign(**parts)
    return out


def instants(table: pd.DataFrame, source: Source, header: CampaignFile, where: str, campaign: str) -> pd.DataFrame:
    """Rows of harmonics to the four states of each oscillation, moments about the point that goes with the body.

    Parameters
    ----------
    table : Harmonics in phase and in quadrature, SI.
    source, header : For motion, frame and moment point.
    where, campaign : The file of the table and that of the campaign, for messages.

    Raises
    ------
    InputError
        As ``states``; for a moment about a fixed point whose force is not given.
    """
    assert source.reduction is not None
    frame, ittc = header.frame.frame, header.frame.angles == "ittc"
    made, motion = [], str(source.reduction.motion)
    if "frequency" in table and source.reduction.frequency_hz is not None:
        raise InputError(f"{campaign}, key source.reduction.frequency_hz", "a column frequency too", "one of the two")
    if "displacement" in table and source.reduction.amplitude is not None:
        raise InputError(f"{campaign}, key source.reduction.amplitude", "a column displacement too", "one of the two")
    for run in table.to_dict("records"):
        place = f"{where}, row {run['row']}"
        one = Oscillation.of_row({str(k): v for k, v in run.items()})
        given = [o for o, parts in one.harmonics.items() if o in OUTPUTS and not np.isnan(parts).all()]
        moving = moving_body(given, source, header, {}, source.moments_about or "body", campaign)
        if moving is not None:
            arms = ARMS[motion][1].items() if motion in ARMS else ()
            forces = {force for moment, (force, _) in arms if moment in given} if motion in ARMS else set("XYZ")
            bare = [f"{o}_mean" for o in given if o in forces and math.isnan(one.harmonics[o][0])]
            if bare:
                text = (
                    "its mean: a body that moves away from a fixed moment point takes it times the displacement along"
                )
                raise InputError(f"{place}, column {bare[0]}", "nothing", text)
            one = _about_own_point(one, given, moving, amplitude_of(one, source.reduction, place))
        made += states(one, source.reduction, frame, ittc, place)
    return pd.DataFrame(made)


def _about_own_point(one: Oscillation, loads: list[str], moving: Moving, amplitude: float) -> Oscillation:
    """Harmonics of loads that a body takes along, from those about a point (or along axes) that stays.

    The displacement is A sin(theta); a product of it and a force has harmonics up to one beyond the force's.
    """
    waves = [np.ones_like(_PHASES), *(f(k * _PHASES) for k in (1, 2, 3) for f in (np.sin, np.cos))]
    rows = np.stack(waves, axis=1)
    parts = np.stack([np.nan_to_num(one.harmonics[o]) for o in loads], axis=1)
    moved = moving(_PHASES, rows @ parts, amplitude * np.sin(_PHASES))
    found = (rows / (rows**2).sum(axis=0)).T @ moved
    assert len(found) == len(HARMONICS)
    harmonics = one.harmonics | {o: found[:, i] for i, o in enumerate(loads)}
    return Oscillation(one.state, harmonics, one.covariance, one.frequency, one.amplitude)
