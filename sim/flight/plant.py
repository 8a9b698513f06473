"""A boat to be stepped from outside: your own controller, the simulator's boat, actuators and water."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.boat.coefficients import Coefficients
from sim.boat.database import read_rows
from sim.boat.state import Z
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight import maneuver, orders
from sim.flight.case import Case, load_case
from sim.flight.commands import Commands, PlaneCommand, SpeedCommand
from sim.flight.craft import Craft
from sim.flight.simulate import begun, columns_of, uses_tanks
from sim.flight.simulation import TANKS
from sim.kernel.assemble import without_thrust
from sim.kernel.layout import OUTSIDE, Model, workspace
from sim.waves.in_waves import phases_of, surroundings, with_phases

Array = NDArray[np.float64]

# Times closer than this share of a sample are one.
_CLOSE = 1e-9
COMMANDS = ("dV", "dH", "n", *TANKS)


def _open_loop(case: Case) -> Case:
    """The case without its own control and the events that end it; what the tanks hold stays."""
    fixed = PlaneCommand(law="fixed")
    commands = Commands(
        dV=fixed,
        dH=fixed,
        n=SpeedCommand(law="fixed", limits_rps=case.command.n.limits_rps),
        ballast=case.command.ballast,
        trim_tank=case.command.trim_tank,
    )
    return case.model_copy(update={"command": commands, "run": case.run.model_copy(update={"stop": []})})


def _given(name: str, values: ArrayLike | None, default: Array) -> Array:
    """A copy of values, of the default's shape."""
    given = np.array(default if values is None else values, dtype=float)
    if given.shape != default.shape or not np.isfinite(given).all():
        raise InputError(f"plant, {name}", f"{np.shape(given)} {given.tolist()}", f"{default.size} finite numbers")
    return given


class Plant:
    """A boat that moves by your commands, a control sample at a time.

    Commands go through the mixer, Eq. (1), and the actuators: planes, revolutions and tanks
    move at their rates within their limits, as in every simulated maneuver. Frame x forward, y
    starboard, z down; SI and radians.

    Parameters
    ----------
    case : Initial state, water, waves, and step; its own control and events are left out.
    coefficients : Of the vehicle.

    Attributes
    ----------
    dt : Control sample and integration step [s].
    time : Now [s].
    commands : dV, dH [rad], n [1/s] and, with tanks, ballast [kg] and trim_tank [m] as last given.
    trim : The equilibrium it starts from, ``sim.flight.trim.Trim``, or None.

    Raises
    ------
    InputError
        As ``sim.flight.craft.Craft.model`` and ``water``.
    sim.flight.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.

    Examples
    --------
    >>> import math
    >>> import ident
    >>> boat = ident.Plant.from_database("my-boat/zigzag.toml", "coeff_db")
    >>> while boat.time < 60.0:  # hold the course 10 degrees to starboard
    ...     _ = boat.step(dH=1.5 * (math.radians(10.0) - boat["psi"]) - 6.0 * boat["r"])
    >>> round(math.degrees(boat["psi"]))
    10
    """

    def __init__(self, case: Case, coefficients: Coefficients) -> None:
        self.vehicle, self.dt = coefficients.vehicle, case.run.step_s
        craft, case = Craft(coefficients), _open_loop(case)
        self._water, model = craft.water(case), craft.model(case)
        self._model, self._start, self._moved, self.trim, self._settings = begun(case, self.vehicle, model)
        # What is broken: angles at which planes are stuck [rad], and the model of the whole boat.
        self._stuck: dict[int, float] = {}
        self._whole = self._model
        self._columns = columns_of(self.vehicle, uses_tanks(case))[1:-2]
        self.reset()

    @classmethod
    def from_database(
        cls, case: str | Path, db: str | Path, version: int | None = None, vehicle: str | Path | None = None
    ) -> Plant:
        """A boat of a database version in a bundled case or a case file.

        Parameters
        ----------
        case : Bundled name or path.
        db, version : Database, and version, latest when None.
        vehicle : Bundled name or vehicle file, instead of the case's.

        Raises
        ------
        InputError
            For a case, vehicle, database or version that does not exist or fit.
        sim.flight.trim.NoEquilibrium
            When the case starts from self-propulsion and there is none.
        """
        data, where = load_case(case)
        boat = load_vehicle(vehicle) if vehicle else load_vehicle(data.vehicle, beside=where)
        return cls(data, Coefficients(boat, read_rows(str(db), version, boat.name)[0]))

    def reset(
        self, state: ArrayLike | None = None, controls: ArrayLike | None = None, phases: ArrayLike | None = None
    ) -> None:
        """Back to time zero and the commands of the start, without loads from outside; what is broken stays so.

        Parameters
        ----------
        state : (12,) to start from, that of the case when None; SI and radians.
        controls : Deflections [rad], n [1/s] and tanks as they are then, likewise; commands stay those of the case.
            Planes that are stuck are where they stuck, unless given here.
        phases : (components,) of the waves from now on [rad], that is another moment of the same sea; as they are when
            None.

        Raises
        ------
        InputError
            For another number of values, or one that is not finite; for phases in calm water.
        """
        if phases is not None:
            given = phases_of(self._water, phases)
            self._water = with_phases(self._water, given) if self._water else None
        # Start of the present control sample, and what is left of it.
        self._sample, self._left, self.time = 0.0, self.dt, 0.0
        y, moved = _given("state", state, self._start), _given("controls", controls, self._moved)
        for place, angle in self._stuck.items():
            moved[place] = moved[place] if controls is not None else angle
        around = surroundings(self._water, self._model.added_mass) if self._water else ()
        self._work = workspace(self._model, around)
        self._flight = maneuver.flight_of(self._model, self._settings, self._work, y, moved)
        planes = len(self.vehicle.planes)
        level = (self.trim.dV, self.trim.dH) if self.trim else (0.0, 0.0)
        self.commands = dict(zip(COMMANDS, (*level, *moved[planes:].tolist()), strict=False))
        self._rate = np.zeros(moved.size)
        for name in self.commands:
            self._give(name)
        for place in self._stuck:
            self._hold(place)

    @property
    def state(self) -> Array:
        """(12,) u v w p q r [m/s, rad/s], x y z [m], phi theta psi [rad]; its numbers may be changed."""
        return self._flight.y

    @property
    def controls(self) -> Array:
        """(planes + 1,) deflections [rad] and n [1/s] as they are; with tanks two more [kg, m]."""
        return self._flight.c

    @property
    def loads(self) -> Array:
        """(6,) X Y Z K M N from outside, body axes [N, N m]: a tow, a tether, a blast; its numbers may be changed."""
        return self._work.real[OUTSIDE : OUTSIDE + 6]

    def __getitem__(self, channel: str) -> float:
        """A channel as it is now, SI and radians.

        Parameters
        ----------
        channel : A state, a plane, n, ballast or trim_tank; ``t``, ``U`` and ``D0`` too.

        Raises
        ------
        KeyError
            Naming the channels there are.
        """
        values = dict(zip(self._columns, (*self.state, *self.controls), strict=True))
        values |= {"t": self.time, "U": float(np.linalg.norm(self.state[:3]))}
        values["D0"] = float(self.state[Z]) + self._model.sail_top
        if channel not in values:
            raise KeyError(f"{channel}; there are {', '.join(values)}")
        return float(values[channel])

    def step(self, steps: int = 1, **commands: float) -> Array:
        """Give commands and move on; commands that are not given stay as they are.

        Parameters
        ----------
        steps : Control samples of ``dt``, during which the commands stand.
        commands : ``dV``, ``dH`` [rad], ``n`` [1/s], ``ballast`` [kg], ``trim_tank`` [m].

        Returns
        -------
        (12,) a copy of the state after them.

        Raises
        ------
        InputError
            For a command that the boat does not have, that is not finite, or an angle beyond pi.
        FloatingPointError
            When the state leaves the finite numbers.
        """
        if steps < 1:
            raise InputError("plant, steps", f"{steps}", "one control sample or more")
        if self._left != self.dt:
            return self.advance(steps * self.dt, **commands)
        self._take(commands)
        end = maneuver.hold(self._flight, self._work.around, self._rate, self.dt, steps, self.time)
        if end != end:
            raise FloatingPointError(f"the state left the finite numbers after {self.time:.3f} s")
        self.time = self._sample = end
        return self.state.copy()

    def advance(self, seconds: float, **commands: float) -> Array:
        """Give commands and move on by a time that need not be a control sample.

        A sample in which a command changes is flown in parts; the actuators are, at its end, where they can be.

        Parameters
        ----------
        seconds : [s].
        commands : As for ``step``.

        Returns
        -------
        (12,) a copy of the state after it.

        Raises
        ------
        InputError, FloatingPointError
            As ``step``, and for a time that is not positive and finite.
        """
        if not (math.isfinite(seconds) and seconds > 0.0):
            raise InputError("plant, seconds", f"{seconds}", "a positive, finite number")
        self._take(commands)
        while seconds > _CLOSE * self.dt:
            ends = seconds > self._left - _CLOSE * self.dt
            part = self._left if ends else seconds
            if not maneuver.hold_for(self._flight, self._work.around, self._rate, self._left, part, self.time):
                raise FloatingPointError(f"the state left the finite numbers after {self.time:.3f} s")
            seconds -= part
            if ends:
                self._sample += self.dt
            self._left = self.dt if ends else self._left - part
            self.time = self._sample if ends else self._sample + (self.dt - self._left)
        return self.state.copy()

    def stick(self, plane: str, angle: float | None = None) -> None:
        """Let a plane stay where it is, or at an angle [rad], whatever is commanded.

        Raises
        ------
        InputError
            For a plane that the boat does not have, or an angle beyond its limit.
        """
        names = [p.name for p in self.vehicle.planes]
        if plane not in names:
            raise InputError(f"plant, plane {plane}", "no such plane of this boat", ", ".join(names))
        place = names.index(plane)
        if angle is not None:
            limit = float(self._settings.plane_limit[place])
            if not abs(angle) <= limit:
                raise InputError(f"plant, plane {plane}", f"an angle of {angle} rad", f"up to {limit:g} rad")
            self.controls[place] = angle
        self._stuck[place] = float(self.controls[place])
        self._hold(place)

    def lose_thrust(self, share: float) -> None:
        """Let the propeller lose a share of its thrust and torque, as without some of its blades.

        Raises
        ------
        InputError
            For a share that is not between 0 and 1.
        """
        if not 0.0 <= share <= 1.0:
            raise InputError("plant, lost thrust", f"{share}", "a share between 0 and 1")
        self._become(without_thrust(self._whole, share))

    def repair(self) -> None:
        """Planes move and the propeller pushes again."""
        self._stuck.clear()
        self._flight.g[:] = orders.flat(self._settings)[0]
        self._become(self._whole)

    def _become(self, model: Model) -> None:
        """Go on as another model of the same layout."""
        self._model = model
        self._flight = self._flight._replace(m=model.real, w=model.whole)

    def _hold(self, place: int) -> None:
        """Take a plane's rate from it."""
        self._flight.g[orders.PLANES + orders.PLANE * place + 3] = 0.0

    def _take(self, commands: dict[str, float]) -> None:
        for name, value in commands.items():
            self._check(name, value)
        for name, value in commands.items():
            self.commands[name] = float(value)
            self._give(name)

    def _check(self, name: str, value: float) -> None:
        if name not in self.commands:
            allowed = ", ".join(self.commands)
            hint = "" if len(self.commands) == len(COMMANDS) else "; tanks with [command.ballast] in the case"
            raise InputError(f"plant, command {name}", "no such command of this boat", allowed + hint)
        if not math.isfinite(value):
            raise InputError(f"plant, command {name}", f"{value}", "a finite number")
        if name in ("dV", "dH") and abs(value) > math.pi:
            raise InputError(f"plant, command {name}", f"{value:g}", "radians, between -pi and pi")

    def _give(self, name: str) -> None:
        """Hand a command on to the loop; revolutions stay within their limits."""
        value = self.commands[name]
        if name == "n":
            low, high = self._settings.n_limit
            value = min(max(value, low), high)
        self._flight.f[orders.COMMAND + COMMANDS.index(name)] = value
