"""The boat as a linear system with all its inputs, for the design of controllers.

x' = A x + B u, y = C x + D u, of small changes from straight level motion under self-propulsion. Unlike
the two plane models of ``ident.analysis.stability`` it is whole: all twelve states with their coupling, the
actuators, every plane, revolutions, ballast, and loads of waves or whatever else acts on the boat.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import OUTPUTS, STATES
from sim.boat.coefficients import Coefficients
from sim.boat.mass import Environment
from sim.files.errors import InputError
from sim.flight.plausible import within_limits
from sim.flight.simulate import mixer_of, plane_limits
from sim.flight.trim import NoEquilibrium, self_propulsion
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble, with_tanks
from sim.kernel.layout import Model, workspace

if TYPE_CHECKING:
    from control import StateSpace

Array = NDArray[np.float64]
# Steps of the central differences, as those of ``ident.analysis.stability``: in a state, in a deflection
# [rad], in revolutions [1/s], and in ballast as a share of the mass.
_STEP, _DEFLECTION, _REVOLUTIONS, _BALLAST = 1e-4, np.radians(1.0), 1e-3, 1e-5


@dataclass(frozen=True)
class StateSpaceModel:
    """A boat as a linear system.

    Attributes
    ----------
    states : ``u`` to ``psi``, then every actuator as it is (plane names, ``n_reached``); SI, radians.
    inputs : ``dV``, ``dH`` [rad] through the mixer, each plane beside them [rad], ``n`` [1/s], ``ballast`` [kg] of a
        boat with tanks, then loads ``X_wave`` to ``N_wave`` in body axes [N, N m].
    outputs : The twelve states.
    a, b, c, d : Matrices.
    about : Values of the states that x are the changes from.
    lag : Time constant of the actuators [s].

    Examples
    --------
    >>> import ident
    >>> (state,) = ident.stability("my-boat/zigzag.toml", db="coeff_db", speeds=[4.0])
    >>> model = state.state_space()
    >>> model.a.shape == (len(model.states), len(model.states))
    True
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    a: Array
    b: Array
    c: Array
    d: Array
    about: Array
    lag: float

    def to_ss(self) -> StateSpace:
        """The system for python-control (extra ``control``), states, inputs and outputs by name."""
        import control

        names = {"states": list(self.states), "inputs": list(self.inputs), "outputs": list(self.outputs)}
        return control.ss(self.a, self.b, self.c, self.d, **names)


def state_space(
    coefficients: Coefficients, environment: Environment, speed: float, depth: float, lag: float
) -> StateSpaceModel:
    """Linear system of a boat about self-propulsion.

    Parameters
    ----------
    coefficients, environment : The boat, and its water.
    speed, depth : U [m/s], D0 [m].
    lag : Time constant that stands for an actuator [s]. In the simulator a small command is reached within a
        control sample; limits and rates are not linear, and left out.

    Raises
    ------
    InputError
        Where there is no self-propulsion.
    """
    vehicle = coefficients.vehicle
    model = assemble(coefficients, environment)
    planes = len(vehicle.planes)
    where = f"stability, state space at {speed:g} m/s and {depth:g} m"
    if coefficients.get("KT") is None:
        raise InputError(
            where, f"{vehicle.name} has no propulsion data", "a boat with KT, for a state that it can hold"
        )
    try:
        trim = self_propulsion(model, mixer_of(vehicle), speed, depth, plane_limits(vehicle)[0])
        limits = vehicle.needed_propeller("self-propulsion").limits.value
        within_limits(float(trim.controls[planes]), limits, speed, depth)
    except NoEquilibrium as error:
        raise InputError(where, str(error), "a speed and depth that the boat can hold") from error
    tanks = vehicle.tanks is not None
    if tanks:
        model = with_tanks(model, vehicle)
    start = np.concatenate([trim.controls[: planes + 1], np.zeros(2 if tanks else 0)])
    a, by_control = _slopes(model, trim.state, start, planes)
    n, held = len(STATES), planes + 1
    whole = np.zeros((n + held, n + held))
    whole[:n, :n], whole[:n, n:] = a, by_control[:, :held]
    whole[n:, n:] = -np.eye(held) / lag
    mixer = np.vstack([mixer_of(vehicle), np.zeros((1, 2))])
    inputs = ["dV", "dH", *(p.name for p in vehicle.planes), "n", *(["ballast"] if tanks else [])]
    b = np.zeros((n + held, len(inputs) + len(OUTPUTS)))
    b[n:, :2], b[n:, 2 : 2 + held] = mixer / lag, np.eye(held) / lag
    if tanks:
        b[:n, 2 + held] = by_control[:, held]
    b[:6, len(inputs) :] = model.inverse_mass
    return StateSpaceModel(
        states=(*STATES, *(p.name for p in vehicle.planes), "n_reached"),
        inputs=(*inputs, *(f"{o}_wave" for o in OUTPUTS)),
        outputs=tuple(STATES),
        a=whole,
        b=b,
        c=np.eye(n, n + held),
        d=np.zeros((n, b.shape[1])),
        about=np.concatenate([trim.state, start[:held]]),
        lag=lag,
    )


def rate_change(model: Model, state: Array, controls: Array) -> Callable[[Array, Array], Array]:
    """Half the change of all twelve rates between a step forth and a step back, of states and of controls."""
    work = workspace(model)

    def change(to_state: Array, to_controls: Array) -> Array:
        side = []
        for sign in (1.0, -1.0):
            rate = np.zeros(12)
            kernel.rhs(model, state + sign * to_state, controls + sign * to_controls, work, rate)
            side.append(rate)
        return np.asarray(side[0] - side[1]) / 2.0

    return change


def _slopes(model: Model, state: Array, controls: Array, planes: int) -> tuple[Array, Array]:
    """Central differences of the right-hand side by states (12, 12) and by controls (12, k)."""
    change = rate_change(model, state, controls)
    none, still = np.zeros(12), np.zeros_like(controls)
    a = np.column_stack([change(_STEP * one, still) / _STEP for one in np.eye(12)])
    sizes = np.full(controls.size, _DEFLECTION)
    sizes[planes] = _REVOLUTIONS
    sizes[planes + 1 :] = _BALLAST * model.mass
    steps = np.eye(controls.size) * sizes
    b = np.column_stack([change(none, one) / size for one, size in zip(steps, sizes, strict=True)])
    return a, b
