"""A boat in a case as an FMU, for co-simulation by FMI 2.0 or 3.0: generated C, compiled here."""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
import subprocess
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as xml

from ident.exports.c_source import Source, c_source, files, identifier
from ident.exports.fmi_stubs import stubs
from ident.exports.xml_text import xml_text
from ident.output import whole
from ident.validation.boats import Boat
from sim.files.errors import InputError
from sim.files.temporary import temporary_folder
from sim.flight.case import Case

# First value references.
_log = logging.getLogger(__name__)
_REFS = {"time": 0, "state": 1, "command": 20, "control": 30, "waves": 70, "speed": 71, "depth": 72}
_STATE_UNITS = ("m/s",) * 3 + ("rad/s",) * 3 + ("m",) * 3 + ("rad",) * 3
_COMMAND_UNITS = ("rad", "rad", "1/s", "kg", "m")
_UNITS = {
    "m/s": {"m": "1", "s": "-1"},
    "rad/s": {"rad": "1", "s": "-1"},
    "m": {"m": "1"},
    "rad": {"rad": "1"},
    "1/s": {"s": "-1"},
    "kg": {"kg": "1"},
    "s": {"s": "1"},
}
_PLATFORMS = {2: "linux64", 3: "x86_64-linux"}
_SAID = {
    "dV": "command in the vertical plane, bow up",
    "dH": "command in the horizontal plane, to starboard",
    "n": "revolutions commanded",
    "ballast": "ballast water commanded",
    "trim_tank": "shift of the centre of gravity forward commanded",
}


@dataclass(frozen=True)
class _Variable:
    name: str
    ref: int
    unit: str
    causality: str
    variability: str
    initial: str = ""
    start: float | None = None
    said: str = ""
    limits: tuple[float, float] | None = None


def export_fmu(boat: Boat, case: Case, db: str, path: Path, fmi: int = 2) -> dict[str, Any]:
    """Write a boat as an FMU with its sources, compiled by the C compiler of this machine.

    Parameters
    ----------
    boat, case, db : As ``ident.exports.c_source.c_source``.
    path : The FMU.
    fmi : Version of FMI, 2 or 3.

    Returns
    -------
    ``file``, and case, vehicle, version and digest, inputs, outputs and parameters.

    Raises
    ------
    InputError
        As ``c_source``, for a path that does not end in ``.fmu``, and without a C compiler.
    """
    if path.suffix != ".fmu":
        raise InputError(str(path), f"the ending {path.suffix!r}", ".fmu")
    source = c_source(boat, case, db)
    model = identifier(f"{boat.vehicle.name}_{case.name}")
    token = hashlib.sha256((source.header + source.source + str(fmi)).encode()).hexdigest()[:32]
    said = {"title": case.title, "program": _program(), "name": source.name, "upper": source.name.upper()}
    adapter = files().get_template("fmu.c.j2").render(said, fmi=fmi, refs=_REFS, token=token, stubs=stubs(fmi))
    texts = {f"{source.name}.h": source.header, f"{source.name}.c": source.source, f"fmi{fmi}.c": adapter + "\n"}
    variables = _variables(source)
    description = _description(boat, case, variables, model, token, fmi, [t for t in texts if t.endswith(".c")])
    with whole(path) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
        _put(archive, "modelDescription.xml", description)
        for name, text in texts.items():
            _put(archive, f"sources/{name}", text)
        if fmi == 3:
            _put(archive, "sources/buildDescription.xml", _build_description(model, list(texts)))
        _put(archive, f"binaries/{_PLATFORMS[fmi]}/{model}.so", compiled(texts))
    return {
        "file": str(path),
        "format": f"fmi{fmi}",
        "case": case.name,
        "vehicle": boat.vehicle.name,
        "database": boat.commit.origin(db),
        **{f"{k}s": [v.name for v in variables if v.causality == k] for k in ("input", "output", "parameter")},
    }


def _program() -> str:
    from ident import __version__

    return __version__


def _put(archive: zipfile.ZipFile, name: str, data: str | bytes) -> None:
    # One time for all files: the same boat is the same file.
    info = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
    info.compress_type, info.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
    archive.writestr(info, data)


def compiled(texts: dict[str, str]) -> bytes:
    """A shared library of C files, by ``$CC`` or ``cc``. Raises ``InputError`` without a compiler, or when it fails."""
    command = os.environ.get("CC", "cc")
    compiler = shutil.which(command)
    if compiler is None:
        raise InputError("the C compiler", f"{command} is not there", "a C compiler, named by the variable CC")
    with temporary_folder() as folder:
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
        names = [name for name in texts if name.endswith(".c")]
        done = subprocess.run(
            [compiler, "-std=c99", "-O2", "-fPIC", "-shared", "-o", "boat.so", *names, "-lm"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise InputError(f"the C compiler {compiler}", done.stderr.strip()[-500:], "a compiler of C99")
        _log.info("compiled", extra={"compiler": compiler, "files": " ".join(names)})
        return (folder / "boat.so").read_bytes()


def _variables(source: Source) -> list[_Variable]:
    state, controls, commands = source.start
    variables = [
        _Variable(name, _REFS["state"] + i, unit, "output", "continuous", "exact", float(state[i]))
        for i, (name, unit) in enumerate(zip(source.states, _STATE_UNITS, strict=True))
    ]
    for i, (name, unit) in enumerate(zip(source.commands, _COMMAND_UNITS, strict=False)):
        start = float(commands[i])
        variables.append(_Variable(name, _REFS["command"] + i, unit, "input", "discrete", "", start, _SAID[name]))
    planes = len(source.controls) - len(source.commands) + 2
    for i, name in enumerate(source.controls):
        unit = "rad" if i < planes else _COMMAND_UNITS[2 + i - planes]
        # An input has the plain name.
        shown = name if i < planes else f"{name}_reached"
        said = "as it is, behind its actuator"
        variables.append(
            _Variable(shown, _REFS["control"] + i, unit, "output", "continuous", "exact", float(controls[i]), said)
        )
    variables.append(_Variable("U", _REFS["speed"], "m/s", "output", "continuous", "calculated", said="speed"))
    variables.append(
        _Variable("D0", _REFS["depth"], "m", "output", "continuous", "calculated", said="depth of the sail top")
    )
    if source.in_waves:
        said, limits = "size of the waves as a share of the case's", (0.0, 1.0)
        variables.append(_Variable("waves", _REFS["waves"], "", "parameter", "fixed", "exact", 1.0, said, limits))
    return variables


def _described(variable: _Variable, fmi: int) -> xml.Element:
    """A variable in the model description."""
    named = {"name": variable.name, "valueReference": str(variable.ref)}
    if variable.said:
        named["description"] = variable.said
    named |= {"causality": variable.causality, "variability": variable.variability}
    # An input has no initial; a start alone says it.
    if variable.initial:
        named["initial"] = variable.initial
    real = {"unit": variable.unit} if variable.unit else {}
    if variable.limits:
        real |= {"min": repr(variable.limits[0]), "max": repr(variable.limits[1])}
    if variable.start is not None:
        real["start"] = repr(variable.start)
    if fmi == 3:
        return xml.Element("Float64", named | real)
    element = xml.Element("ScalarVariable", named)
    xml.SubElement(element, "Real", real)
    return element


def _description(
    boat: Boat, case: Case, variables: list[_Variable], model: str, token: str, fmi: int, sources: list[str]
) -> str:
    """``modelDescription.xml``."""
    root = xml.Element("fmiModelDescription", {
        "fmiVersion": f"{fmi}.0",
        "modelName": f"{boat.vehicle.name} {case.name}",
        "guid" if fmi == 2 else "instantiationToken": token,
        "description": f"{boat.vehicle.title}; {case.title}; database digest {boat.commit.digest}",
        "generationTool": f"ident {_program()}",
        "variableNamingConvention": "flat",
    })  # fmt: skip
    able = {"modelIdentifier": model, "canHandleVariableCommunicationStepSize": "true"}
    kind = "State" if fmi == 3 else "state"
    able |= {f"canGetAndSetFMU{kind}": "true", f"canSerializeFMU{kind}": "true"}
    simulation = xml.SubElement(root, "CoSimulation", able)
    if fmi == 2:
        listed = xml.SubElement(simulation, "SourceFiles")
        for name in sources:
            xml.SubElement(listed, "File", {"name": name})
    units = xml.SubElement(root, "UnitDefinitions")
    for name, powers in _UNITS.items():
        xml.SubElement(xml.SubElement(units, "Unit", {"name": name}), "BaseUnit", powers)
    last = repr(float(case.run.duration_s))
    xml.SubElement(root, "DefaultExperiment", {"startTime": "0.0", "stopTime": last, "stepSize": repr(case.run.step_s)})
    listed = xml.SubElement(root, "ModelVariables")
    if fmi == 3:
        clock = {"name": "time", "valueReference": "0", "causality": "independent", "variability": "continuous"}
        xml.SubElement(listed, "Float64", clock | {"unit": "s"})
    listed.extend(_described(v, fmi) for v in variables)
    structure = xml.SubElement(root, "ModelStructure")
    _structure(structure, variables, fmi)
    return xml_text(root)


def _structure(structure: xml.Element, variables: list[_Variable], fmi: int) -> None:
    """Outputs, and those of them that are worked out at the start."""
    outputs = [(i + 1, v) for i, v in enumerate(variables) if v.causality == "output"]
    unknown = [(i, v) for i, v in outputs if v.initial == "calculated"]
    if fmi == 3:
        for _, variable in outputs:
            xml.SubElement(structure, "Output", {"valueReference": str(variable.ref)})
        for _, variable in unknown:
            xml.SubElement(structure, "InitialUnknown", {"valueReference": str(variable.ref)})
        return
    for name, some in (("Outputs", outputs), ("InitialUnknowns", unknown)):
        listed = xml.SubElement(structure, name)
        for index, _ in some:
            xml.SubElement(listed, "Unknown", {"index": str(index)})


def _build_description(model: str, names: list[str]) -> str:
    """``sources/buildDescription.xml`` of FMI 3.0."""
    root = xml.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    build = xml.SubElement(root, "BuildConfiguration", {"modelIdentifier": model})
    some = xml.SubElement(build, "SourceFileSet", {"language": "C99"})
    for name in names:
        if name.endswith(".c"):
            xml.SubElement(some, "SourceFile", {"name": name})
    xml.SubElement(build, "Library", {"name": "m"})
    return xml_text(root)
