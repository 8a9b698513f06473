"""The coefficients of a vehicle as DAVE-ML, ANSI/AIAA S-119-2011, with check cases.

One gridded function a coefficient, over the axes of its table, in SI and radians. The tables are those that the
simulator reads: completed, and with the nodes of their rules beyond the data.
"""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as xml

import numpy as np
from numpy.typing import NDArray

from ident.exports.xml_text import xml_text
from ident.output import check_file, whole
from ident.validation.boats import Boat
from sim.boat.catalogue import axes as known_axes
from sim.boat.coefficients import Coefficient
from sim.files.errors import InputError

Array = NDArray[np.float64]
_NAMESPACE = "http://daveml.org/2010/DAVEML"
_CHECKS, _TOLERANCE = 3, 1e-9
# What a table does beyond its ends, in the words of the standard; loads that go on straight have none.
_BEYOND = {"linear": "both"}
_UNITS = {"m/s": "m_s", "deg": "rad", "rad": "rad", "rad/s": "rad_s", "m": "m", "m/s2": "m_s2", "rad2/s2": "rad2_s2"}


def export_daveml(boat: Boat, db: str, path: Path) -> dict[str, Any]:
    """Write the coefficients of a boat.

    Returns
    -------
    ``file``, vehicle, version and digest, number of ``functions`` and ``checks``, and what is ``lost``: coefficients
    whose rule beyond the data DAVE-ML has no word for.

    Raises
    ------
    InputError
        For a path that does not end in ``.dml`` or ``.xml``.
    """
    if path.suffix not in (".dml", ".xml"):
        raise InputError(str(path), f"the ending {path.suffix!r}", ".dml or .xml")
    check_file(path)
    root = xml.Element("DAVEfunc", {"xmlns": _NAMESPACE})
    _header(root, boat)
    members = list(boat.coefficients)
    axes = dict.fromkeys(a for c in members for a in c.term.axes)
    names = {a: f"axis_{i}" for i, a in enumerate(axes)}
    for axis, name in names.items():
        _variable(root, axis, name, _unit(axis))
    for c in members:
        _variable(root, f"{c.term.name} of {c.part}", _id(c), "nd", _said(c))
    gridded = [c for c in members if c.term.axes]
    for c in gridded:
        for k, (nodes, _) in enumerate(c.table.extension):
            made = xml.SubElement(root, "breakpointDef", {"bpID": f"{_id(c)}_bp{k}"})
            xml.SubElement(made, "bpVals").text = _numbers(nodes)
    for c in gridded:
        made = xml.SubElement(root, "griddedTableDef", {"gtID": f"{_id(c)}_table"})
        refs = xml.SubElement(made, "breakpointRefs")
        for k in range(len(c.term.axes)):
            xml.SubElement(refs, "bpRef", {"bpID": f"{_id(c)}_bp{k}"})
        xml.SubElement(made, "dataTable").text = _numbers(c.table.grid(c.values).ravel())
    for c in gridded:
        _function(root, c, names)
    checks = _checks(root, gridded, names)
    with whole(path) as part:
        part.write_text(xml_text(root), encoding="utf-8")
    return {
        "file": str(path),
        "format": "daveml",
        "vehicle": boat.vehicle.name,
        "database": boat.commit.origin(db),
        "functions": len(gridded),
        "checks": checks,
        "lost": [f"{c.term.name} of {c.part}: {r}" for c in gridded for r in c.table.rules if r == "linear_load"],
    }


def _header(root: xml.Element, boat: Boat) -> None:
    from ident import __version__

    header = xml.SubElement(root, "fileHeader", {"name": f"{boat.vehicle.name} hydrodynamic coefficients"})
    author = xml.SubElement(header, "author", {"name": f"ident {__version__}", "org": "ident"})
    xml.SubElement(author, "contactInfo").text = "see the digest in the description"
    # Of the commit, so that a version is the same file whenever it is written.
    day = datetime.fromtimestamp(int(boat.commit.metadata.get("time", "0")) / 1000.0, UTC).date().isoformat()
    xml.SubElement(header, "creationDate", {"date": day})
    said = f"{boat.vehicle.title}; database version {boat.commit.number}, digest {boat.commit.digest}. "
    said += "Coefficients in prime form as their descriptions say; frame x forward, y to starboard, z down."
    xml.SubElement(header, "description").text = said


def _id(c: Coefficient) -> str:
    """A name that XML takes as an ID, one a coefficient and part."""
    plain = "".join(ch if ch.isalnum() else f"_{ord(ch):x}_" for ch in f"{c.term.name}.{c.part}")
    return f"c_{plain}"


def _unit(axis: str) -> str:
    return _UNITS.get(known_axes()[axis].unit, "nd")


def _said(c: Coefficient) -> str:
    sign = "-" if c.term.sign < 0 else ""
    load = c.term.output or "none"
    return (
        f"load {load}: {sign}C x {'*'.join(c.term.factors) or '1'}, normalised by {c.term.norm or '1'}^{c.term.power}"
    )


def _variable(root: xml.Element, name: str, ref: str, unit: str, said: str = "") -> None:
    made = xml.SubElement(root, "variableDef", {"name": name, "varID": ref, "units": unit})
    if said:
        xml.SubElement(made, "description").text = said


def _numbers(values: Array) -> str:
    return ", ".join(repr(float(v)) for v in values)


def _function(root: xml.Element, c: Coefficient, names: dict[str, str]) -> None:
    made = xml.SubElement(root, "function", {"name": f"{c.term.name} of {c.part}"})
    for axis, rule, (nodes, _) in zip(c.term.axes, c.table.rules, c.table.extension, strict=True):
        ends = {"min": repr(float(nodes[0])), "max": repr(float(nodes[-1]))}
        beyond = {"extrapolate": _BEYOND.get(str(rule), "neither"), "interpolate": "linear"}
        xml.SubElement(made, "independentVarRef", {"varID": names[axis], **ends, **beyond})
    xml.SubElement(made, "dependentVarRef", {"varID": _id(c)})
    definition = xml.SubElement(made, "functionDefn", {"name": f"{c.term.name} of {c.part}"})
    xml.SubElement(definition, "griddedTableRef", {"gtID": f"{_id(c)}_table"})


def _checks(root: xml.Element, members: list[Coefficient], names: dict[str, str]) -> int:
    """Check cases from the simulator's own look-up: at points inside every table. How many."""
    data = xml.SubElement(root, "checkData")
    for number in range(_CHECKS):
        share = (number + 0.5) / _CHECKS
        for c in members:
            point = [_between(nodes, share + 0.1 * k) for k, (nodes, _) in enumerate(c.table.extension)]
            shot = xml.SubElement(data, "staticShot", {"name": f"{c.term.name} of {c.part}, {number + 1}"})
            inputs = xml.SubElement(shot, "checkInputs")
            for axis, x in zip(c.term.axes, point, strict=True):
                _signal(inputs, names[axis], _unit(axis), x)
            outputs = xml.SubElement(shot, "checkOutputs")
            value = c.at(point)
            tolerance = _TOLERANCE * max(1.0, float(np.abs(c.values).max()))
            xml.SubElement(_signal(outputs, _id(c), "nd", value), "tol").text = repr(tolerance)
    return len(data)


def _between(nodes: Array, share: float) -> float:
    """A place within an axis, not a node where there are two."""
    return float(nodes[0] + (nodes[-1] - nodes[0]) * min(share, 0.97))


def _signal(parent: xml.Element, ref: str, unit: str, value: float) -> xml.Element:
    made = xml.SubElement(parent, "signal")
    xml.SubElement(made, "varID").text = ref
    xml.SubElement(made, "signalUnits").text = unit
    xml.SubElement(made, "signalValue").text = repr(value)
    return made
