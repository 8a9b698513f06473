"""What a column of a run table or time history is: a quantity, its unit, its factor to SI.

``data/quantities.csv`` lists the quantities with their suffix units (``U_kts``, ``X_kN``);
a unit in brackets, ``X [lbf]`` or ``X (kgf)``, is read by the ``pint`` library and has to
have the dimension of the quantity.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import pandas as pd

from sim.boat.catalogue import OUTPUTS

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
# Brackets as wide as a character of Chinese or Japanese text.
_WIDE = str.maketrans("（）［］／，", "()[]/,")
RAISED = str.maketrans("⁻⁺⁰¹²³⁴⁵⁶⁷⁸⁹", "-+0123456789")
# A unit with a power of ten before it: 10^3 N, 1e3 N, 10³ N.
_POWER = re.compile(
    r"(?:10\s*(?:\^|\*\*)\s*(?P<a>[-+]?\d)|1[eE](?P<b>[-+]?\d)|10(?P<c>[⁻⁺]?[⁰¹²³⁴⁵⁶⁷⁸⁹]))"
    r"\s*[*·x× ]?\s*(?P<unit>[^\d\s].*)"
)
# A unit after a slash or a comma, as DIN 1313 and some loggers write it: F_y / kN; Fy, kN.
_AFTER = re.compile(r"^(?P<name>.*\S)(?:\s+/\s+|\s*,\s+)(?P<unit>\S.*)$")
_ANGLES = {"radian", "degree", "turn", "grade", "arcminute", "arcsecond", "milliradian"}
NO_UNIT = ("", "-", "1", "/")


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
    parts = _BRACKET.match(header.strip().translate(_WIDE))
    if not parts:
        after = _AFTER.match(header.strip())
        if after and is_unit(after["unit"].strip()):
            return after["name"].strip(), after["unit"].strip()
        return header.strip(), None
    unit = parts["square"] if parts["square"] is not None else parts["round"]
    return parts["name"].strip(), unit.strip()


def _plain(unit: str) -> str:
    """A unit with the letters of East Asian sets as those of ASCII: ``Ｎ``, ``㎏``, half-width middle dots."""
    # Raised digits stay: to this table m² is m2.
    kept = {*"°ºµ·", *map(chr, RAISED)}
    return "".join(c if c in kept else unicodedata.normalize("NFKC", c) for c in unit).replace("\u2215", "/")


def _clean(unit: str) -> str | None:
    """A unit in the one spelling handed to pint, or None when it is not made of units."""
    # 1/Deg, /deg and per degree are one.
    text = re.sub(r"(?i)\bdeg(?:s|rees?)?\b\.?", "deg", _plain(unit).strip())
    text = re.sub(r"^(?:/|[Pp]er\s)\s*", "1/", re.sub(r"\s+[Pp]er\s+", "/", text))
    text = re.sub(r"(?<=[A-Za-z])-(?=[A-Za-z])", "*", text)
    text = text.replace("°", "deg").replace("º", "deg").translate(RAISED)
    text = re.sub(r"[·⋅∙•‧・.]", "*", text.replace("^", "**"))
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
        ten = (power["a"] or power["b"] or power["c"].translate(RAISED)) if base is not None else ""
        return None if base is None or not -9 <= int(ten) <= 9 else base * 10.0 ** int(ten)
    spelled = _other_spellings().get(unit)
    if spelled is not None and (base := factor(quantity, spelled)) is not None:
        return base
    if unit in NO_UNIT or quantity not in _spelled() or len(unit) > 40:
        return choices.get("") if unit in NO_UNIT else None
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


@cache
def unit_words() -> frozenset[str]:
    """Units as words of their own: suffixes of run files, spellings of laboratories and what those stand for."""
    listed = {unit for choices in units().values() for unit in choices if unit not in NO_UNIT}
    return frozenset(listed | set(_other_spellings()) | set(_other_spellings().values()))


def known_unit(text: str) -> bool:
    """Whether some quantity is read in this unit."""
    return text not in NO_UNIT and any(factor(quantity, text) is not None for quantity in units())


def is_unit(text: str) -> bool:
    """Whether some quantity has this unit, or pint knows it, capitals or not."""
    if text in NO_UNIT or text in _other_spellings() or any(text in choices for choices in units().values()):
        return True
    if (power := _POWER.fullmatch(text)) is not None:
        return is_unit(power["unit"])
    import pint

    cleaned = _clean(text) if len(text) <= 40 else None
    try:
        return cleaned is not None and bool(_registry().parse_units(cleaned, case_sensitive=False))
    except (pint.errors.PintError, ValueError, TypeError, AttributeError, ArithmeticError):
        return False
