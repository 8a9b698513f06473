"""The header of a column: which quantity it names, in which unit, and whether its numbers are a multiple of it.

A header that could be meant two ways is refused with what the campaign has to state; a declaration in
``[source.columns]`` is held against what stands in the header.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from dataclasses import replace

from ident.captive.quantities import (
    NO_UNIT,
    PRIMED,
    RAISED,
    Column,
    allowed_units,
    factor,
    is_unit,
    owner,
    split,
    suffixed,
    unit_words,
    units,
)
from sim.files.errors import InputError

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
# The same in words, and an exponent or a ten right behind the name, of what has no unit.
_IN_WORDS = re.compile(
    rf"(?i)\b(?:milli|times|multipl\w*|divided)\b|{_SIGN}\s*1[,.'\s]000|[\s'\u00b7]e[-+\u2212]?\d\b|[a-z]'?10{{1,4}}$"
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
    **dict.fromkeys(("L/R", "omega", "Omega", "yawrate", "YawRate"), "r"),
}
# A radius that is given as a part of the length, and one that is twice itself.
_BY_LENGTH = re.compile(r"(?i)R0?\s*/\s*L(?:pp|oa|bp|wl)?")
_DIAMETER = re.compile(r"(?i)^d\b|\bdia(?:m\w*)?\b")
# Thrust and torque over the dynamic pressure of advance (C_Th) or of advance and blade (C_T*), not over n^2.
_BY_FLOW = re.compile(r"(?i)^c[_ ]?(?:t|q|th|tq|s)(?:h|o)?(?:\*|_?\d)?$|thrust[ _-]?load")
# Sizes of an oscillation that are no amplitude, and phases that are not what they are declared as.
_NO_AMPLITUDE = re.compile(
    r"(?i)(?<![a-z])(?:p(?:ea)?k?\s?-?\s?(?:to\s?-?\s?)?p(?:ea)?k?|double\s?-?\s?amp\w*|r\.?m\.?s\.?)(?![a-z])"
)
# Words of a way between both ends: in a record that is where the body is, in a table it is no amplitude.
_BOTH_WAYS = re.compile(
    r"(?i)(?<![a-z])(?:stroke|hub|travel|width|range|full|total|trough|course|twice|doppel\w*|\w*breite)(?![a-z])"
    r"|(?<![\w.])2\s*[*x\u00b7\u00d7]?\s*[ayz](?![a-z])|max\w*\s*[-\u2212\u2013]\s*\w*min|[\u5168\u4e21]\u632f\u5e45"
)
_BEHIND_IT = re.compile(r"(?i)(?<![a-z])(?:lag(?:s|ged|ging)?|behind|delay\w*|retard\w*)(?![a-z])")
_AHEAD = re.compile(r"(?i)(?<![a-z])(?:lead\w*|ahead|advance\w*)(?![a-z])")
_OF_ANOTHER = re.compile(r"(?i)(?<![a-z])(?:vel(?:oc\w*)?|acc(?:el\w*)?|cos(?:ine)?)(?![a-z])")


def _of_an_oscillation(name: str, header: str, place: str) -> None:
    """Refuse a declared header that says it is no amplitude, or another phase than the declared one."""
    kind = name.rpartition("_")[2].rstrip("23")
    if not name.startswith("sigma_") and owner(name) not in ("time", "frequency") and _NO_AMPLITUDE.search(header):
        text = "a factor in [source.factor]: 0.5 of a double amplitude, 1.4142 of a root mean square, 1.0 of neither"
        raise InputError(place, f"a header that names another size, declared as {name}", text)
    other = {"phase": _BEHIND_IT, "lag": _AHEAD}.get(kind)
    if other is not None and other.search(header):
        meant = name.replace("phase", "lag") if kind == "phase" else name.replace("lag", "phase")
        text = f"{meant}; or a factor of 1.0 in [source.factor]"
        raise InputError(place, f"a header that says the opposite, declared as {name}", text)
    if other is not None and _OF_ANOTHER.search(header):
        text = "phases to the sine of the displacement; or a factor of 1.0 in [source.factor] where these are"
        raise InputError(place, f"a header that names another reference, declared as {name}", text)


def refuse_both_ways(kind: Column, where: str) -> None:
    """Refuse the displacement of a table of harmonics under a header that names the way between both ends.

    Raises
    ------
    InputError
        Naming the column.
    """
    if kind.quantity == "displacement" and _BOTH_WAYS.search(split(kind.name)[0]):
        text = "a factor in [source.factor]: 0.5 of the way from end to end, 1.0 of an amplitude"
        place = f"{where}, column {kind.name[:60]!r}"
        raise InputError(place, "a header that names a way between both ends, and the amplitude is meant", text)


def _contradiction(quantity: str, header: str, unit: str, place: str) -> None:
    """Refuse a header that holds another unit than the declaration; words in round brackets are no unit.

    Outside of brackets units are those of the run files and of ``data/unit_spellings.csv``: ``Fy_kN``, ``Y in lbf``.
    """
    if not quantity:
        return
    stated = split(header)[1]
    if stated not in (None, "", unit) and not (header.rstrip().endswith(")") and not is_unit(stated or "")):
        there, here = factor(quantity, stated or ""), factor(quantity, unit)
        if there is None or here is None or not math.isclose(there, here, rel_tol=1e-12):
            _two_units(stated or "", unit, place)
        return
    for word in re.split(r"[\s_\-:|{}<>\[\](),;=]+|(?<=[a-z])/(?=[A-Za-z])", header.strip())[:20]:
        there, here = factor(quantity, word) if word in unit_words() else None, factor(quantity, unit)
        if there is not None and here is not None and not math.isclose(there, here, rel_tol=1e-12):
            _two_units(word, unit, place)


def _two_units(stated: str, declared: str, place: str) -> None:
    text = "one unit: leave it out of the declaration, or the column under another name"
    raise InputError(place, f"unit {stated!r}, declared as {declared!r}", text)


def _multiple(header: str, declared: str | None) -> Column | None:
    """A dimensionless column whose header says by what its numbers are multiplied; None for others.

    ``10KQ`` holds ten times KQ, ``Y' x1000`` a thousand times Y'. A load with a unit may mean either, and is not read.
    """
    times = _BEFORE.fullmatch(header) or _BEHIND.fullmatch(header)
    if times is None:
        return None
    ten = times["zeros"] and len(times["zeros"])
    ten = ten or times["power"] or times["e"] or str(times["raised"]).translate(RAISED)
    name, unit = split(declared) if declared is not None else (times["name"], None)
    name = {"kt": "KT", "kq": "KQ"}.get(name.lower(), name)
    bare = name.removesuffix("'")
    primed = name.endswith("'") or times["name"].endswith("'") or unit == "-"
    if owner(bare) in _BARE and owner(bare) == bare and unit in (None, *NO_UNIT):
        return Column(header, bare, 10.0 ** -int(ten))
    if owner(bare) in PRIMED and owner(bare) == bare and primed and unit in (None, *NO_UNIT):
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
    plain = "" in units()[quantity] or name.endswith("'") or unit in NO_UNIT
    # Of a unit the power of ten is read with it.
    rest = own if stated and factor(quantity, stated) is not None else header
    letters = re.sub(r"[^a-z]", "", own.lower())
    before = re.match(r"10{1,6}[-_\s]", header) and letters == re.sub(r"[^a-z]", "", name.lower())
    return bool(_TEN_SOMEWHERE.search(rest) or before or (plain and (_SHARE.search(rest) or _IN_WORDS.search(rest))))


def _factored(header: str, quantity: str, factors: Collection[str]) -> bool:
    """Whether a factor is stated for a column, under its header or its quantity."""
    return any(name in factors for name in (header, split(header)[0], quantity) if name)


def _meant(header: str) -> str:
    """What an unknown header may have been meant to be, in words."""
    stem = header.rsplit("_", 1)[0]
    like = [c for c in suffixed() if c.rsplit("_", 1)[0] == stem]
    if like:
        return ", ".join(like)
    if _BY_LENGTH.fullmatch(split(header)[0]):
        name = header[:40]
        return f'R0: "{name}" = "R0 [m]" in [source.columns], and "{name}" = the length in [source.factor]'
    meant = _MEANT.get(re.sub(r"[^a-zA-Zβαδψ/]", "", split(header)[0]))
    usual = "a known quantity with its unit, such as U_mps, X_N, K [kN m]; or name it in [source.columns] or ignore"
    return f'{meant}: "{header[:40]}" = "{meant} [...]" in [source.columns]' if meant else usual


def _refuse_other_sizes(header: str, declared: str | None, named: str, place: str) -> None:
    """Refuse a header whose numbers are a multiple, a diameter or another size of an oscillation, without a factor."""
    if _TIMES.search(header) or _other_multiple(header, declared):
        text = "a factor in [source.factor]: what a value is multiplied by to give the quantity"
        raise InputError(place, "a header that names a multiple", text)
    if declared is not None and named:
        _of_an_oscillation(split(declared)[0], split(header)[0] or header, place)
    if named == "R0" and declared is not None and _DIAMETER.search(split(header)[0]):
        text = f'a factor in [source.factor]: "{split(header)[0][:40]}" = 0.5, or 1.0 where it is the radius'
        raise InputError(place, "a header that names a diameter, declared as the radius R0", text)
    if named in ("KT", "KQ") and declared is not None and _BY_FLOW.search(split(header)[0]):
        text = f"{named} over rho n^2 D^4 or D^5; a factor of 1.0 in [source.factor] where these are"
        raise InputError(
            place, f"a header that names a coefficient by the speed of the flow, declared as {named}", text
        )


def column(header: str, declared: str | None, where: str, factors: Collection[str] = ()) -> Column:
    """What a column is, from its header and what the campaign declares it to be.

    Parameters
    ----------
    header : As it stands in the file: ``U_kts``, ``Fx [kN]``, ``N'``.
    declared : ``X`` or ``X [kN]`` from ``[source.columns]``; None to read the header itself.
    where : File and row, for the error.
    factors : Headers and quantities that ``[source.factor]`` names.

    Raises
    ------
    InputError
        For an unknown quantity, a header that names a multiple without a stated factor, or a
        wrong, missing or contradicting unit.
    """
    if declared is None and header in suffixed():
        return Column(header, *suffixed()[header])
    place = f"{where}, column {header[:60]!r}"
    if (multiple := _multiple(header, declared)) is not None:
        # A stated factor is the only one: the header's is not put on top of it.
        return replace(multiple, factor=1.0) if _factored(header, multiple.quantity, factors) else multiple
    named = owner(split(header if declared is None else declared)[0].removesuffix("'"))
    if not _factored(header, named, factors):
        _refuse_other_sizes(header, declared, named, place)
    if declared is not None and declared in suffixed():
        quantity, scale = suffixed()[declared]
        if owner(quantity) != declared or "" in units()[owner(quantity)]:
            return Column(header, quantity, scale)
    name, unit = split(header if declared is None else declared)
    if declared is not None and unit is None:
        unit = split(header)[1]
    elif declared is not None:
        quantity = owner(name.removesuffix("'"))
        stated = split(header)[1] or ""
        # With a factor, what stands in the file may be of another kind: volts of a bridge.
        calibrated = _factored(header, quantity, factors) and is_unit(stated) and factor(quantity, stated) is None
        if not calibrated:
            _contradiction(quantity, header, unit or "", place)
    if name.endswith("'") and owner(name[:-1]) in PRIMED:
        name, unit = name[:-1], "-" if unit is None else unit
    known = owner(name)
    if not known:
        text = _meant(header)
        raise InputError(where, f"unknown column or unit {header[:60]!r}", text)
    quantity = f"s_{known}" if name.startswith("sigma_") else name
    if known in PRIMED and unit is not None and unit in NO_UNIT and unit != "":
        return Column(header, quantity, 1.0, primed=True)
    if known == "t" and declared is None and unit and factor("time", unit) is not None:
        raise InputError(where, f"unknown column or unit {header[:60]!r}", f'time: "{header[:40]}" = "time [{unit}]"')
    if unit is None and "" not in units()[known]:
        raise InputError(place, f"no unit for {name}", allowed_units(known))
    if known == "value" and unit is not None and unit not in NO_UNIT:
        return Column(header, quantity, 1.0, unit=unit)
    scale_to_si = factor(known, unit or "")
    if scale_to_si is None:
        raise InputError(place, f"unit {unit!r} for {name}", allowed_units(known))
    return Column(header, quantity, scale_to_si)
