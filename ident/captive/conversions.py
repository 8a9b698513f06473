"""Runs from the campaign's form to the program's: primes, frame, tare, moment point, scale.

Every function takes a run table (SI, radians) and returns a new one. Order:
dimensionless input is made dimensional at model scale, tare is taken off and everything
turned to the program frame, moments are moved to the vehicle's origin, the model's own
inertia is added back, half models are doubled, and Froude's law brings all to full scale.
"""

from __future__ import annotations

import math
import re
from functools import cache
from importlib.resources import files

import numpy as np
import pandas as pd

from ident.captive.campaign_file import CampaignFile, Tare
from ident.captive.quantities import PRIMED, TAKEN, factor
from ident.captive.run_table import DIRECT, MOTION, excluded
from ident.captive.source import Source
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


@cache
def normalisations() -> pd.DataFrame:
    """Named normalisation systems of dimensionless input, one row each."""
    with (files("ident") / "data" / "normalisations.csv").open(encoding="utf-8") as stream:
        return pd.read_csv(stream, keep_default_na=False).set_index("name")


def sizes(source: Source, header: CampaignFile, where: str) -> dict[str, float]:
    """Sizes that a normalisation divides by: L, d, and A and l of ``[source.reference]``; 1 or NaN where not stated.

    Raises
    ------
    InputError
        For a normalisation by a stated area without one.
    """
    own = source.reference
    if source.normalisation == "half_rho_A" and own is None:
        raise InputError(where, "nothing", "a table [source.reference] with area_m2: half_rho_A needs it")
    return {
        "L": header.scale.length_m,
        "d": header.scale.draught_m or 1.0,
        "A": own.area_m2 if own else 1.0,
        "l": (own.length_m or math.nan) if own else math.nan,
    }


def product(text: str, values: dict[str, pd.Series | float]) -> pd.Series:
    """``U U/L L`` of the table as a number a run."""
    over, _, under = text.partition("/")
    found: pd.Series = pd.Series(1.0, index=values["U"].index)  # type: ignore[union-attr]
    for name in over.split():
        found = found * values[name]
    for name in under.split():
        found = found / values[name]
    return found


def dimensional(runs: pd.DataFrame, primed: set[str], source: Source, header: CampaignFile, where: str) -> pd.DataFrame:
    """Make dimensionless loads, rates and accelerations dimensional, at model scale.

    Parameters
    ----------
    runs : With U [m/s] in every run.
    primed : Quantities that are dimensionless, ``s_X`` and ``X_in`` among them.
    source : Its ``normalisation``, a row of ``data/normalisations.csv``, and ``reference``.
    header : For length, draught and density.
    where : For the error.

    Raises
    ------
    InputError
        Without a known name, a draught it needs, or a speed in a run.
    """
    if not primed:
        return runs
    table, name = normalisations(), source.normalisation
    if name not in table.index:
        found = repr(name) if name else f"{', '.join(sorted(primed))} dimensionless, and no normalisation"
        raise InputError(f"{where}, key source.normalisation", found, ", ".join(table.index))
    forms = table.loc[name]
    if header.scale.draught_m is None and "d" in f"{forms['force']} {forms['moment']}".split():
        raise InputError(f"{where}, key scale.draught_m", "nothing", f"the draught: {name} needs it")
    speed = runs["U"] if "U" in runs else pd.Series(np.nan, index=runs.index)
    still = ~(speed > 0.0)
    if still.any():
        run = runs[still].iloc[0]
        place = f"{run['file']}, row {run['row']}, column U"
        raise InputError(
            place, str(run.get("U")), f"a speed: dimensionless {', '.join(sorted(primed))} is made with it"
        )
    values: dict[str, pd.Series | float] = {"U": speed, **sizes(source, header, f"{where}, key source.reference")}
    out = runs.copy()
    for quantity in sorted(primed):
        own = quantity.removeprefix("s_").split("_")[0]
        kind = PRIMED[own]
        if "l" in re.split(r"[ /]", str(forms[kind])) and np.isnan(float(np.asarray(values["l"]))):
            text = f"the length that {own} was made dimensionless with"
            raise InputError(f"{where}, key source.reference.length_m", "nothing", text)
        scale = product(str(forms[kind]), values)
        if own in OUTPUTS:
            scale = scale * 0.5 * header.fluid.density_kgpm3 * speed**2
        out[quantity] = out[quantity] * scale
    return out


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
        found = f"{run['R0']:g}, with which the rate is {rate[off].iloc[0]:g} rad/s and not {turning[off].iloc[0]:g}"
        place = f"{where}/{run['file']}, row {run['row']}, column R0"
        raise InputError(place, found, "a radius that fits speed and rate, or one of the two")
    own = runs["r"] if "r" in runs else pd.Series(np.nan, index=runs.index)
    out["r"] = own.where(turning.notna() | ~given, rate)
    return out


def deflected_left_out(runs: pd.DataFrame, vehicle: Vehicle) -> pd.DataFrame:
    """Runs of a part that is no plane, with one deflected: their loads are excluded, with the reason.

    No term of a hull depends on a plane's angle; with the plane at an angle its load is in the run and
    would be taken for the hull's.
    """
    planes = [p.name for p in vehicle.planes]
    turned = runs["plane"].fillna(0.0).abs() > _AMIDSHIPS
    own = turned & ~runs["part"].isin(planes)
    if not own.any():
        return runs
    out = runs.copy()
    loads = [o for o in (*OUTPUTS, *DIRECT) if o in runs]
    for i, run in runs[own].iterrows():
        angle = math.degrees(run["plane"])
        reason = f"a plane at {angle:g} deg: a run of the {run['part']} has them amidships"
        out.loc[i, "exclude"] = " ".join(o for o in loads if pd.notna(run[o]))
        out.loc[i, "reason"] = run["reason"] or reason
    return out


def without_hydrostatics(runs: pd.DataFrame, header: CampaignFile, frame: Frame) -> pd.DataFrame:
    """Take the stated hydrostatic load off, about the vehicle's origin, in the program frame.

    A force B upwards at r_B: F = -B g, M = r_B x F, with g the direction of gravity in the body,
    (0, 0, 1) level and (-sin alpha, 0, cos alpha) pitched.
    """
    own = header.hydrostatics
    if own is None:
        return runs
    chosen = runs["part"].isin(own.parts)
    pitch = runs["alpha"].fillna(0.0).to_numpy(float) * (own.attitude == "pitched")
    force = -own.force_n * np.stack([-np.sin(pitch), np.zeros(len(runs)), np.cos(pitch)], axis=1)
    arm = np.broadcast_to(np.array(frame.vector(own.centre_m)), force.shape)
    load = np.hstack([force, np.cross(arm, force)])
    out = runs.copy()
    for output, one in zip(OUTPUTS, load.T, strict=True):
        out[output] = out[output] - np.where(chosen, one, 0.0)
    return out


def tare_applies(runs: pd.DataFrame, tare: Tare) -> pd.Series:
    """Which runs a tare is taken off: (runs,) of bool."""
    chosen = pd.Series(True, index=runs.index)
    if tare.tests:
        chosen &= runs["test"].isin(tare.tests)
    if tare.parts:
        chosen &= runs["part"].isin(tare.parts)
    return chosen


def without_tare(runs: pd.DataFrame, tares: list[Tare], where: str) -> pd.DataFrame:
    """Take off stated zero readings and strut loads, in the campaign's frame.

    Raises
    ------
    InputError
        For a load without a number and a unit of force or moment.
    """
    out = runs.copy()
    for k, tare in enumerate(tares):
        chosen = tare_applies(runs, tare)
        place = f"{where}, key tare.{k}"
        for output, text in tare.loads.items():
            out.loc[chosen, output] = out.loc[chosen, output] - quantity_of(text, output, f"{place}.loads.{output}")
        for output, slope in tare.per_speed_squared.items():
            strut = slope * runs.loc[chosen, "U"].fillna(0.0) ** 2
            out.loc[chosen, output] = out.loc[chosen, output] - strut
    return out


def quantity_of(text: str, quantity: str, where: str) -> float:
    """``"5 m/s"`` as a number in the SI unit of a quantity.

    Raises
    ------
    InputError
        When it is not a finite number and one of the quantity's units.
    """
    number, _, unit = text.strip().partition(" ")
    try:
        value = float(number)
    except ValueError:
        value = float("nan")
    scale = factor(quantity, unit.strip())
    if scale is None or not np.isfinite(value * scale):
        raise InputError(where, repr(text[:60]), f"a number and a unit of {quantity}, such as '1.5 N' or '3 deg'")
    return value * scale


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
                own, carried = moved[f"s_{moment}"], arm * runs[f"s_{force}"].fillna(0.0)
                moved[f"s_{moment}"] = (own**2 + carried**2) ** 0.5
    return moved


def without_inertia(runs: pd.DataFrame, header: CampaignFile, frame: Frame) -> pd.DataFrame:
    """Add m a of the model back to loads that contain it: measured = water - m a.

    Rigid-body loads about the vehicle's origin, Fossen (2011), Eq. (3.33), in the program
    frame at model scale: F = m (dv/dt + w x v + dw/dt x r + w x (w x r)) and
    M = I_G dw/dt + w x I_G w + r x F.

    Parameters
    ----------
    runs : In the program frame, moments about the vehicle's origin.
    header : For ``[inertia]``.
    frame : Of the campaign, for the centre of gravity.
    """
    inertia = header.inertia
    if not inertia.model_inertia_in_loads:
        return runs
    assert inertia.mass_kg is not None
    assert inertia.centre_of_gravity_m is not None
    assert inertia.tensor_kgm2 is not None
    arm = np.array(frame.vector(inertia.centre_of_gravity_m))
    xx, yy, zz, xy, yz, zx = [*inertia.tensor_kgm2, 0.0, 0.0, 0.0][:6]
    xy, yz, zx = (v * s for v, s in zip((xy, yz, zx), _product_signs(frame), strict=True))
    tensor = np.array([[xx, -xy, -zx], [-xy, yy, -yz], [-zx, -yz, zz]])
    chosen = runs["part"].isin(inertia.parts).to_numpy()
    state = runs[["U", "alpha", "beta", *MOTION]].fillna(0.0)
    velocity = np.array([body_velocity(*row) for row in state[["U", "alpha", "beta"]].to_numpy()])
    rates = state[["p", "q", "r"]].to_numpy()
    linear, angular = state[list(ACCELERATIONS[:3])].to_numpy(), state[list(ACCELERATIONS[3:])].to_numpy()
    acceleration = linear + np.cross(rates, velocity) + np.cross(angular, arm) + np.cross(rates, np.cross(rates, arm))
    force = inertia.mass_kg * acceleration
    moment = angular @ tensor + np.cross(rates, rates @ tensor) + np.cross(np.broadcast_to(arm, force.shape), force)
    out = runs.copy()
    for output, own in zip(OUTPUTS, np.hstack([force, moment]).T, strict=True):
        # A relative error is one of what the balance measured, inertia included.
        out[f"size_{output}"] = as_measured(out, output).where(chosen)
        out[output] = out[output] + np.where(chosen, own, 0.0)
    return out


def as_measured(runs: pd.DataFrame, output: str) -> pd.Series:
    """Size that a relative error is of: the load, or total and part in squares where a part was taken off."""
    if TAKEN + output not in runs:
        return runs[output].abs()
    taken = runs[TAKEN + output].fillna(0.0)
    return ((runs[output] + taken) ** 2 + taken**2) ** 0.5


def _product_signs(frame: Frame) -> tuple[int, int, int]:
    """Signs that turn Ixy, Iyz, Izx, integrals over two coordinates."""
    s = frame.signs
    return s["x"] * s["y"], s["y"] * s["z"], s["z"] * s["x"]


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


def standard_errors(runs: pd.DataFrame, header: CampaignFile, length: float) -> pd.DataFrame:
    """Add s_X..s_N and s_KT, s_KQ, s_t by the campaign's rule.

    A standard error that the file gives stands. One that a reduction found is of the mean
    alone; where the run also has ``rel_sigma``, the two are added in squares. ``rel_sigma``
    is relative to the load as measured, before the model's own inertia is taken off.
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
    for name in (*OUTPUTS, *DIRECT):
        size = as_measured(out, name)
        if f"size_{name}" in out:
            size = size.where(out[f"size_{name}"].isna(), out[f"size_{name}"])
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
