"""How a run of the matrix is made in a case: inflow, rotating frame, source term or moving mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.axes import from_flow
from ident.captive.source import MOTIONS
from ident.cfd.template import Template
from sim.boat.forces import body_velocity
from sim.files.errors import InputError

Array = NDArray[np.float64]
# Rates and angles below this are none.
_NOTHING = 1e-12
_ACCELERATIONS = ("udot", "vdot", "wdot", "pdot", "qdot", "rdot")
# The acceleration of each -> the motion that makes it.
_MOTION_OF = {acceleration: motion for motion, (_, acceleration) in MOTIONS.items()}
# Tests whose loads need a turning propeller.
UNWRITTEN = {"propeller_side_force": "a turning propeller in a turning flow; these cases have a hull alone"}


@dataclass(frozen=True)
class Motion:
    """What a case does, in mesh axes [SI, the surface's scale].

    Attributes
    ----------
    kind : ``inflow``, ``rotating`` (frame), ``accelerated`` (source term), ``spun`` (frame whose rate changes),
        ``moving`` (mesh), ``propelled``.
    far : Velocity of the water far away; of an accelerated case at the end of the run.
    rate, centre : Angular velocity of the rotating frame, and a point on its axis.
    acceleration : Which of ``udot`` .. ``rdot``, and its value.
    duration : Of an unsteady run.
    oscillates : Whether a moving mesh swings, with ``amplitude`` and ``frequency``.
    turn : From the body's axes to the mesh's; identity where the mesh is fixed in the body.
    thrust : Of an actuator disc over the density, along the body's x.
    fastest : Greatest speed of a point of the body in an unsteady run [m/s].
    """

    kind: str
    far: Array = field(default_factory=lambda: np.zeros(3))
    rate: Array = field(default_factory=lambda: np.zeros(3))
    centre: Array = field(default_factory=lambda: np.zeros(3))
    acceleration: tuple[str, float] = ("", 0.0)
    duration: float = 0.0
    oscillates: bool = False
    amplitude: float = 0.0
    frequency: float = 0.0
    turn: Array = field(default_factory=lambda: np.eye(3))
    thrust: float = 0.0
    fastest: float = 0.0

    @property
    def steady(self) -> bool:
        """Whether the flow is steady in the axes of the mesh."""
        return self.kind in ("inflow", "rotating", "propelled")

    @property
    def speed(self) -> float:
        """A speed of the flow past the hull, for turbulence and scales [m/s]."""
        return float(np.linalg.norm(self.far))


def screw(velocity: Array, rate: Array) -> tuple[Array, Array]:
    """The steady motion of a rigid body as a rotation about an axis and a slide along it.

    A body whose origin has velocity V while it turns at w moves as V_par + w x (r - c): V_par is the part
    of V along w, and c = w x V / w^2 is a point on the axis (Chasles). The flow past it is steady in axes that
    turn with the body about c, with the water at -V_par far away.

    Parameters
    ----------
    velocity : (3,) of the origin, body axes [m/s].
    rate : (3,) [rad/s], not zero.

    Returns
    -------
    along : (3,) V_par [m/s].
    centre : (3,) c [m].

    Examples
    --------
    >>> import numpy as np
    >>> along, centre = screw(np.array([2.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.5]))
    >>> along.tolist(), centre.tolist()
    ([0.0, 0.0, 0.0], [0.0, 4.0, 0.0])
    """
    square = float(rate @ rate)
    along = (velocity @ rate) / square * rate
    return along + 0.0, np.cross(rate, velocity) / square + 0.0


def motion_of(run: pd.Series, template: Template, length: float, where: str) -> Motion:
    """How a run is made.

    Parameters
    ----------
    run : Program frame, SI and radians, at the surface's scale.
    template : For the free surface, and how accelerations are made.
    length : Of the surface [m].
    where : Run and test, for the error.

    Returns
    -------
    Motion

    Raises
    ------
    InputError
        For a motion that a case cannot be steady in: several accelerations at a time, one at speed, or a
        motion that does not keep its distance from a free surface.
    """
    state = {
        k: float(run[k]) if run[k] == run[k] else 0.0 for k in ("U", "alpha", "beta", "p", "q", "r", *_ACCELERATIONS)
    }
    velocity = np.array(body_velocity(state["U"], state["alpha"], state["beta"]))
    rate = np.array([state["p"], state["q"], state["r"]])
    driven = [k for k in _ACCELERATIONS if abs(state[k]) > _NOTHING]
    if driven and (len(driven) > 1 or state["U"] > _NOTHING or np.abs(rate).max() > _NOTHING):
        wrong = " ".join([*driven, *(["at speed"] if state["U"] > _NOTHING else [])])
        raise InputError(where, wrong, "one acceleration at a time, without speed and rates")
    double = template.flow.free_surface == "double_body"
    if driven:
        return _accelerated(driven[0], state[driven[0]], template, length, where, double)
    if np.abs(rate).max() > _NOTHING:
        along, centre = screw(velocity, rate)
        if double and (np.abs(rate[:2]).max() > _NOTHING or abs(velocity[2]) > _NOTHING):
            text = "yaw alone in the plane of the surface: free_surface = 'none' for roll and pitch"
            raise InputError(where, "a turn that does not keep its distance from the surface", text)
        return Motion("rotating", far=-along, rate=rate, centre=centre)
    if double and abs(state["alpha"]) > _NOTHING:
        # The surface is parallel to the way the boat goes, to which the boat stands at its angles.
        turn = from_flow(np.array([state["alpha"]]), np.array([state["beta"]]))[0].T
        return Motion("inflow", far=-(turn @ velocity), turn=turn)
    return Motion("inflow", far=-velocity)


def _accelerated(name: str, value: float, template: Template, length: float, where: str, double: bool) -> Motion:
    """A constant acceleration from rest, or the oscillation with it as its amplitude."""
    unsteady = template.unsteady
    angular = name in ("pdot", "qdot", "rdot")
    travel = unsteady.travel if angular else unsteady.travel * length
    flat = name in ("udot", "vdot", "rdot")
    if unsteady.kind == "oscillation":
        if double and not flat:
            raise InputError(
                where, f"an oscillation of {_MOTION_OF[name]} near the surface", "free_surface = 'none' for it"
            )
        omega = math.sqrt(abs(value) / travel)
        return Motion(
            "spun" if angular else "moving",
            acceleration=(name, value),
            duration=(unsteady.periods or 3) * 2.0 * math.pi / omega,
            oscillates=True,
            amplitude=travel,
            fastest=omega * travel * (0.5 * length if angular else 1.0),
            frequency=omega / (2.0 * math.pi),
        )
    if double and not flat:
        raise InputError(where, f"{name} near the surface", "accelerations along it alone, or free_surface = 'none'")
    duration = math.sqrt(2.0 * travel / abs(value))
    fastest = abs(value) * duration * (0.5 * length if angular else 1.0)
    if angular:
        return Motion("spun", acceleration=(name, value), duration=duration, fastest=fastest)
    axis = np.eye(3)[("udot", "vdot", "wdot").index(name)]
    return Motion(
        "accelerated", far=-value * duration * axis, acceleration=(name, value), duration=duration, fastest=fastest
    )


def motion_word(name: str) -> str:
    """The oscillation that makes an acceleration: ``sway`` for ``vdot``."""
    return _MOTION_OF[name]
