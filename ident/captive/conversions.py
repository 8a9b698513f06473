"""Runs from the campaign's form to the program's: primes, frame, tare, moment point, scale.

Every function takes a run table (SI, radians) and returns a new one. Order:
dimensionless input is made dimensional at model scale, tare is taken off and everything
turned to the program frame, moments are moved to the vehicle's origin, the model's own
inertia is added back, half models are doubled, and Froude's law brings all to full scale.
"""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from ident.captive.campaign_file import CampaignFile
from ident.captive.oscillation import PHASES
from ident.captive.other_loads import as_measured
from ident.captive.quantities import TAKEN
from ident.captive.run_table import DIRECT, MOTION, excluded
from sim.boat.catalogue import ACCELERATIONS, OUTPUTS
from sim.boat.forces import body_velocity
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.files.frames import Frame

# Loads that remain for a body symmetric about the plane of a half model, and the motions
# that keep the flow symmetric about it.
_DOUBLED = {"port_starboard": ("X", "Z", "M"), "upper_lower": ("X", "Y", "N")}
_ASYMMETRIC = {
    "port_starboard": ("beta", "p", "r", "vdot", "pdot", "rdot"),
    "upper_lower": ("alpha", "p", "q", "wdot", "pdot", "qdot"),
}
# Rounding of a plane that is not deflected [rad].
_AMIDSHIPS = 1e-6
# A radius is printed with three digits or more.
_SAME_RADIUS = 0.02
# Flow beyond 60 deg from the axis is flow across the hull.
_ACROSS = 0.5


def turn(runs: pd.DataFrame, frame: Frame, angles: str) -> pd.DataFrame:
    """Turn loads, rates, accelerations and levers to the program frame, drift to flight sign."""
    turned = runs.copy()
    for quantity in (*OUTPUTS, *MOTION, "x", "y", "z", *(TAKEN + o for o in OUTPUTS)):
        if quantity in turned:
            turned[quantity] = turned[quantity] * frame.sign(quantity.removeprefix(TAKEN))
    if angles == "ittc" and "beta" in turned:
        turned["beta"] = -turned["beta"]
    return turned


def arm_rates(runs: pd.DataFrame, where: str) -> pd.DataFrame:
    """Yaw rate of a rotating arm from its radius, r = U / R; one that is given as well has to agree.

    Raises
    ------
    InputError
        For a radius of zero, without speed, or with another yaw rate.
    """
    if "R0" not in runs or runs["R0"].isna().all():
        return runs
    out = runs.copy()
    given = runs["R0"].notna()
    speed = runs["U"] if "U" in runs else pd.Series(np.nan, index=runs.index)
    bad = given & ~(runs["R0"].abs() > 0.0) | given & speed.isna()
    if bad.any():
        run = runs[bad].iloc[0]
        text = "a radius beyond zero and a speed: r = U / R0 (a speed of zero is a pure rotation)"
        raise InputError(f"{where}/{run['file']}, row {run['row']}, column R0", f"{run['R0']:g}", text)
    rate = speed / runs["R0"]
    # A rate that is given has its own axis: a model on its side turns in pitch or roll on the same arm.
    rates = runs[[k for k in "pqr" if k in runs]]
    turning = (rates**2).sum(axis=1, min_count=1) ** 0.5
    off = given & turning.notna() & ((turning - rate.abs()).abs() > _SAME_RADIUS * rate.abs())
    if off.any():
        run = runs[off].iloc[0]
        wrong = f"{run['R0']:g}, with which the rate is {rate[off].iloc[0]:g} rad/s and not {turning[off].iloc[0]:g}"
        place = f"{where}/{run['file']}, row {run['row']}, column R0"
        raise InputError(place, wrong, "a radius that fits speed and rate, or one of the two")
    measured = runs["r"] if "r" in runs else pd.Series(np.nan, index=runs.index)
    out["r"] = measured.where(turning.notna() | ~given, rate)
    return out


def deflected_left_out(runs: pd.DataFrame, vehicle: Vehicle) -> pd.DataFrame:
    """Runs of a part that is no plane, with one deflected: their loads are excluded, with the reason.

    No term of a hull depends on a plane's angle; with the plane at an angle its load is in the run and
    would be taken for the hull's.
    """
    planes = [p.name for p in vehicle.planes]
    turned = runs["plane"].fillna(0.0).abs() > _AMIDSHIPS
    deflected = turned & ~runs["part"].isin(planes)
    if not deflected.any():
        return runs
    out = runs.copy()
    loads = [o for o in (*OUTPUTS, *DIRECT) if o in runs]
    for i, run in runs[deflected].iterrows():
        angle = math.degrees(run["plane"])
        reason = f"a plane at {angle:g} deg: a run of the {run['part']} has them amidships"
        out.loc[i, "exclude"] = " ".join(o for o in loads if pd.notna(run[o]))
        out.loc[i, "reason"] = run["reason"] or reason
    return out


def move_moments(runs: pd.DataFrame, point: list[float]) -> pd.DataFrame:
    """Moments about the origin: M_O = M_P + r_P x F. Missing moments stay missing.

    Standard errors of the forces are carried over as if independent of the moment's.
    """
    x, y, z = point
    levers = {"K": {"Z": y, "Y": -z}, "M": {"X": z, "Z": -x}, "N": {"Y": x, "X": -y}}
    moved = runs.copy()
    for moment, arms in levers.items():
        for force, arm in arms.items():
            if arm == 0.0:
                continue
            bare = runs[moment].notna() & runs[force].isna()
            if bare.any():
                run = runs[bare].iloc[0]
                place = f"{run['file']}, row {run['row']}, column {force}"
                raise InputError(place, "nothing", f"a number: moving {moment} to the vehicle's origin needs {force}")
            moved[moment] = moved[moment] + arm * runs[force]
            if TAKEN + force in runs:
                off = moved[TAKEN + moment].fillna(0.0) if TAKEN + moment in moved else 0.0
                moved[TAKEN + moment] = off + arm * runs[TAKEN + force].fillna(0.0)
            if f"s_{moment}" in moved and f"s_{force}" in moved:
                error, carried = moved[f"s_{moment}"], arm * runs[f"s_{force}"].fillna(0.0)
                moved[f"s_{moment}"] = (error**2 + carried**2) ** 0.5
    return moved


def turning(runs: pd.DataFrame) -> pd.Series:
    """Runs whose points move differently: with a rate, a radius or an angular acceleration."""
    moved = [c for c in ("p", "q", "r", "pdot", "qdot", "rdot", "R0") if c in runs]
    return runs[moved].fillna(0.0).ne(0.0).any(axis=1)


def at_origin(runs: pd.DataFrame, point: list[float]) -> pd.DataFrame:
    """Speed, angles and accelerations of turning runs at the vehicle's origin, from those of a point of the boat.

    v_O = v_P - omega x r_P, of the velocity's components in the body and of their rates of change alike
    (Fossen 2011, Eq. (2.21): the point is fixed in the body). Runs that do not turn stay as they are.

    Parameters
    ----------
    runs : Program frame, model scale.
    point : r_P from the vehicle's origin [m].

    Raises
    ------
    InputError
        For a pure rotation, which is one about the origin.
    """
    moved = runs.copy()
    rows = runs.index[turning(runs)]
    if not any(point) or not len(rows):
        return moved
    still = runs.loc[rows][~(runs.loc[rows, "U"].fillna(0.0) > 0.0)]
    if len(still):
        run = still.iloc[0]
        text = "pure rotation about the vehicle's origin: about another point the origin moves through the water"
        raise InputError(f"{run['file']}, row {run['row']}, column U", "no speed, and a motion point", text)
    state = runs.loc[rows, ["U", "alpha", "beta"]].fillna(0.0).to_numpy(float)
    velocity = np.array([body_velocity(*row) for row in state])
    rates, angular = (runs.loc[rows, list(k)].fillna(0.0).to_numpy(float) for k in (MOTION[:3], ACCELERATIONS[3:]))
    u, v, w = (velocity - np.cross(rates, np.broadcast_to(point, rates.shape))).T
    speed = np.sqrt(u**2 + v**2 + w**2)
    moved.loc[rows, "U"] = speed
    for name, angle in (("alpha", np.arctan2(w, u)), ("beta", np.arcsin(np.clip(v / speed, -1.0, 1.0)))):
        before = runs.loc[rows, name].to_numpy(float)
        # An angle that nobody stated stays unstated where it is zero.
        moved.loc[rows, name] = np.where(np.isnan(before) & (np.abs(angle) < _AMIDSHIPS), before, angle)
    change = np.cross(angular, np.broadcast_to(point, angular.shape))
    for name, one in zip(ACCELERATIONS[:3], change.T, strict=True):
        before = runs.loc[rows, name]
        moved.loc[rows, name] = (before.fillna(0.0) - one).where(before.notna() | (one != 0.0))
    return moved


def whole_model(runs: pd.DataFrame, header: CampaignFile) -> pd.DataFrame:
    """Double the loads of a half model; loads that symmetry makes zero are left out.

    Raises
    ------
    InputError
        For a run whose flow is not symmetric about the plane.
    """
    if header.half_model is None:
        return runs
    plane = header.half_model.plane
    out = runs.copy()
    for name in _ASYMMETRIC[plane]:
        turned = runs[name].fillna(0.0).abs() > 0.0
        if turned.any():
            run = runs[turned].iloc[0]
            place = f"{run['file']}, row {run['row']}, column {name}"
            raise InputError(place, f"{run[name]:g}", f"zero: a half model ({plane}) is tested in symmetric flow")
    for output in OUTPUTS:
        keep = 2.0 if output in _DOUBLED[plane] else np.nan
        for column in (output, f"s_{output}", f"size_{output}", TAKEN + output):
            if column in out:
                out[column] = out[column] * keep
    return out


def to_full_scale(runs: pd.DataFrame, ratio: float) -> pd.DataFrame:
    """Froude scaling of motions and loads; dimensionless values do not change."""
    powers: dict[str, float] = {"U": 0.5, "D0": 1, "R0": 1, "n": -0.5, "x": 1, "y": 1, "z": 1}
    powers |= dict.fromkeys(("p", "q", "r"), -0.5) | dict.fromkeys(("pdot", "qdot", "rdot"), -1)
    powers |= {o: 3 if o in "XYZ" else 4 for o in OUTPUTS}
    powers |= {f"{kind}{o}": powers[o] for o in OUTPUTS for kind in ("s_", "size_", TAKEN)}
    scaled = runs.copy()
    for name, power in powers.items():
        if name in scaled:
            scaled[name] = scaled[name] * ratio**power
    return scaled


def _opposed(names: pd.Series) -> pd.Series:
    """A name in common of the two opposed instants of an oscillation; missing for other runs."""
    return (names.str[:-2] + names.str[-1]).where(names.str[-2:].isin(list(PHASES)))


def standard_errors(runs: pd.DataFrame, header: CampaignFile, length: float) -> pd.DataFrame:
    """Add s_X..s_N and s_KT, s_KQ, s_t by the campaign's rule.

    A standard error that the file gives stands. One that a reduction found is of the mean
    alone; where the run also has ``rel_sigma``, the two are added in squares. ``rel_sigma``
    is relative to the load as measured, before the model's own inertia is taken off; of the two
    opposed instants of an oscillation it is that of the larger: what a record is off by as a whole
    then leaves the amplitude between them as it is.
    """
    out = runs.copy()
    quality = out["quality"].map({k: q.factor for k, q in header.quality.items()}).astype(float)
    original = out["copy_of"].map(dict(zip(out["run_id"], quality, strict=True))).astype(float)
    quality = quality.where(~(original > quality), original)
    still = {k: out[k].fillna(0.0) == 0.0 for k in MOTION}
    along = np.cos(out["alpha"].fillna(0.0)) * np.cos(out["beta"].fillna(0.0))
    still["u"] = pd.Series(along, index=out.index).abs() < _ACROSS
    # Loads of like motion: which of its components are zero, as the digits of a number.
    kind = pd.DataFrame(still).to_numpy() @ (1 << np.arange(len(still)))
    like = [out["test"], out["part"], pd.Series(kind, index=out.index), out["coefficient"]]
    rate2 = sum(out[c].fillna(0.0) ** 2 for c in ("p", "q", "r"))
    dynamic = out["U"].fillna(0.0) ** 2 + rate2 * length**2
    reduced = out["reduction"] != ""
    opposed = _opposed(out["run_id"].astype(str))
    for name in (*OUTPUTS, *DIRECT):
        size = as_measured(out, name)
        if f"size_{name}" in out:
            size = size.where(out[f"size_{name}"].isna(), out[f"size_{name}"])
        size = size.where(opposed.isna(), size.groupby([out["file"], out["row"], opposed]).transform("max"))
        prime = (size / dynamic).where(dynamic > 0) if name in OUTPUTS else size
        # An excluded load is no measure of what the others can be read to.
        prime = prime.where(~excluded(out, name))
        worst = prime.groupby(like).transform("max").fillna(0.0)
        floor = header.uncertainty.floor * worst * (dynamic if name in OUTPUTS else 1.0)
        ruled = quality * out["rel_sigma"] * np.maximum(size, floor)
        if f"s_{name}" not in out:
            out[f"s_{name}"] = ruled
            continue
        given = out[f"s_{name}"]
        both = ((given**2 + ruled.fillna(0.0) ** 2) ** 0.5).where(reduced, given)
        out[f"s_{name}"] = both.where(given.notna(), ruled)
    return out
