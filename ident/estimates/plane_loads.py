"""Loads of planes: from those on the moving plane alone to those its deflection makes on the boat.

A campaign that keeps loads by part measures a moving plane without its root, the hull beside it
and the fins behind it. ``carry_over`` and ``downwash`` give the ratios; here they come into the rows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.estimates.carry_over import CarryOver, carry_over
from ident.estimates.downwash import slopes, tail_downwash
from ident.estimates.draft import Draft, Mask, NotApplicable
from sim.files.constants import constant
from sim.files.errors import InputError

Array = NDArray[np.float64]

# Lift of a real surface on that of a lattice, and its deviation: the boundary layer takes some per cent of the
# slope of a section, and lattices are as good as that at small aspect ratio.
_VISCOUS, _LATTICE = constant("lift_on_lattice"), constant("lift_on_lattice_range")


def lift_slope(draft: Draft, planes: CarryOver) -> tuple[float, float, float]:
    """Lift slope of the moving stern planes by runs and lattice, weighted by their variances.

    A run at 10 deg may be past the straight part of a coarse grid's lift, and a lattice has no boundary layer:
    two estimates of one number, neither of which knows of the other's fault.

    Returns
    -------
    Factor on the measured slope, its deviation, and the measured slope on the planes' own area [1/rad].
    """
    rows = draft.rows
    at = rows[rows["part"].isin([p.name for p in draft.vehicle.stern_planes])]
    depth, speed = float(at["depth_m"].max()), float(at["speed_mps"].max())
    length = draft.vehicle.particulars.length.value
    measured_slopes = []
    for plane in draft.vehicle.stern_planes:
        of_plane = slopes(rows, plane.name, depth, speed)
        if {"Y", "Z"} <= set(of_plane):
            along = plane.lift_axis[1] * of_plane["Y"] + plane.lift_axis[2] * of_plane["Z"]
            measured_slopes.append(abs(along) * length**2 / planes.area)
    if not measured_slopes:
        raise NotApplicable("no stern plane with runs on both sides of its neutral angle")
    measured = float(np.mean(measured_slopes))
    used = at[at["coefficient"].str.match("[YZ]_d") & (at["value"] != 0.0) & (at["stderr"] > 0.0)]
    runs = float((used["stderr"] / used["value"].abs()).median()) * measured
    theory, wide = _VISCOUS * planes.lift_slope, _LATTICE * planes.lift_slope
    weight = np.array([runs**-2, wide**-2])
    mean = float(weight @ [measured, theory] / weight.sum())
    return mean / measured, float(weight.sum() ** -0.5) / measured, measured


def planes_of(draft: Draft) -> CarryOver:
    """Carry-over of the draft's vehicle, computed once; raises ``NotApplicable`` without the geometry."""
    if "carry_over" not in draft.memo:
        try:
            draft.memo["carry_over"] = carry_over(draft.vehicle)
        except InputError as error:
            raise NotApplicable(str(error)) from error
    planes = draft.memo["carry_over"]
    assert isinstance(planes, CarryOver)
    return planes


def at_neutral(draft: Draft, chosen: Mask) -> Array:
    """(n,) load at zero deflection of the same plane, speed and depth; zero where no run has it.

    What a plane carries undeflected is made by the flow about the hull and by friction. Roots and hull carry their
    part of that in their own runs, so that it has nothing to carry over: factors act on what deflection changes.
    """
    rows, angle = draft.rows, draft.axis("delta")
    columns = [rows[c].tolist() for c in ("coefficient", "part", "speed_mps", "depth_m")]
    places = list(zip(*columns, strict=True))
    neutral = {places[i]: float(draft.value[i]) for i in np.flatnonzero(chosen & (angle == 0.0)).tolist()}
    return np.array([neutral.get(place, 0.0) for place in places])


def carried_over(draft: Draft) -> str:
    """Stern planes with root, hull and other fins; drag between the plane's own and all of it.

    Factors act on what deflection changes, not on the load of the plane at its neutral angle.

    The normal of a deflected plane leans with it, those of root and hull do not, so that pressure drag stays on
    the plane (factor one); drag by lift grows with all the lift (the factor of the force). Between the
    two nothing is known: the middle, with the deviation of a uniform distribution.

    Raises
    ------
    NotApplicable
        Without stern planes or their geometry.
    """
    stern = [p.name for p in draft.vehicle.stern_planes]
    if not draft.where(["Z_d*", "Y_d*"], stern).any():
        raise NotApplicable("no loads of stern planes by part")
    planes = planes_of(draft)
    lift, wide, measured = lift_slope(draft, planes)
    force, roll = planes.force_factor, planes.roll_factor
    for terms, factor, sigma, unknown in (
        (["[YZMN]_d*"], lift * force, lift * planes.force_sigma, "carry_over force"),
        (["K_d*"], lift * roll, lift * planes.roll_sigma, "carry_over roll"),
    ):
        chosen = draft.where(terms, stern)
        kept = at_neutral(draft, chosen)
        by_lift = np.where(chosen, draft.value - kept, 0.0) * factor / lift * wide
        draft.multiply(chosen, factor, sigma, unknown, f"carry_over x{factor:.3f}", kept)
        draft.spread("lift slope", by_lift)
    drag, spread = 0.5 * (1.0 + force), float((force - 1.0) / np.sqrt(12.0))
    chosen = draft.where(["X_d*"], stern)
    draft.multiply(chosen, drag, spread, "carry_over drag", f"carry_over x{drag:.3f}", at_neutral(draft, chosen))
    return (
        f"lift slope {measured:.2f} by runs and {_VISCOUS * planes.lift_slope:.2f} by lattice: "
        f"x{lift:.3f} +- {wide:.3f}; "
        f"force x{force:.3f} +- {planes.force_sigma:.3f}, roll x{roll:.3f} +- {planes.roll_sigma:.3f}, "
        f"drag x{drag:.2f} +- {spread:.2f}"
    )


def _sail_planes(draft: Draft) -> list[str]:
    """Names of the sail planes; raises ``NotApplicable`` where their loads are not known by part."""
    forward = [p.name for p in draft.vehicle.forward_planes]
    if not draft.where(["[ZM]_d*"], forward).any():
        raise NotApplicable("no loads of sail planes by part")
    return forward


def forward_planes(draft: Draft) -> str:
    """Sail planes with their roots on the sail, and what their vortices do to the stern planes.

    Raises
    ------
    NotApplicable
        Without sail planes, or without the geometry.
    """
    forward, planes = _sail_planes(draft), planes_of(draft)
    try:
        downwash = tail_downwash(draft.vehicle, draft.rows, planes)
    except (InputError, KeyError) as error:
        raise NotApplicable(str(error)) from error
    force, moment = float(downwash.force_factor), float(downwash.moment_factor)
    draft.memo["forward planes"] = (force, moment)
    for term, factor, sigma, unknown in (
        ("Z_d*", force, downwash.force_sigma, "tail_downwash force"),
        ("M_d*", moment, downwash.moment_sigma, "tail_downwash moment"),
    ):
        of_term = draft.where([term], forward)
        draft.multiply(of_term, factor, sigma, unknown, f"downwash x{factor:.3f}", at_neutral(draft, of_term))
    return f"heave x{force:.3f} +- {downwash.force_sigma:.3f}, pitch x{moment:.3f} +- {downwash.moment_sigma:.3f}"


def hull_below(draft: Draft) -> str:
    """What deflected sail planes load on the hull below them, by their images in it.

    It acts at the planes' station, where the hull is a cylinder. What their vortices do where the hull ends is left
    out, as in NACA Report 1307.

    Raises
    ------
    NotApplicable
        Without sail planes, or without the geometry.
    """
    forward, planes = _sail_planes(draft), planes_of(draft)
    before = draft.memo.get("forward planes", (1.0, 1.0))
    assert isinstance(before, tuple)
    for term, own in zip(("Z_d*", "M_d*"), before, strict=True):
        of_term, factor = draft.where([term], forward), 1.0 + planes.below / own
        word = f"hull_below x{factor:.3f}"
        draft.multiply(of_term, factor, planes.below_sigma / own, "hull below", word, at_neutral(draft, of_term))
    return f"{planes.below:+.3f} +- {planes.below_sigma:.3f} of the planes' own load"
