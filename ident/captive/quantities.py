"""What a column of a run table or time history is: a quantity, its unit, its factor to SI.

``data/quantities.csv`` lists the quantities with their suffix units (``U_kts``, ``X_kN``);
a unit in brackets, ``X [lbf]`` or ``X (kgf)``, is read by the ``pint`` library and has to
have the dimension of the quantity.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import pandas as pd

from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError

# A load, its standard error, and what an oscillatory test is reduced to: mean, then in
# phase and in quadrature with the displacement, first to third harmonic.
HARMONICS = ("mean", "in", "out", "in2", "out2", "in3", "out3")
# The same as an amplitude, and a phase ahead of the displacement's sine or a lag behind it.
POLAR = tuple(f"{kind}{k}" for k in ("", "2", "3") for kind in ("amp", "phase", "lag"))
# Before a load: what ``[[source.subtract]]`` took off it.
TAKEN = "taken_"
# Dimensionless input needs a named normalisation for these.
PRIMED = {
    **dict.fromkeys(("X", "Y", "Z"), "force"),
    **dict.fromkeys(("K", "M", "N"), "moment"),
    **dict.fromkeys(("p", "q", "r"), "rate"),
    **dict.fromkeys(("udot", "vdot", "wdot"), "acceleration"),
    **dict.fromkeys(("pdot", "qdot", "rdot"), "rotation"),
}
_BRACKET = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))$", re.DOTALL)
_PART = re.compile(r"([A-Za-zµ]+)(?:(?:\*\*|\^)?(-?[1-4]))?")
_RAISED = str.maketrans("⁻⁺⁰¹²³⁴⁵⁶⁷⁸⁹", "-+0123456789")
# A unit with a power of ten before it: 10^3 N, 1e3 N, 10³ N.
_POWER = re.compile(
    r"(?:10\s*(?:\^|\*\*)\s*(?P<a>[-+]?\d)|1[eE](?P<b>[-+]?\d)|10(?P<c>[⁻⁺]?[⁰¹²³⁴⁵⁶⁷⁸⁹]))"
    r"\s*[*·x× ]?\s*(?P<unit>[^\d\s].*)"
)
# A unit after a slash or a comma, as DIN 1313 and some loggers write it: F_y / kN; Fy, kN.
_AFTER = re.compile(r"^(?P<name>.*\S)(?:\s+/\s+|\s*,\s+)(?P<unit>\S.*)$")
_ANGLES = {"radian", "degree", "turn", "grade", "arcminute", "arcsecond", "milliradian"}
# Coefficients that are printed times ten, and headers that say so: 10KQ, 10 Kq [-], KQ x 10; and primes, Y' x1000,
# N' (*10^3). In front of or behind a dimensionless symbol, what is printed is the multiple.
_BARE = ("KT", "KQ", "J", "t")
_TENS = (
    r"1(?P<zeros>0{1,6})|10\s*(?:\^|\*\*)\s*(?P<power>[1-6])|10(?P<raised>[\u00b9\u00b2\u00b3\u2074-\u2076])"
    r"|1[eE]\+?(?P<e>[1-6])"
)
_SIGN = "[*x\u00b7\u00d7\u2219\u2022\u22c5\u2217]"
_BEFORE = re.compile(rf"(?:{_TENS})\s*{_SIGN}?\s*(?P<name>[A-Za-z]+'?)\s*(?:\[-?\]|\(-?\))?")
_BEHIND = re.compile(rf"(?P<name>[A-Za-z]+'?)\s*(?:\[-?\]|\(-?\))?\s*\(?\s*{_SIGN}\s*(?:{_TENS})\s*\)?")
_TIMES = re.compile(
    rf"(?i)(^|\s|\()1(0{{1,6}}|e[+-]?\d)\s*{_SIGN}?\s*[a-z]{{1,2}}(?![a-z])"
    rf"|{_SIGN}\s*(10{{1,6}}|10\s*(\^|\*\*|e)\s*[-+]?\d+|1e[+-]?\d+)\b"
)
# Powers of ten in any other place of a header, which a declaration would let pass as a part of its name: KQ/10, 0.1 KQ,
# Y' 10^3, Y' (10-3), 1/1000; and shares of a hundred or a thousand of what has no unit.
_TEN_SOMEWHERE = re.compile(
    r"10\s*(?:\^|\*\*)\s*[-+\u2212\u2013]?\s*\d|10[\u207b\u207a]?[\u00b9\u00b2\u00b3\u2074-\u2079]"
    r"|[\[(]\s*10\s*[-\u2212\u2013]\s*\d\s*[\])]|\b1[eE][-+\u2212]?\d\b|'[eE][-+]?\d\b|\b1\s*/\s*10{1,6}\b"
    r"|/\s*(?:10{1,6}|0?\.0*1)(?![\d.])|(?:^|[\s(\[])0?\.0*1\s*[*x\u00b7\u00d7]?\s*[A-Za-z]"
)
_SHARE = re.compile(
    r"(?i)[%\u2030]|(?<![a-z])(?:per\s?cent|pct|per\s?mill?e?|pro\s?mill?e?|pp[mt]|(?:hundred|thousand)ths?)(?![a-z])"
)
# Names of other papers and laboratories -> the quantity that is meant, for the message.
_MEANT = {
    **dict.fromkeys(
        ("delta", "Delta", "DELTA", "δ", "rudder", "Rudder", "RudderAngle", "deltar", "deltas", "deltaR"), "plane"
    ),
    **dict.fromkeys(("drift", "Drift", "driftangle", "β", "Beta", "BETA", "leeway", "sideslip"), "beta"),
    **dict.fromkeys(("incidence", "aoa", "AoA", "AOA", "α", "Alpha", "ALPHA", "pitch", "theta", "trim"), "alpha"),
    **dict.fromkeys(("R", "radius", "Radius", "Rm"), "R0"),
    **dict.fromkeys(("V", "speed", "Speed", "velocity", "Vm", "Um"), "U"),
    **dict.fromkeys(("Fx", "FX", "Drag", "drag", "Resistance"), "X"),
    **dict.fromkeys(("Fy", "FY", "SideForce", "Fsway"), "Y"),
    **dict.fromkeys(("Fz", "FZ", "Lift", "lift", "Heave"), "Z"),
    **dict.fromkeys(("Mx", "MX", "RollMoment"), "K"),
    **dict.fromkeys(("My", "MY", "PitchMoment"), "M"),
    **dict.fromkeys(("Mz", "MZ", "YawMoment"), "N"),
    **dict.fromkeys(("rpm", "RPM", "rps", "RPS", "revs"), "n"),
    **dict.fromkeys(("Time", "TIME", "t", "flowtime"), "time"),
    "L/R": "r",
}
_NO_UNIT = ("", "-", "1", "/")


@dataclass(frozen=True)
class Column:
    """What a column holds.

    Attributes
    ----------
    name : The header as it stands in the file.
    quantity : Name in the run table: ``U``, ``X``, ``s_X``, ``X_in``, ...
    factor : Factor to SI (rad, rev/s); 1 for dimensionless input.
    primed : True for a dimensionless load, rate or acceleration.
    unit : Of a published ``value``, which its coefficient decides the dimension of; empty for prime form.
    """

    name: str
    quantity: str
    factor: float
    primed: bool = False
    unit: str = ""


@cache
def table() -> pd.DataFrame:
    """The quantities: one row a quantity and unit."""
    with (files("ident") / "data" / "quantities.csv").open(encoding="utf-8") as stream:
        return pd.read_csv(stream, keep_default_na=False)


@cache
def units() -> dict[str, dict[str, float]]:
    """Quantity -> suffix unit -> factor to SI."""
    known: dict[str, dict[str, float]] = {}
    for q, unit, factor in zip(table()["quantity"], table()["unit"], table()["factor"], strict=True):
        known.setdefault(str(q), {})[str(unit)] = float(factor)
    return known


@cache
def _other_spellings() -> dict[str, str]:
    """Units as laboratories write them -> as this program and pint do, from ``data/unit_spellings.csv``."""
    with (files("ident") / "data" / "unit_spellings.csv").open(encoding="utf-8") as stream:
        rows = pd.read_csv(stream, keep_default_na=False)
    return dict(zip(rows["spelled"], rows["means"], strict=True))


@cache
def _spelled() -> dict[str, str]:
    """Quantity -> its SI unit as pint spells it."""
    rows = table()[table()["spelled"] != ""]
    return dict(zip(rows["quantity"], rows["spelled"], strict=True))


@cache
def suffixed() -> dict[str, tuple[str, float]]:
    """Column name with a suffix unit -> (quantity, factor to SI): ``U_kts``, ``sigma_X_N``."""
    known = {}
    for quantity, choices in units().items():
        for unit, factor in choices.items():
            known[f"{quantity}_{unit}" if unit else quantity] = (quantity, factor)
            if quantity in OUTPUTS or quantity == "value":
                known[f"sigma_{quantity}_{unit}" if unit else f"sigma_{quantity}"] = (f"s_{quantity}", factor)
    return known


def owner(quantity: str) -> str:
    """The listed quantity that gives ``s_X``, ``sigma_X`` or ``X_in`` its unit; empty for none."""
    if quantity in units():
        return quantity
    for output in (*OUTPUTS, "value"):
        if quantity in (f"s_{output}", f"sigma_{output}", *(f"{output}_{h}" for h in HARMONICS)):
            return output
        if quantity in {f"{output}_{h}" for h in POLAR}:
            return output if "_amp" in quantity else "alpha"
    return ""


def split(header: str) -> tuple[str, str | None]:
    """A header as name and unit in brackets; the unit is None when there are no brackets."""
    parts = _BRACKET.match(header.strip())
    if not parts:
        after = _AFTER.match(header.strip())
        if after and is_unit(after["unit"].strip()):
            return after["name"].strip(), after["unit"].strip()
        return header.strip(), None
    unit = parts["square"] if parts["square"] is not None else parts["round"]
    return parts["name"].strip(), unit.strip()


def _clean(unit: str) -> str | None:
    """A unit in the one spelling handed to pint, or None when it is not made of units."""
    text = re.sub(r"(?<=[A-Za-z])-(?=[A-Za-z])", "*", unit)
    text = text.replace("°", "deg").replace("º", "deg").translate(_RAISED)
    text = re.sub(r"[·⋅.]", "*", text.replace("^", "**"))
    text = re.sub(r"(?<![*/])\s+(?![*/])", "*", text.strip())
    # A product in brackets divides as a whole: kg/(m rad) is kg/m/rad.
    text = re.sub(r"/\s*\(([^()]*)\)", lambda m: "/" + re.sub(r"(?<!\*)\*(?!\*)", "/", m[1].strip()), text)
    parts = [p.strip() for p in re.split(r"(?<!\*)\*(?!\*)|(/)", text) if p is not None]
    cleaned = []
    for part in parts:
        if part == "/":
            cleaned.append(part)
            continue
        match = _PART.fullmatch(part.strip("()"))
        if part != "1" and not match:
            return None
        cleaned.append(part if not match else match[1] + (f"**{match[2]}" if match[2] else ""))
    if len(cleaned) > 8:
        return None
    return re.sub(r"\*?/\*?", "/", "*".join(cleaned))


@cache
def factor(quantity: str, unit: str) -> float | None:
    """Factor from a unit to the SI unit of a quantity, or None when it is not one of its units.

    Parameters
    ----------
    quantity : A quantity of ``data/quantities.csv``.
    unit : Suffix unit (``kNm``) or any unit that pint knows (``lbf*ft``, ``km/h``, ``deg/s``).
    """
    choices = units()[quantity]
    if unit in choices:
        return choices[unit]
    if (power := _POWER.fullmatch(unit)) is not None:
        base = factor(quantity, power["unit"])
        ten = (power["a"] or power["b"] or power["c"].translate(_RAISED)) if base is not None else ""
        return None if base is None or not -9 <= int(ten) <= 9 else base * 10.0 ** int(ten)
    spelled = _other_spellings().get(unit)
    if spelled is not None and (base := factor(quantity, spelled)) is not None:
        return base
    if unit in _NO_UNIT or quantity not in _spelled() or len(unit) > 40:
        return choices.get("") if unit in _NO_UNIT else None
    text = _clean(unit)
    if text is None:
        return None
    import pint

    registry = _registry()
    wanted = _spelled()[quantity]
    try:
        given = registry.parse_units(text)
        # pint counts angles as plain numbers; an angle without its unit is not one.
        if "rad" in wanted and not _ANGLES & {str(u) for u in dict(given._units)}:
            return None
        if "rad" not in wanted and _ANGLES & {str(u) for u in dict(given._units)}:
            return None
        return float(registry.Quantity(1.0, given).to(wanted).magnitude)
    except (pint.errors.PintError, ValueError, TypeError, AttributeError, ArithmeticError):
        return None


def powers_of(unit: str) -> tuple[float, float, float, float, int] | None:
    """A unit as factor to SI and radians, powers of kilogram, metre and second, and power of an angle.

    Returns
    -------
    None for what is no unit, or one with other dimensions.
    """
    text = _clean(unit) if len(unit) <= 40 else None
    if text is None:
        return None
    import pint

    registry = _registry()
    try:
        given = registry.parse_units(text)
        made = registry.Quantity(1.0, given).to_base_units()
    except (pint.errors.PintError, ValueError, TypeError, AttributeError, ArithmeticError):
        return None
    powers = {str(u): float(p) for u, p in dict(given._units).items()}
    angle = round(sum(p for u, p in powers.items() if u in _ANGLES))
    base = {str(k): float(v) for k, v in dict(made.dimensionality).items()}
    known = {"[mass]", "[length]", "[time]"}
    if set(base) - known:
        return None
    return (float(made.magnitude), base.get("[mass]", 0.0), base.get("[length]", 0.0), base.get("[time]", 0.0), angle)


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def allowed_units(quantity: str) -> str:
    """The units of a quantity, in words."""
    listed = [u for u in units()[quantity] if u]
    more = f", or any unit with the dimension of {_spelled()[quantity]}" if quantity in _spelled() else ""
    return (", ".join(listed) + more) if listed else "no unit: it is dimensionless"


def _contradiction(quantity: str, header: str, unit: str, place: str) -> None:
    """Refuse a header whose brackets hold another unit than the declaration; words in round ones are no unit."""
    stated = split(header)[1]
    if not quantity or stated in (None, "", unit) or (header.rstrip().endswith(")") and not is_unit(stated or "")):
        return
    there, here = factor(quantity, stated or ""), factor(quantity, unit)
    if there is None or here is None or not math.isclose(there, here, rel_tol=1e-12):
        raise InputError(place, f"unit {stated!r}, declared as {unit!r}", "one unit: leave it out of the declaration")


def is_unit(text: str) -> bool:
    """Whether some quantity has this unit, or pint knows it, capitals or not."""
    if text in _NO_UNIT or text in _other_spellings() or any(text in choices for choices in units().values()):
        return True
    if (power := _POWER.fullmatch(text)) is not None:
        return is_unit(power["unit"])
    import pint

    cleaned = _clean(text) if len(text) <= 40 else None
    try:
        return cleaned is not None and bool(_registry().parse_units(cleaned, case_sensitive=False))
    except (pint.errors.PintError, ValueError, TypeError, AttributeError, ArithmeticError):
        return False


def _multiple(header: str, declared: str | None) -> Column | None:
    """A dimensionless column whose header says by what its numbers are multiplied; None for others.

    ``10KQ`` holds ten times KQ, ``Y' x1000`` a thousand times Y'. A load with a unit may mean either, and is not read.
    """
    times = _BEFORE.fullmatch(header) or _BEHIND.fullmatch(header)
    if times is None:
        return None
    ten = times["zeros"] and len(times["zeros"])
    ten = ten or times["power"] or times["e"] or str(times["raised"]).translate(_RAISED)
    name, unit = split(declared) if declared is not None else (times["name"], None)
    name = {"kt": "KT", "kq": "KQ"}.get(name.lower(), name)
    bare = name.removesuffix("'")
    primed = name.endswith("'") or times["name"].endswith("'") or unit == "-"
    if owner(bare) in _BARE and owner(bare) == bare and unit in (None, *_NO_UNIT):
        return Column(header, bare, 10.0 ** -int(ten))
    if owner(bare) in PRIMED and owner(bare) == bare and primed and unit in (None, *_NO_UNIT):
        return Column(header, bare, 10.0 ** -int(ten), primed=True)
    return None


def _other_multiple(header: str, declared: str | None) -> bool:
    """Whether a declared header holds a power of ten outside of its unit, or is a share of what has no unit."""
    if declared is None:
        return False
    name, unit = split(declared)
    quantity = owner(name.removesuffix("'"))
    if not quantity:
        return False
    own, stated = split(header)
    plain = "" in units()[quantity] or name.endswith("'") or unit in _NO_UNIT
    # Of a unit the power of ten is read with it.
    rest = own if stated and factor(quantity, stated) is not None else header
    letters = re.sub(r"[^a-z]", "", own.lower())
    before = re.match(r"10{1,6}[-_\s]", header) and letters == re.sub(r"[^a-z]", "", name.lower())
    return bool(_TEN_SOMEWHERE.search(rest) or before or (plain and _SHARE.search(rest)))


def column(header: str, declared: str | None, where: str, factored: bool = False) -> Column:
    """What a column is, from its header and what the campaign declares it to be.

    Parameters
    ----------
    header : As it stands in the file: ``U_kts``, ``Fx [kN]``, ``N'``.
    declared : ``X`` or ``X [kN]`` from ``[source.columns]``; None to read the header itself.
    where : File and row, for the error.
    factored : Whether ``[source.factor]`` names the column.

    Raises
    ------
    InputError
        For an unknown quantity, a header that names a multiple without a stated factor, or a
        wrong, missing or contradicting unit.
    """
    if declared is None and header in suffixed():
        return Column(header, *suffixed()[header])
    place = f"{where}, column {header[:60]!r}"
    if not factored and (multiple := _multiple(header, declared)) is not None:
        return multiple
    if not factored and (_TIMES.search(header) or _other_multiple(header, declared)):
        text = "a factor in [source.factor]: what a value is multiplied by to give the quantity"
        raise InputError(place, "a header that names a multiple", text)
    if declared is not None and declared in suffixed():
        quantity, scale = suffixed()[declared]
        if owner(quantity) != declared or "" in units()[owner(quantity)]:
            return Column(header, quantity, scale)
    name, unit = split(header if declared is None else declared)
    if declared is not None and unit is None:
        unit = split(header)[1]
    elif declared is not None:
        _contradiction(owner(name.removesuffix("'")), header, unit or "", place)
    if name.endswith("'") and owner(name[:-1]) in PRIMED:
        name, unit = name[:-1], "-" if unit is None else unit
    known = owner(name)
    if not known:
        stem = header.rsplit("_", 1)[0]
        like = [c for c in suffixed() if c.rsplit("_", 1)[0] == stem]
        meant = _MEANT.get(re.sub(r"[^a-zA-Zβαδψ/]", "", split(header)[0]))
        usual = "a known quantity with its unit, such as U_mps, X_N, K [kN m]; or name it in [source.columns] or ignore"
        meant = f'{meant}: "{header[:40]}" = "{meant} [...]" in [source.columns]' if meant else ""
        text = ", ".join(like) or meant or usual
        raise InputError(where, f"unknown column or unit {header[:60]!r}", text)
    quantity = f"s_{known}" if name.startswith("sigma_") else name
    if known in PRIMED and unit is not None and unit in _NO_UNIT and unit != "":
        return Column(header, quantity, 1.0, primed=True)
    if unit is None and "" not in units()[known]:
        raise InputError(place, f"no unit for {name}", allowed_units(known))
    if known == "value" and unit is not None and unit not in _NO_UNIT:
        return Column(header, quantity, 1.0, unit=unit)
    scale_to_si = factor(known, unit or "")
    if scale_to_si is None:
        raise InputError(place, f"unit {unit!r} for {name}", allowed_units(known))
    return Column(header, quantity, scale_to_si)
