"""Dictionaries of a case as plain data: schemes, solution, fields, function objects, sources, motion."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.cfd.motions import Motion
from ident.cfd.template import Template, settings

Array = NDArray[np.float64]
Entries = dict[str, Any]


def vector(values: Array) -> list[float]:
    """Three plain numbers, no minus zero."""
    return [float(v) + 0.0 for v in values]


def application(motion: Motion) -> str:
    """The solver: SIMPLE where the flow is steady, PIMPLE else, with a moving mesh or without."""
    return "simpleFoam" if motion.steady else "pimpleFoam"


def time_steps(template: Template, motion: Motion, wall: float) -> int:
    """Time steps of an unsteady run: ``courant`` cells of the wall each, but for the least number.

    Parameters
    ----------
    template : For ``courant``.
    motion : Its greatest speed and duration.
    wall : Length of a cell on the wall [m].
    """
    stated = settings()
    least = stated["least_steps"]
    if motion.oscillates:
        least = stated["least_steps_a_period"] * round(motion.duration * motion.frequency)
    return max(int(least), math.ceil(motion.fastest * motion.duration / (template.unsteady.courant * wall)))


def control(template: Template, motion: Motion, parts: dict[str, list[str]], centre: Array, wall: float) -> Entries:
    """``system/controlDict`` with a function object ``forces_<part>`` for every part, and the residuals.

    Parameters
    ----------
    template : Iterations and steps.
    motion : What the case does.
    parts : Part -> patches.
    centre : Moment point in mesh axes [m].
    wall : Length of a cell on the wall, for the time step [m].
    """
    steady = template.steady
    end = float(steady.iterations) if motion.steady else motion.duration
    steps = 1 if motion.steady else time_steps(template, motion, wall)
    step = 1.0 if motion.steady else motion.duration / steps
    functions: Entries = {
        f"forces_{part}": {
            "type": "forces",
            "libs": ['"libforces.so"'],
            "writeControl": "timeStep",
            "writeInterval": 1,
            "log": False,
            "patches": patches,
            "p": "p",
            "U": "U",
            "rho": "rhoInf",
            "rhoInf": 1.0,
            "CofR": vector(centre),
        }
        for part, patches in parts.items()
    }
    functions["residuals"] = {
        "type": "solverInfo",
        "libs": ['"libutilityFunctionObjects.so"'],
        "fields": ["U", "p", *_turbulent(template)],
    }
    return {
        "application": application(motion),
        "startFrom": "latestTime",
        "startTime": 0,
        "stopAt": "endTime",
        "endTime": int(end) if motion.steady else end,
        "deltaT": 1 if motion.steady else step,
        "writeControl": "timeStep",
        "writeInterval": steady.iterations if motion.steady else steps,
        "purgeWrite": 2,
        "writeFormat": "binary",
        "writePrecision": 10,
        "writeCompression": False,
        "timeFormat": "general",
        "timePrecision": 12,
        "runTimeModifiable": False,
        "functions": functions,
    }


def _turbulent(template: Template) -> list[str]:
    return ["k", "omega"] if template.flow.turbulence == "kOmegaSST" else []


def schemes(motion: Motion) -> Entries:
    """``system/fvSchemes``: second order in space; in time of first order, which an impulsive start asks for."""
    upwind = ("bounded", "Gauss", "linearUpwind", "grad(U)") if motion.steady else ("Gauss", "linearUpwind", "grad(U)")
    limited = ("bounded", "Gauss", "limitedLinear", 1) if motion.steady else ("Gauss", "limitedLinear", 1)
    return {
        "ddtSchemes": {"default": "steadyState" if motion.steady else "Euler"},
        "gradSchemes": {"default": ("cellLimited", "Gauss", "linear", 1)},
        "divSchemes": {
            "default": "none",
            "div(phi,U)": upwind,
            "div(phi,k)": limited,
            "div(phi,omega)": limited,
            "div((nuEff*dev2(T(grad(U)))))": ("Gauss", "linear"),
        },
        "laplacianSchemes": {"default": ("Gauss", "linear", "limited", 0.5)},
        "interpolationSchemes": {"default": "linear"},
        "snGradSchemes": {"default": ("limited", 0.5)},
        "wallDist": {"method": "meshWave"},
    }


def solution(template: Template, motion: Motion) -> Entries:
    """``system/fvSolution``: consistent SIMPLE, or PIMPLE."""
    stated = settings()
    sweep = {"solver": "smoothSolver", "smoother": "symGaussSeidel", "tolerance": 1e-9, "relTol": 0.05}
    pressure = {"solver": "GAMG", "smoother": "GaussSeidel", "tolerance": 1e-9, "relTol": 0.02}
    if motion.steady:
        fields = '"(U|k|omega)"'
        return {
            "solvers": {"p": pressure, fields: sweep},
            "SIMPLE": {
                "consistent": True,
                "nNonOrthogonalCorrectors": 1,
                "pRefCell": 0,
                "pRefValue": 0,
            },
            "relaxationFactors": {"equations": {fields: stated["relax_u"], "p": stated["relax_p"]}},
        }
    return {
        "solvers": {
            '"(p|pcorr)"': pressure,
            '"(p|pcorr)Final"': {**pressure, "relTol": 0},
            '"(U|k|omega)"': sweep,
            '"(U|k|omega)Final"': {**sweep, "relTol": 0},
        },
        "PIMPLE": {
            "nOuterCorrectors": int(stated["outer"]),
            "nCorrectors": int(stated["correctors"]),
            "nNonOrthogonalCorrectors": 1,
            "pRefCell": 0,
            "pRefValue": 0,
            "correctPhi": False,
        },
        "relaxationFactors": {"equations": {'".*"': 1}},
    }


def fields(template: Template, motion: Motion, walls: list[str], surface: bool, speed: float, length: float) -> Entries:
    """Files of the start: name -> (dimensions, entries).

    Parameters
    ----------
    template : Fluid and flow.
    motion : What the case does.
    walls : Patches of the boat.
    surface : Whether there is a plane of symmetry at the water's surface.
    speed, length : Of the flow and the boat, for the turbulence of the inflow [m/s, m].
    """
    kind = template.flow.turbulence
    moving = motion.kind == "moving"
    rest = "movingWallVelocity" if moving else "slip" if kind == "inviscid" else "noSlip"
    if moving and kind == "inviscid":
        rest = "slip"
    wall: Entries = {"type": rest} if rest in ("slip", "noSlip") else {"type": rest, "value": [0.0, 0.0, 0.0]}
    far = vector(motion.far)
    start = [0.0, 0.0, 0.0] if motion.kind == "accelerated" else far
    velocity = {**_of(walls, wall), "far": _far_velocity(motion, far, start)}
    pressure = {**_of(walls, {"type": "zeroGradient"}), "far": _far_pressure(motion)}
    out: Entries = {
        "U": ((0, 1, -1), start, velocity),
        "p": ((0, 2, -2), 0.0, pressure),
    }
    if kind == "kOmegaSST":
        stated, nu = settings(), template.fluid.kinematic_viscosity_m2ps
        intensity = template.flow.intensity or stated["intensity"]
        k = 1.5 * (intensity * speed) ** 2
        nut = (template.flow.viscosity_ratio or stated["viscosity_ratio"]) * nu
        omega = k / nut
        for name, dims, value, kind_of_wall in (
            ("k", (0, 2, -2), k, "kqRWallFunction"),
            ("omega", (0, 0, -1), omega, "omegaWallFunction"),
            ("nut", (0, 2, -1), nut, "nutkWallFunction"),
        ):
            outside = (
                {"type": "calculated", "value": value}
                if name == "nut"
                else {"type": "inletOutlet", "inletValue": value, "value": value}
            )
            # Wall functions of nut start from none.
            own_wall = {"type": kind_of_wall, "value": 0.0 if name == "nut" else value}
            out[name] = (dims, value, {**_of(walls, own_wall), "far": outside})
    if surface:
        for _, _, patches in out.values():
            patches["surface"] = {"type": "symmetryPlane"}
    return out


def _of(walls: list[str], entry: Entries) -> Entries:
    return {name: dict(entry) for name in walls}


def _far_velocity(motion: Motion, far: list[float], start: list[float]) -> Entries:
    """The velocity far away: that of the water where it comes in; all around in an accelerated case."""
    if motion.kind == "accelerated":
        ramp = [[0.0, [0.0, 0.0, 0.0]], [motion.duration, far]]
        return {"type": "uniformFixedValue", "uniformValue": ("table", ramp), "value": start}
    if motion.kind in ("inflow", "propelled"):
        return {"type": "freestreamVelocity", "freestreamValue": far, "value": far}
    return {"type": "inletOutlet", "inletValue": far, "value": far}


def _far_pressure(motion: Motion) -> Entries:
    if motion.kind == "accelerated":
        return {"type": "zeroGradient"}
    if motion.kind in ("inflow", "propelled"):
        return {"type": "freestreamPressure", "freestreamValue": 0.0, "value": 0.0}
    if motion.kind == "moving":
        return {"type": "fixedValue", "value": 0.0}
    return {"type": "outletInlet", "outletValue": 0.0, "value": 0.0}


def turbulence(template: Template) -> Entries:
    """``constant/turbulenceProperties``."""
    if template.flow.turbulence != "kOmegaSST":
        return {"simulationType": "laminar"}
    return {"simulationType": "RAS", "RAS": {"RASModel": "kOmegaSST", "turbulence": True, "printCoeffs": True}}


def transport(template: Template) -> Entries:
    """``constant/transportProperties``; without viscosity at all where the flow is inviscid."""
    nu = 0.0 if template.flow.turbulence == "inviscid" else template.fluid.kinematic_viscosity_m2ps
    return {"transportModel": "Newtonian", "nu": nu}


def rotating_frame(motion: Motion) -> Entries:
    """``constant/MRFProperties``: all cells turn with the body, velocities are those at rest.

    Velocities at rest in axes that turn at w(t) obey du/dt + div(u_rel u) + w x u = -grad p, whether w is
    constant or not: no Euler term is left, and p has nothing of the turning in it.
    """
    axis, omega = motion.rate, float(np.linalg.norm(motion.rate))
    rate: Any = omega
    if motion.kind == "spun":
        name, value = motion.acceleration
        axis, omega = np.eye(3)[("pdot", "qdot", "rdot").index(name)], 1.0
        rate = ("table", [[t, value * t] for t in (0.0, 2.0 * motion.duration)])
        if motion.oscillates:
            rate = ("table", swing(motion))
    return {
        "frame": {
            "cellZone": "water",
            "active": True,
            "nonRotatingPatches": ["far"],
            "origin": vector(motion.centre),
            "axis": vector(axis / omega),
            "omega": rate,
        }
    }


def sources(motion: Motion, disc_volume: float = 0.0) -> Entries:
    """``constant/fvOptions``: minus the acceleration in accelerated axes, or the thrust in the disc.

    In axes that accelerate by a, du/dt = -grad p - a holds with p as it is in axes at rest: the load has no
    buoyancy of the acceleration in it.
    """
    if motion.kind == "accelerated":
        name, value = motion.acceleration
        axis = np.eye(3)[("udot", "vdot", "wdot").index(name)]
        return {"acceleration": _momentum("all", None, "specific", -value * axis)}
    # The disc pushes the water aft.
    return {"disc": _momentum("cellZone", "disc", "absolute", -motion.thrust * np.array([1.0, 0.0, 0.0]))}


def _momentum(mode: str, zone: str | None, volume: str, value: Array) -> Entries:
    inner: Entries = {"selectionMode": mode}
    if zone:
        inner["cellZone"] = zone
    inner |= {"volumeMode": volume, "injectionRateSuSp": {"U": [vector(value), 0]}}
    return {"type": "vectorSemiImplicitSource", "active": True, **inner}


def swing(motion: Motion, steps: int = 100) -> list[list[float]]:
    """Rows (time, rate) of a displacement A sin(w t), ``steps`` a period and one period more than the run has."""
    omega = 2.0 * math.pi * motion.frequency
    periods = round(motion.duration * motion.frequency) + 1
    times = np.arange(periods * steps + 1) / (steps * motion.frequency)
    return [[float(t), float(motion.amplitude * omega * math.cos(omega * t))] for t in times]


def moving_mesh(motion: Motion) -> Entries:
    """``constant/dynamicMeshDict``: the whole mesh is carried along with a body that oscillates along an axis."""
    axis = np.eye(3)[("udot", "vdot", "wdot").index(motion.acceleration[0])]
    omega = 2.0 * math.pi * motion.frequency
    inner: Entries = {"amplitude": vector(motion.amplitude * axis), "omega": omega}
    return {
        "dynamicFvMesh": "dynamicMotionSolverFvMesh",
        "motionSolverLibs": ["fvMotionSolvers"],
        "motionSolver": "solidBody",
        "solidBodyMotionFunction": "oscillatingLinearMotion",
        "oscillatingLinearMotionCoeffs": inner,
    }
