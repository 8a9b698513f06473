"""Derivatives that a publication gives as they are, with their standard errors.

They enter like runs: one row a coefficient, test ``published_derivative``, through the same
fit into the same database, so that no vehicle needs a list of coefficients beside it.
"""

from __future__ import annotations

import math
import re

import pandas as pd

from ident.captive.campaign_file import CampaignFile
from ident.captive.dimensions import normalisations, product
from ident.captive.quantities import PRIMED, powers_of
from sim.boat.catalogue import ACCELERATIONS, OUTPUTS, Term
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.files.frames import Frame

TEST = "published_derivative"


def turn_sign(term: Term, frame: Frame) -> int:
    """Sign of a coefficient when it is turned between a frame and the program frame.

    The product of the signs of its load and of its multiplier; magnitudes, S and plane
    deflections (about the plane's own axis) do not turn.
    """
    sign = int(frame.sign(term.output)) if term.output else 1
    for factor in term.factors:
        bare = factor[4:-1] if factor.startswith("sgn(") else factor
        bare = bare.removesuffix("/U")
        sign *= 1 if factor.startswith("|") or factor == "deflection" else int(frame.sign(bare))
    return sign


def _term(run: pd.Series, terms: dict[str, Term], place: str) -> Term:
    """The row of the term table a published row names, or a refusal."""
    name = run["coefficient"]
    if name not in terms:
        # Y_r' of Gertler and Hagen is the factor of u r.
        alike = next((t for t in (re.sub("_([pqr])$", r"_u\1", name),) if t in terms), "")
        known = ", ".join(t.name for t in terms.values() if not t.axes)
        text = f"{alike}, as it is called here" if alike else f"a term of the vehicle's set: {known}"
        raise InputError(f"{place}, column coefficient", repr(name), text)
    term = terms[name]
    if term.axes or (not term.output and TEST not in term.tests):
        text = "a constant coefficient; tabulated ones are given as runs"
        raise InputError(f"{place}, column coefficient", f"{name}, tabulated over {' '.join(term.axes)}", text)
    if run["part"] != term.part and term.part != "section":
        raise InputError(f"{place}, column part", repr(run["part"]), term.part)
    return term


def factor_of(run: pd.Series, term: Term, header: CampaignFile, vehicle: Vehicle, place: str) -> float:
    """Factor from a published value to the prime form of this program, in its frame.

    A value is dimensionless by a normalisation of ``data/normalisations.csv`` (``half_rho_L2`` when none
    is named), per degree of an angle (``1/deg``), or has the dimension of its term: load = value times
    the term's velocities, accelerations and angles, perhaps at a stated speed (``kg/s`` for Y_v).

    Raises
    ------
    InputError
        For a unit that is not one of these, or a speed that is needed and not given.
    """
    unit = str(run["unit"] or run.get("value_unit") or "")
    name = str(run.get("normalisation") or "")
    powers, angles = _unit(unit, f"{place}, column value")
    length = header.scale.ratio * header.scale.length_m
    over = (length / vehicle.particulars.length.value) ** term.power if term.norm == "rho/2 L" else 1.0
    sign = float(turn_sign(term, header.frame.frame))
    if angles[1]:
        sign = _sign_of_angles(term, header, angles[1], f"{place}, column value")
    if term.norm == "SI":
        if name or header.scale.ratio != 1.0:
            text = "no normalisation and the vehicle's own scale: the coefficient has a dimension"
            raise InputError(f"{place}, column value", f"{name} at scale {header.scale.ratio:g}", text)
        if not any(powers):
            text = f"the unit of {term.output} over {term.multiplier}, such as kg/s or N s/m"
            raise InputError(f"{place}, column value", f"no unit for {term.name}", text)
        return sign * angles[0] * _from_dimension(run, term, powers, unit, header, place)
    if term.norm != "rho/2 L":
        if unit or name:
            text = f"nothing: {term.name} is the same in every normalisation and has no unit"
            raise InputError(f"{place}, column value", repr(unit or name), text)
        return sign
    if not any(powers):
        if name in ("", "half_rho_L2"):
            return sign * angles[0] * over
        return sign * angles[0] * over * _from_norm(run, term, name, header, place)
    if name:
        wrong = f"unit {unit!r}, and normalisation {name!r}"
        raise InputError(f"{place}, column value", wrong, "one of the two: a dimensional value has no normalisation")
    return sign * angles[0] * _from_dimension(run, term, powers, unit, header, place) * over


def _unit(unit: str, place: str) -> tuple[tuple[float, float, float], tuple[float, int]]:
    """Powers of kg, m and s of a unit with its factor to SI and radians, and its power of an angle."""
    if unit in ("", "-", "1", "/"):
        return (0.0, 0.0, 0.0), (1.0, 0)
    powers = powers_of(unit)
    if powers is None:
        text = "no unit for prime form, 1/deg, or the dimension of the coefficient, such as kg/m, N s/m or kg m/rad"
        raise InputError(place, f"unit {unit[:40]!r}", text)
    factor, kilograms, metres, seconds, angle = powers
    return (kilograms, metres, seconds), (factor, -angle)


def _sign_of_angles(term: Term, header: CampaignFile, count: int, place: str) -> float:
    """Sign of a value per angle: drift and incidence turn with their own sense, and not with the axes."""
    velocities = [f for f in term.factors if _bare(f) in ("v", "w", "alpha", "beta")]
    others = [
        f for f in term.factors if f in ("deflection", "delta") or _bare(f) in ("p", "q", "r", *ACCELERATIONS[3:])
    ]
    if not 0 < count <= len(velocities) + len(others):
        text = f"one angle for each of {' '.join(velocities + others) or 'nothing'} in {term.name}"
        raise InputError(place, f"an angle to the power {-count}", text)
    frame, sign = header.frame.frame, float(turn_sign(term, header.frame.frame))
    if not velocities or count <= len(others):
        return sign
    for factor in velocities:
        odd = not factor.startswith("|")
        if odd and _bare(factor) == "v":
            sign *= frame.sign("v") * (-1.0 if header.frame.angles == "ittc" else 1.0)
        elif odd:
            sign *= frame.sign("w")
    return sign


def _bare(factor: str) -> str:
    return factor.removeprefix("sgn(").removesuffix(")").removesuffix("/U").strip("|")


def _from_norm(run: pd.Series, term: Term, name: str, header: CampaignFile, place: str) -> float:
    """C of 1/2 rho L^n from C' of another normalisation, whose factors are x / (its own unit of x)."""
    forms = normalisations()
    if name not in forms.index:
        raise InputError(f"{place}, normalisation", repr(name), ", ".join(forms.index))
    scale, form = header.scale, forms.loc[name]
    words = " ".join(str(form[k]) for k in ("force", "moment", "rate", "acceleration", "rotation")).split()
    if scale.draught_m is None and "d" in words:
        raise InputError("campaign.toml, key scale.draught_m", "nothing", f"the draught: {name} needs it")
    sizes = {"U": 1.0, "L": scale.length_m, "d": scale.draught_m or 1.0}
    sizes |= {"A": float(run["reference_area"]), "l": float(run["reference_length"])}
    one = pd.Series([1.0])
    made = {k: pd.Series([v]) if k == "U" else v for k, v in sizes.items()}

    def size(kind: str) -> float:
        return float(product(str(form[kind]), made).iloc[0]) if kind != "velocity" else float(one.iloc[0])

    kinds = {**PRIMED, "u": "velocity", "v": "velocity", "w": "velocity"}
    made_of = size(PRIMED[term.output]) / scale.length_m**term.power
    for factor in term.factors:
        if _bare(factor) in kinds:
            made_of /= size(kinds[_bare(factor)])
    if not math.isfinite(made_of):
        text = "the length that moments and rates were made dimensionless with"
        raise InputError("campaign.toml, key source.reference.length_m", "nothing", text)
    return made_of


def _from_dimension(
    run: pd.Series, term: Term, powers: tuple[float, float, float], unit: str, header: CampaignFile, place: str
) -> float:
    """C of 1/2 rho L^n from a coefficient with a dimension, at a speed where it has fewer velocities than the term."""
    metres, seconds = (1.0, -2.0) if term.output in "XYZ" else (2.0, -2.0)
    for factor in term.factors:
        name = _bare(factor)
        if name in ("u", "v", "w", "U", "V", "S"):
            metres, seconds = metres - 1.0, seconds + 1.0
        elif name in ("p", "q", "r", "n"):
            seconds += 1.0
        elif name in ACCELERATIONS:
            metres, seconds = metres - (1.0 if name in ACCELERATIONS[:3] else 0.0), seconds + 2.0
    mass, length, time = powers
    # A coefficient per angle has the velocities of the other factors with it: U^k.
    speeds = length - metres
    if abs(mass - 1.0) > 1e-9 or abs(speeds + (time - seconds)) > 1e-9 or speeds not in (0.0, 1.0, 2.0):
        text = (
            f"the dimension of {term.output} over {term.multiplier}, perhaps without its speeds; or none for prime form"
        )
        raise InputError(f"{place}, column value", f"unit {unit!r} for {term.name}", text)
    scale = 1.0 if term.norm == "SI" else 0.5 * header.fluid.density_kgpm3 * header.scale.length_m**term.power
    if speeds != 0.0 and term.norm == "SI":
        raise InputError(
            f"{place}, column value", f"unit {unit!r}", f"the unit of {term.output} over {term.multiplier}"
        )
    if speeds == 0.0:
        return 1.0 / scale
    speed = float(run["U"]) if pd.notna(run.get("U")) else math.nan
    if not speed > 0.0:
        text = f"the speed the value is for: {unit} leaves {speeds:g} of the term's velocities to it"
        raise InputError(f"{place}, column U", "nothing", text)
    return 1.0 / (scale * speed**speeds)


def to_program(
    runs: pd.DataFrame, vehicle: Vehicle, header: CampaignFile, point: list[float], folder: str
) -> pd.DataFrame:
    """Published rows checked, in the program frame and in 1/2 rho L^n of the vehicle's reference length.

    Parameters
    ----------
    runs : Rows of a campaign; ``coefficient`` and ``value`` in published ones.
    vehicle : Its term set decides which coefficients there are.
    header : The campaign, for frame, length, draught, density and the sense of its angles.
    point : Moment point from the vehicle's origin [m].
    folder : For messages.

    Returns
    -------
    ``runs`` with ``value`` turned and renormalised.

    Raises
    ------
    InputError
        For a coefficient the vehicle's set does not have, one that is tabulated, a row of
        another test with a coefficient, or moments about another point, or a frame
        with x aft.
    """
    frame = header.frame.frame
    chosen = (runs["coefficient"] != "") | (runs["test"] == TEST) | runs["value"].notna() | (runs["unit"] != "")
    terms = {t.name: t for t in vehicle_terms(vehicle)}
    out = runs.copy()
    idle_speeds: dict[str, tuple[str, float] | None] = {}
    for i, run in runs[chosen].iterrows():
        place = f"{folder}/{run['file']}, row {run['row']}"
        if run["unit"] and str(run.get("value_unit") or ""):
            raise InputError(
                f"{place}, column unit", repr(run["unit"]), "a unit in the header or in the row, not in both"
            )
        if run["test"] != TEST:
            raise InputError(f"{place}, column coefficient, value or unit", "not blank", f"blank but for {TEST} rows")
        given = [o for o in (*OUTPUTS, "KT", "KQ", "t") if pd.notna(run[o])]
        if given:
            raise InputError(f"{place}, column {given[0]}", str(run[given[0]]), f"nothing but value in a {TEST} row")
        term = _term(run, terms, place)
        if frame.signs["x"] < 0:
            # Is Z_w there a factor of U w or of u w, with u < 0? Sources differ.
            raise InputError(f"{place}, frame x", "aft", "published derivatives in a frame with x forward")
        if any(point):
            text = "published derivatives about the vehicle's origin: one alone cannot be moved"
            raise InputError(f"{place}, moment point", f"{math.hypot(*point):g} m from it", text)
        made = factor_of(run, term, header, vehicle, place)
        out.loc[i, "value"] = run["value"] * made
        if "s_value" in out:
            out.loc[i, "s_value"] = run["s_value"] * abs(made)
        if pd.notna(run.get("U")):
            faster = factor_of(run.where(run.index != "U", 2.0 * run["U"]), term, header, vehicle, place)
            idle_speeds.setdefault(str(run["file"]), (place, float(run["U"])))
            # One value of a file that is for a speed is what the column is there for.
            idle_speeds[str(run["file"])] = None if faster != made else idle_speeds[str(run["file"])]
    for idle in idle_speeds.values():
        if idle is not None:
            text = "nothing, or the unit of values that are for a speed, such as kg/s of Y_v"
            raise InputError(f"{idle[0]}, column U", f"{idle[1]:g}, declared and unused", text)
    return out
