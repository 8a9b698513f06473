"""A boat as an SDF model of Gazebo: mass, added mass, and the terms of its hydrodynamics plugin."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree as xml

import numpy as np
from numpy.typing import NDArray

from ident.exports.gazebo_terms import MOTIONS, Terms, add_rotation_of_water, terms_of
from ident.exports.xml_text import xml_text
from ident.output import check_file, whole
from ident.validation.boats import Boat
from sim.boat.catalogue import OUTPUTS
from sim.boat.mass import added_mass_matrix
from sim.files.errors import InputError
from sim.flight.case import Case
from sim.flight.simulate import begun, environment_of
from sim.kernel.layout import Model

Array = NDArray[np.float64]
# Gazebo's links: x forward, y to port, z up. Loads and motions change sign about y and z.
_TURN = dict(zip((*OUTPUTS, *MOTIONS), 2 * (1.0, -1.0, -1.0, 1.0, -1.0, -1.0), strict=True))
_LETTERS = "xyzpqr"
LOST = (
    "tables: each is a constant at one speed and depth, fitted where its comment says so",
    "loads by deflection of planes (planes are amidships: fins of your own with the lift-drag plugin)",
    "the propeller (the thruster plugin)",
    "buoyancy (the buoyancy plugin, from the volume of the link's collision shapes)",
    "actuators, waves, a free surface, layers of density, ballast and trim tanks",
    "a current (publish it on /ocean_current)",
    "standard errors, runs and covariance: those are in the exchange file",
)


def export_gazebo(boat: Boat, case: Case, db: str, path: Path) -> dict[str, Any]:
    """Write a boat as an SDF model.

    Added mass is the link's ``fluid_added_mass``, whole, which the physics engine DART reads; it stands in the plugin
    too, switched off, for engines that do not. What an engine then adds by turning is taken back by terms, as the
    coefficients hold it.

    Parameters
    ----------
    boat : Vehicle and coefficients of a version.
    case : Water density, and the speed and depth at which tables become constants: those of its start.
    db : Database, to be named in the file.
    path : Ends in ``.sdf``.

    Returns
    -------
    ``file``, vehicle, version and digest, ``speed_mps`` and ``depth_m`` of the constants, ``terms`` of the plugin by
    name, ``largest_misfit`` of the fits as a share of the largest load of a table, and what is ``lost``.

    Raises
    ------
    InputError
        For a path that does not end in ``.sdf``, or a boat whose motions are held.
    sim.flight.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.
    """
    if path.suffix != ".sdf":
        raise InputError(str(path), f"the ending {path.suffix!r}", ".sdf")
    check_file(path)
    vehicle, environment = boat.vehicle, environment_of(case)
    if vehicle.terms_of.rudder:
        raise InputError(f"vehicle {vehicle.name}", "motions that are held", "a boat that moves in all six")
    model, start, _, _, _ = begun(case, vehicle, boat.model(case))
    speed, depth = float(np.linalg.norm(start[:3])), float(start[8] + model.sail_top)
    terms = terms_of(boat.coefficients, environment, speed, depth)
    # The format has one half of the matrix: the mean of both, should a measured one not be symmetric.
    measured = added_mass_matrix(boat.coefficients, environment)
    symmetric = 0.5 * (measured + measured.T)
    add_rotation_of_water(terms, symmetric)
    added = _turned(symmetric)
    lost = [*LOST, *terms.lost]
    root = xml.Element("sdf", {"version": "1.11"})
    root.append(xml.Comment(_said(boat, speed, depth, environment.density, lost)))
    made = xml.SubElement(root, "model", {"name": vehicle.name})
    link = xml.SubElement(made, "link", {"name": "hull"})
    _inertial(link, boat, model, added)
    plugin = xml.SubElement(
        made, "plugin", {"filename": "gz-sim-hydrodynamics-system", "name": "gz::sim::systems::Hydrodynamics"}
    )
    xml.SubElement(plugin, "link_name").text = "hull"
    named = _plugin(plugin, terms, added)
    with whole(path) as part:
        part.write_text(xml_text(root), encoding="utf-8")
    return {
        "file": str(path),
        "format": "gazebo",
        "vehicle": vehicle.name,
        "database": boat.commit.origin(db),
        "speed_mps": speed,
        "depth_m": depth,
        "terms": named,
        "largest_misfit": terms.largest_misfit,
        "lost": lost,
    }


def _comment(text: str) -> str:
    """Two hyphens end a comment of XML."""
    while "--" in text:
        text = text.replace("--", "- -")
    return f" {text} "


def _said(boat: Boat, speed: float, depth: float, density: float, lost: list[str]) -> str:
    from ident import __version__

    lines = [
        f"ident {__version__}: {boat.vehicle.title}; database version {boat.commit.number}, digest "
        f"{boat.commit.digest}",
        f"Water of {density:g} kg/m3; tables read at {speed:.4g} m/s and D0 {depth:.4g} m. SI; x forward, y to port, "
        "z up, origin of the link that of the body.",
        "Each term is the sum of what the comments above it name, in this frame.",
        *(f"Lost: {one}" for one in lost),
    ]
    return _comment("\n".join(lines))


def _turned(matrix: Array) -> Array:
    """A (6, 6) matrix in Gazebo's frame."""
    signs = np.array([_TURN[k] for k in MOTIONS])
    return matrix * np.outer(signs, signs)


def _element(parent: xml.Element, tag: str, value: float) -> None:
    xml.SubElement(parent, tag).text = repr(float(value) + 0.0)


def _inertial(link: xml.Element, boat: Boat, model: Model, added: Array) -> None:
    """Mass and inertia about the centre of gravity, added mass about the link's origin."""
    inertial = xml.SubElement(link, "inertial")
    x, y, z = (float(f) + 0.0 for f in model.r_g * (1.0, -1.0, -1.0))
    xml.SubElement(inertial, "pose").text = f"{x!r} {y!r} {z!r} 0 0 0"
    _element(inertial, "mass", model.mass)
    inertia = xml.SubElement(inertial, "inertia")
    radii = boat.vehicle.particulars.radius_of_gyration.value
    for axis, radius in zip("xyz", radii, strict=True):
        _element(inertia, f"i{axis}{axis}", model.mass * radius**2)
    for pair in ("ixy", "ixz", "iyz"):
        _element(inertia, pair, 0.0)
    fluid = xml.SubElement(inertial, "fluid_added_mass")
    for i, a in enumerate(_LETTERS):
        for j, b in enumerate(_LETTERS[i:], start=i):
            _element(fluid, a + b, added[i, j])


def _plugin(plugin: xml.Element, terms: Terms, added: Array) -> dict[str, float]:
    """The plugin's elements, each below what it is made of. Their values by name."""
    named: dict[str, float] = {}
    plugin.append(
        xml.Comment(
            _comment(
                "for engines that do not read fluid_added_mass: both false; off its diagonal the turning stays in twice"
            )
        )
    )
    for flag in ("disable_added_mass", "disable_coriolis"):
        xml.SubElement(plugin, flag).text = "true"
    for i, output in enumerate("xyzkmn"):
        for j, motion in enumerate(MOTIONS):
            if added[i, j]:
                # As derivatives, Fossen's sign: X_udot is minus the added mass.
                named[f"{output}Dot{motion.upper()}"] = -float(added[i, j])
                _element(plugin, f"{output}Dot{motion.upper()}", -added[i, j])
    for (load, a, b), shares in sorted(terms.shares.items(), key=lambda one: (OUTPUTS.index(one[0][0]), one[0])):
        size = b.startswith("|")
        sign = _TURN[load] * _TURN[a] * _TURN.get(b, 1.0)
        name = f"{load.lower()}{a.upper()}{'abs' if size else ''}{b.strip('|').upper()}"
        for share in shares:
            plugin.append(xml.Comment(_comment(f"{sign * share.value:.6g}: {share.source}")))
        named[name] = sign * terms.values()[load, a, b]
        _element(plugin, name, named[name])
    return named
