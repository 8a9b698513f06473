"""A boat as an aircraft of JSBSim: its loads as functions, applied as external reactions.

JSBSim moves a rigid body and knows no added mass. The reaction that is applied is therefore the one that gives
JSBSim's rigid body the acceleration of the boat with its added mass: with M the rigid-body matrix, A the added mass
and T all loads about the origin (water, weight, buoyancy, rotation), the acceleration is (M + A)^-1 T, and the
reaction M (M + A)^-1 T less what JSBSim adds by itself, weight and rotation. No acceleration of an earlier step is
fed back, so that it is as stable as JSBSim's integration.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.exports.jsbsim_functions import (
    ROOT,
    Node,
    arcsine,
    boat_features,
    feature,
    function,
    known_features,
    look_up,
    named,
    node,
    plain,
    plane_feature,
    read,
    scaled,
    total,
    value,
)
from ident.exports.xml_text import xml_text
from ident.output import check_file, whole
from ident.validation.boats import Boat
from sim.boat.catalogue import OUTPUTS, PLANE_FEATURES, STATES
from sim.boat.coefficients import Coefficient
from sim.boat.mass import Environment, cross_matrix
from sim.files.constants import constant
from sim.files.errors import InputError
from sim.flight.case import Case
from sim.flight.simulate import begun, environment_of
from sim.kernel.layout import Model

Array = NDArray[np.float64]
# JSBSim counts in feet and pounds.
_FOOT = constant("foot")
_NEWTON = 1.0 / constant("pound_force")
_MOTIONS = ("u", "v", "w", "p", "q", "r")
LOST = (
    "actuators: deflections and revolutions are where their properties are set, without rates, limits or the mixer",
    "waves, a free surface, layers of density, compression of the hull, ballast and trim tanks",
    "standard errors, runs and covariance: those are in the exchange file",
    "a current: it is JSBSim's wind",
    "the round earth: JSBSim's gravity and rotation act beside the loads; fly on a planet that does not turn",
)


def export_jsbsim(boat: Boat, case: Case, db: str, path: Path) -> dict[str, Any]:
    """Write a boat as an aircraft file of JSBSim.

    Parameters
    ----------
    boat : Vehicle and coefficients of a version.
    case : Water density, by which the loads are made dimensional, and the start: deflections and revolutions of its
        equilibrium are those that the file begins with. Gravity is JSBSim's.
    db : Database, to be named in the file.
    path : ``NAME/NAME.xml`` where JSBSim looks for an aircraft NAME.

    Returns
    -------
    ``file``, vehicle, version and digest, number of ``functions`` (one a coefficient), the properties that command
    the boat with their values at the start (``inputs``), the (12,) state there (``start``), and what is ``lost``.

    Raises
    ------
    InputError
        For a path that does not end in ``.xml``, or a boat with loads that JSBSim's functions do not hold: motions
        that are held, a ship's propeller and rudder, a propeller's wash over the planes, tanks in use.
    sim.flight.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.
    """
    if path.suffix != ".xml":
        raise InputError(str(path), f"the ending {path.suffix!r}", ".xml")
    check_file(path)
    _refuse_unknown(boat)
    environment = environment_of(case)
    model, start, controls, _, _ = begun(case, boat.vehicle, boat.model(case))
    if model.has_tanks:
        raise InputError(f"case {case.name}", "ballast and trim tanks in use", "a case without [command.ballast]")
    reactions = node("external_reactions")
    names = [f"{ROOT}/{plain(p.name)}-rad" for p in boat.vehicle.planes] + [f"{ROOT}/n-rps"]
    inputs = dict(zip(names, controls.tolist(), strict=True))
    reactions.extend(node("property", text=name, value=repr(x)) for name, x in inputs.items())
    members = [c for c in boat.coefficients if not c.term.is_acceleration and (c.term.output or c.term.name == "t")]
    reactions.extend(_state(boat, model, names))
    reactions.extend(_loads(boat, environment, members))
    reactions.extend(_motion(model, environment))
    reactions.extend(_applied(model))
    root = node("fdm_config", _header(boat, environment, names), *_body(boat, model), reactions, name=boat.vehicle.name)
    root.set("version", "2.0")
    with whole(path) as part:
        part.write_text(xml_text(root), encoding="utf-8")
    return {
        "file": str(path),
        "format": "jsbsim",
        "vehicle": boat.vehicle.name,
        "database": boat.commit.origin(db),
        "functions": len(members),
        "inputs": inputs,
        "start": dict(zip(STATES, start.tolist(), strict=True)),
        "lost": list(LOST),
    }


def _refuse_unknown(boat: Boat) -> None:
    """No load is left out in silence."""
    vehicle = boat.vehicle
    known, allowed = known_features(), "a submerged boat whose loads are sums of its terms"
    if vehicle.terms_of.rudder:
        text = "motions that are held, and a propeller and rudder that act on each other"
        raise InputError(f"vehicle {vehicle.name}", text, allowed)
    for c in boat.coefficients:
        needed = (*c.term.factors, *c.term.axes) if c.term.output and not c.term.is_acceleration else ()
        for name in needed:
            if name not in known and name not in PLANE_FEATURES:
                raise InputError(f"vehicle {vehicle.name}", f"{c.term.name}, which depends on {name}", allowed)


def _header(boat: Boat, environment: Environment, inputs: list[str]) -> Node:
    from ident import __version__

    said = (
        f"{boat.vehicle.title}; database version {boat.commit.number}, digest {boat.commit.digest}; water of "
        f"{environment.density:g} kg/m3. SI and radians under {ROOT}/, frame x forward, y to starboard, z down; "
        f"depth is minus position/h-sl-meters. Set {', '.join(inputs)}. Lost: {'; '.join(LOST)}."
    )
    return node(
        "fileheader",
        node("author", text=f"ident {__version__}"),
        node("description", text=said),
        node("version", text=str(boat.commit.number)),
    )


def _triple(tag: str, place: Array, **attributes: str) -> Node:
    """A place in JSBSim's structural frame: x aft, y to starboard, z up."""
    parts = [node(k, text=repr(float(x))) for k, x in zip("xyz", (-place[0], place[1], -place[2]), strict=True)]
    return node(tag, *parts, **attributes)


def _number(tag: str, x: float, **attributes: str) -> Node:
    return node(tag, text=repr(float(x)), **attributes)


def _body(boat: Boat, model: Model) -> list[Node]:
    """Metrics, which nothing here reads but JSBSim asks for, and mass; then the sections that must be there."""
    particulars = boat.vehicle.particulars
    length, mass = particulars.length.value, particulars.mass.value
    ixx, iyy, izz = mass * np.square(particulars.radius_of_gyration.value)
    metrics = node(
        "metrics",
        _number("wingarea", length**2, unit="M2"),
        _number("wingspan", length, unit="M"),
        _number("chord", length, unit="M"),
        *(_triple("location", np.zeros(3), name=name, unit="M") for name in ("AERORP", "EYEPOINT", "VRP")),
    )
    moments = [
        _number(k, x, unit="KG*M2") for k, x in (("ixx", ixx), ("iyy", iyy), ("izz", izz), ("ixy", 0.0), ("ixz", 0.0))
    ]
    balance = node(
        "mass_balance",
        *moments,
        _number("iyz", 0.0, unit="KG*M2"),
        _number("emptywt", mass, unit="KG"),
        _triple("location", model.r_g, name="CG", unit="M"),
    )
    names = ("ground_reactions", "propulsion", "flight_control", "aerodynamics")
    ground, propulsion, control, aerodynamics = (node(name) for name in names)
    control.set("name", boat.vehicle.name)
    return [metrics, balance, ground, propulsion, control, aerodynamics]


def _state(boat: Boat, model: Model, inputs: list[str]) -> list[Node]:
    """Motion of the body origin through the water, from JSBSim's of the centre of gravity, and its features."""
    x, y, z = model.r_g
    rate = {k: read(f"velocities/{k}-aero-rad_sec") for k in "pqr"}
    # v_O = v_G - omega x r_G, component by component.
    turned = {"u": (("q", -z), ("r", y)), "v": (("r", -x), ("p", z)), "w": (("p", -y), ("q", x))}
    made = []
    for name, parts in turned.items():
        through = scaled(_FOOT, read(f"velocities/{name}-aero-fps"))
        body = total(through, *(scaled(f, rate[k]) for k, f in parts if f))
        made.append(function(feature(name), body, "of the body origin through the water [m/s]"))
    made += [function(feature(k), read(f"velocities/{k}-aero-rad_sec"), "[rad/s]") for k in "pqr"]
    made += _attitude()
    centre = [scaled(-f, read(f"{ROOT}/down-{k}")) for k, f in zip("xyz", (x, y, z), strict=True) if f]
    below = total(scaled(-1.0, read("position/h-sl-meters")), *centre, value(model.sail_top))
    n = read(feature("n"))
    pitch = scaled(model.diameter, n) if model.diameter else n
    ahead = node("quotient", scaled(1.0 - model.wake, read(feature("u"))), pitch)
    advance = node("ifthen", node("eq", n, value(0.0)), value(0.0), ahead)
    features = boat_features(below, advance, read(inputs[-1]))
    made += [function(feature(name), body) for name, body in features.items()]
    for row, plane, angle in zip(model.planes, boat.vehicle.planes, inputs, strict=False):
        made += _plane(row, plane.name, angle)
    return made


def _attitude() -> list[Node]:
    """The vertical in body axes: -sin theta, cos theta sin phi, cos theta cos phi."""
    theta, phi = read("attitude/theta-rad"), read("attitude/phi-rad")
    level = node("cos", theta)
    parts = {
        "x": scaled(-1.0, node("sin", theta)),
        "y": node("product", level, node("sin", phi)),
        "z": node("product", level, node("cos", phi)),
    }
    return [function(f"{ROOT}/down-{k}", body) for k, body in parts.items()]


def _plane(row: Array, name: str, angle: str) -> list[Node]:
    """Speed V at a plane, its effective angle and its deflection, Eqs. (32)-(35)."""
    x, y, z, *lift = row
    motion = {k: read(feature(k)) for k in _MOTIONS}
    flow = [
        total(motion["u"], scaled(z, motion["q"]), scaled(-y, motion["r"])),
        total(motion["v"], scaled(x, motion["r"]), scaled(-z, motion["p"])),
        total(motion["w"], scaled(y, motion["p"]), scaled(-x, motion["q"])),
    ]
    through = [f"{ROOT}/flow/{plain(name)}-{k}" for k in "xyz"]
    made = [function(p, body) for p, body in zip(through, flow, strict=True)]
    squares = [node("product", read(p), read(p)) for p in through]
    speed = plane_feature(name, "V")
    made.append(function(speed, node("pow", total(*squares), value(0.5))))
    across = total(*(scaled(-f, read(p)) for f, p in zip(lift, through, strict=True)))
    moving = node("gt", read(speed), value(0.0))
    incidence = node("ifthen", moving, arcsine(node("quotient", across, read(speed))), value(0.0))
    made.append(function(plane_feature(name, "delta"), total(read(angle), incidence)))
    made.append(function(plane_feature(name, "deflection"), read(angle)))
    return made


def _loads(boat: Boat, environment: Environment, members: list[Coefficient]) -> list[Node]:
    """One function a coefficient, then the sums to X Y Z K M N, thrust less its deduction in X."""
    vehicle = boat.vehicle
    scales = (environment.density, vehicle.particulars.length.value, vehicle.diameter)
    names = named([f"{c.term.name}-{c.part}" for c in members])
    made: list[Node] = []
    sums: dict[str, list[Node]] = {k: [] for k in (*OUTPUTS, "thrust", "deduction")}
    for c in members:
        name = f"{ROOT}/load/{names[f'{c.term.name}-{c.part}']}"

        def at(factor: str, part: str = c.part) -> str:
            return plane_feature(part, factor) if factor in PLANE_FEATURES else feature(factor)

        nodes = [extended for extended, _ in c.table.extension]
        coefficient = look_up(np.asarray(c.table.grid(c.values)), nodes, c.table.rules, [at(a) for a in c.term.axes])
        scale = c.term.sign * c.term.scale(*scales) if c.term.output else 1.0
        body = node("product", value(scale), coefficient, *(read(at(f)) for f in c.term.factors))
        load = c.term.output or "no load"
        made.append(function(name, body, f"{c.term.name} of {c.part}: {load} = {c.term.multiplier or '1'} x C, SI"))
        kind = {"KT": "thrust", "t": "deduction"}.get(c.term.name, c.term.output)
        sums[kind].append(read(name))
    thrust, deduction = f"{ROOT}/load/thrust", f"{ROOT}/load/deduction"
    made += [function(thrust, total(*sums["thrust"])), function(deduction, total(*sums["deduction"]))]
    left = node("difference", value(1.0), read(deduction))
    sums["X"].append(node("product", left, read(thrust)))
    made += [function(f"{ROOT}/{o}-water", total(*sums[o]), "hydrodynamic load, N or N m") for o in OUTPUTS]
    return made


def _crossed(a: list[Node], b: list[Node]) -> list[Node]:
    """A cross product."""
    turns = ((1, 2), (2, 0), (0, 1))
    return [node("difference", node("product", a[i], b[j]), node("product", a[j], b[i])) for i, j in turns]


def _motion(model: Model, environment: Environment) -> list[Node]:
    """What JSBSim adds by itself, weight and rotation; buoyancy; and the acceleration of the boat with its water."""
    rigid, inverse = model.mass_matrix - model.added_mass, model.inverse_mass
    mass, centre, below = model.mass, model.r_g, model.r_b
    lift, inertia = model.buoyancy / environment.gravity, rigid[3:, 3:]
    down = [read(f"{ROOT}/down-{k}") for k in "xyz"]
    gravity = f"{ROOT}/gravity-mps2"
    made = [function(gravity, scaled(_FOOT, read("accelerations/gravity-ft_sec2")))]
    velocity, omega = ([read(feature(k)) for k in some] for some in ("uvw", "pqr"))
    swing = [f"{ROOT}/swing-{k}" for k in "xyz"]
    made += [function(name, body) for name, body in zip(swing, _crossed(omega, velocity), strict=True)]
    turned = _crossed(omega, _crossed(omega, [value(f) for f in centre]))
    spun = [total(*(scaled(f, w) for f, w in zip(row, omega, strict=True))) for row in inertia]
    rotation = [scaled(-mass, total(read(s), t)) for s, t in zip(swing, turned, strict=True)]
    lever = mass * cross_matrix(centre)
    about = [total(*(scaled(f, read(s)) for f, s in zip(row, swing, strict=True))) for row in lever]
    rotation += [scaled(-1.0, total(g, a)) for g, a in zip(_crossed(omega, spun), about, strict=True)]
    weight = [scaled(mass, d) for d in down] + _crossed([value(mass * f) for f in centre], down)
    buoyancy = [scaled(-lift, d) for d in down] + _crossed([value(-lift * f) for f in below], down)
    for o, w, b, turning in zip(OUTPUTS, weight, buoyancy, rotation, strict=True):
        by_body = total(node("product", read(gravity), w), turning)
        made.append(function(f"{ROOT}/{o}-body", by_body, "weight and rotation, which JSBSim has itself"))
        made.append(function(f"{ROOT}/{o}-buoyancy", node("product", read(gravity), b)))
    for k, row in zip(_MOTIONS, inverse, strict=True):
        parts = [
            scaled(f, total(*(read(f"{ROOT}/{o}-{kind}") for kind in ("water", "body", "buoyancy"))))
            for f, o in zip(row, OUTPUTS, strict=True)
            if f
        ]
        made.append(function(f"{ROOT}/{k}dot", total(*parts), "of the body origin, body axes"))
    for o, row in zip(OUTPUTS, rigid, strict=True):
        needed = total(*(scaled(f, read(f"{ROOT}/{k}dot")) for f, k in zip(row, _MOTIONS, strict=True) if f))
        made.append(function(f"{ROOT}/{o}-reaction", node("difference", needed, read(f"{ROOT}/{o}-body"))))
    return made


def _applied(model: Model) -> list[Node]:
    """The reaction at the centre of gravity: three forces, three moments."""
    x, y, z = centre = model.r_g
    reaction = {o: read(f"{ROOT}/{o}-reaction") for o in OUTPUTS}
    # N_G = N_O - r_G x F.
    arms = {"K": (("Z", -y), ("Y", z)), "M": (("X", -z), ("Z", x)), "N": (("Y", -x), ("X", y))}
    made = []
    for k, o in enumerate("XYZ"):
        force = function(f"{ROOT}/{o}-applied-lbs", scaled(_NEWTON, reaction[o]))
        parts = [force, _triple("location", centre, unit="M"), _direction(k)]
        made.append(node("force", *parts, name=f"water-{o}", frame="BODY"))
    for k, o in enumerate("KMN"):
        body = total(reaction[o], *(scaled(f, reaction[name]) for name, f in arms[o] if f))
        moment = function(f"{ROOT}/{o}-applied-lbsft", scaled(_NEWTON / _FOOT, body))
        made.append(node("moment", moment, _direction(k), name=f"water-{o}", frame="BODY"))
    return made


def _direction(k: int) -> Node:
    parts = [node(name, text="1" if i == k else "0") for i, name in enumerate("xyz")]
    return node("direction", *parts)
