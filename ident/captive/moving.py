"""A body that moves in the axes of its loads: turned sample by sample, moments about its own point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.captive.axes import GROUPS, from_flow, turned_by
from ident.captive.campaign_file import CampaignFile
from ident.captive.channels import Moving
from ident.captive.source import MOTIONS, Source
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError

Array = NDArray[np.float64]

# Motion -> axis that the body moves along; the other motions turn it.
_ALONG = {"surge": 0, "sway": 1, "heave": 2}
_ANGLE = {"roll": "phi", "pitch": "theta", "yaw": "psi"}


def axes_of(source: Source, header: CampaignFile) -> str:
    """What the loads of a source are along: ``body``, ``flow`` or ``tank``."""
    return source.axes or header.frame.axes


def moment_axes_of(source: Source, header: CampaignFile) -> str:
    """What the moments of a source are along, which is what its forces are along unless it is stated."""
    return source.moment_axes or ("" if source.axes else header.frame.moment_axes) or axes_of(source, header)


@dataclass(frozen=True)
class _Turn:
    """Loads of an oscillation to the body's axes and its own moment point, sample by sample.

    Attributes
    ----------
    motion : Of the body.
    at : Load -> its channel. signs : (6,) of the frame, load by load. sense : Sign of the displacement.
    point : Moment point that stays where the body moves from; None where it moves with the body.
    swings : Whether the loads are along axes that do not turn with the body.
    still : (3, 3) turn of the angles that the body stands at; None where it stands at none.
    """

    motion: str
    at: dict[str, int]
    signs: Array
    sense: float
    point: Array | None
    swings: bool
    still: Array | None

    def __call__(self, time: Array, values: Array, displacement: Array) -> Array:
        loads = np.full((len(values), 6), np.nan)
        for k, o in enumerate(OUTPUTS):
            if o in self.at:
                loads[:, k] = values[:, self.at[o]] * self.signs[k]
        moved = self.sense * displacement
        whole = np.broadcast_to(np.eye(3), (len(moved), 3, 3))
        swing = whole if self.motion in _ALONG else turned_by(self.motion, moved)
        if self.point is not None:
            loads[:, 3:] -= _cross(self._lever(self.point, moved, swing), loads[:, :3])
        if self.swings or self.still is not None:
            matrix = swing if self.swings else whole
            if self.still is not None:
                matrix = matrix @ self.still
            for k in (0, 3):
                loads[:, k : k + 3] = _product(matrix, loads[:, k : k + 3])
        out = values.copy()
        for k, o in enumerate(OUTPUTS):
            if o in self.at:
                out[:, self.at[o]] = loads[:, k] * self.signs[k]
        return out

    def _lever(self, point: Array, moved: Array, swing: Array) -> Array:
        """Where the point went while the body turned about the vehicle's origin, or moved along."""
        if self.motion not in _ALONG:
            return np.einsum("nji,j->ni", swing, point) - point
        lever = np.zeros((len(moved), 3))
        lever[:, _ALONG[self.motion]] = moved
        return lever


def moving_body(
    names: list[str],
    source: Source,
    header: CampaignFile,
    numbers: dict[str, float],
    moments_about: str,
    where: str,
) -> Moving | None:
    """What turns the loads of an oscillation to the body's axes and its own moment point.

    Parameters
    ----------
    names : Channels, time left out.
    source, header : For axes, motion, frame and moment point.
    numbers : Stated quantities, for the angles the body stands at.
    moments_about : ``body``, or ``fixed`` where the point stays in the axes of the loads.
    where : The campaign file.

    Returns
    -------
    None where the loads are along the body and about its own point already.

    Raises
    ------
    InputError
        For loads along the flow, which turns in an oscillation, and for a load that is needed and not measured.
    """
    rule, axes, frame = source.reduction, axes_of(source, header), header.frame.frame
    assert rule is not None
    if rule.kind != "oscillatory":
        return None
    assert rule.motion is not None
    refuse_two_sets(source, header, where)
    if axes == "flow":
        text = "tank or body: the flow itself turns in an oscillation"
        raise InputError(f"{where}, key axes", "'flow' for an oscillation", text)
    ittc = -1.0 if header.frame.angles == "ittc" else 1.0
    alpha, beta = numbers.get("alpha", 0.0), ittc * numbers.get("beta", 0.0)
    turns = rule.motion not in _ALONG
    stands = axes == "tank" and (alpha != 0.0 or beta != 0.0)
    if axes == "tank" and turns and {"yaw": alpha, "pitch": beta, "roll": abs(alpha) + abs(beta)}[rule.motion]:
        wrong = f"axes of the tank, {rule.motion} and angles out of its plane"
        raise InputError(f"{where}, key axes", wrong, "loads along the body's axes")
    swings = turns and axes == "tank"
    point = np.array(frame.vector([header.moment_point.x_m, header.moment_point.y_m, header.moment_point.z_m]))
    carried = moments_about == "fixed" and (not turns or bool(point.any()))
    if not (swings or stands or carried):
        return None
    at = {o: names.index(o) for o in OUTPUTS if o in names}
    sense = frame.sign(_ANGLE[rule.motion]) if turns else frame.sign("xyz"[_ALONG[rule.motion]])
    moved = _Turn(
        motion=rule.motion,
        at=at,
        signs=np.array([frame.sign(o) for o in OUTPUTS], dtype=float),
        sense=sense,
        point=point if carried else None,
        swings=swings,
        still=from_flow(np.array([alpha]), np.array([beta]))[0] if stands else None,
    )
    _measured(moved, names, at, where)
    return moved


def _cross(lever: Array, force: Array) -> Array:
    """Lever x force; a force that is not measured counts where its arm is not zero."""
    x, y, z = lever.T
    fx, fy, fz = force.T
    pairs = [((y, fz), (z, fy)), ((z, fx), (x, fz)), ((x, fy), (y, fx))]
    return np.stack([_times(*a) - _times(*b) for a, b in pairs], axis=1)


def _times(arm: Array, force: Array) -> Array:
    return np.where(arm == 0.0, 0.0, arm * force)


def _product(matrix: Array, loads: Array) -> Array:
    parts = [np.where(matrix[:, :, j] == 0.0, 0.0, matrix[:, :, j] * loads[:, j : j + 1]) for j in range(3)]
    return parts[0] + parts[1] + parts[2]


def _measured(moved: Moving, names: list[str], at: dict[str, int], where: str) -> None:
    """Refuse a load whose turn or moment needs another that is not measured."""
    trial = moved(np.zeros(1), np.ones((1, len(names))), np.full(1, 0.1))
    lost = [o for o, c in at.items() if np.isnan(trial[0, c])]
    if lost:
        others = [o for group in GROUPS for o in group if o not in at]
        text = f"{' '.join(others)} measured too: the body moves in the axes of its loads, and {lost[0]} needs them"
        raise InputError(f"{where}, key source.axes or source.moments_about", f"no {' '.join(others)}", text)


def refuse_two_sets(source: Source, header: CampaignFile, where: str) -> None:
    """Refuse forces along one set of axes and moments along another in an oscillation.

    Raises
    ------
    InputError
        Naming the key.
    """
    forces, moments = axes_of(source, header), moment_axes_of(source, header)
    if moments != forces:
        text = f"{forces!r}: moments of an oscillation are along the axes of its forces"
        raise InputError(f"{where}, key moment_axes", repr(moments), text)


def refuse_tables(source: Source, header: CampaignFile, angles: bool, where: str) -> None:
    """Harmonics in a table cannot be turned after the fact, but where nothing turns.

    Raises
    ------
    InputError
        For loads along flow or tank in an oscillation that turns the body, or at an angle.
    """
    axes = axes_of(source, header)
    if source.reduction is None:
        return
    refuse_two_sets(source, header, where)
    if axes == "body":
        return
    turns = source.reduction.motion not in _ALONG
    if axes == "flow" or turns or angles:
        text = "harmonics along the body's axes: those of a turning load are not the turned harmonics; or its history"
        raise InputError(f"{where}, key axes", f"{axes!r} for a table of harmonics", text)
    assert source.reduction.motion in MOTIONS
