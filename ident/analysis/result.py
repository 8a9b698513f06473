"""What an analysis of stability gives: linear models, indices and eigenvalues, state by state."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

from ident.analysis.state_space import StateSpaceModel
from ident.output import html_table
from sim.files.errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    from control import StateSpace

_TABLED = (
    *("speed", "depth", "g_vertical", "g_horizontal", "neutral_point_vertical", "neutral_point_horizontal"),
    *("critical_speed_stern", "critical_speed_sail"),
)


@dataclass(frozen=True)
class Linear:
    """x' = A x + b c of small changes x from a steady state, and c from the command that holds it.

    Attributes
    ----------
    states : Names of x; m/s, rad/s, m and rad, x forward, y starboard, z down.
    command : dV or dH [rad], through the mixer; without the delay of the actuators.
    a, b : (n, n) and (n,).
    about : (n,) values of the states that x are the changes from.

    Examples
    --------
    >>> import ident
    >>> (state,) = ident.stability("my-boat/zigzag.toml", db="coeff_db", speeds=[5.0], depths=[40.0])
    >>> linear = state.linear["horizontal"]
    >>> linear.states, linear.command
    (('v', 'p', 'r', 'phi'), 'dH')
    """

    states: tuple[str, ...]
    command: str
    a: list[list[float]]
    b: list[float]
    about: list[float]


@dataclass(frozen=True)
class Stability:
    """Stability of straight level motion at one speed and depth.

    Attributes
    ----------
    speed, depth : U [m/s], D0 [m].
    g_vertical, g_horizontal : Stability indices Gv, Gh; positive is stable. None when the
        derivatives of that plane of motion are absent.
    neutral_point_vertical, neutral_point_horizontal : Where a cross force gives no turn,
        x of the neutral point over L, positive ahead of the origin; None as above.
    critical_speed_stern, critical_speed_sail : Speed [m/s] at which the planes no longer
        change the depth (reversal speed), of those aft of the origin and of those ahead; None when
        there is none.
    vertical, horizontal : Eigenvalues [1/s] of the motion about ``about``, real and imaginary
        part, least stable first; empty when there is no such state, or no added mass of
        that plane of motion.
    linear : The linear models these are of, vertical and horizontal, as far as there are any.
    about : ``self-propulsion``, or ``speed held``: straight and level with the planes at
        zero and without surge, for a vehicle without propulsion data.

    Examples
    --------
    >>> import ident
    >>> (state,) = ident.stability("my-boat/zigzag.toml", db="coeff_db", speeds=[5.0], depths=[40.0])
    >>> state.g_horizontal > 0.0, state.about
    (True, 'self-propulsion')
    """

    speed: float
    depth: float
    g_vertical: float | None
    g_horizontal: float | None
    neutral_point_vertical: float | None
    neutral_point_horizontal: float | None
    critical_speed_stern: float | None
    critical_speed_sail: float | None
    vertical: list[tuple[float, float]]
    horizontal: list[tuple[float, float]]
    linear: dict[str, Linear]
    about: str
    _whole: Callable[[], StateSpaceModel] | None = field(default=None, repr=False, compare=False)

    def to_dict(self) -> dict[str, Any]:
        """Plain data; eigenvalues as (real, imaginary), linear models as states, command, a, b, about."""
        plain = asdict(replace(self, _whole=None))
        del plain["_whole"]
        return plain

    def state_space(self) -> StateSpaceModel:
        """The boat as one linear system with all its states, actuators and inputs, about self-propulsion.

        Raises
        ------
        InputError
            Where there is no self-propulsion.
        """
        if self._whole is None:
            raise InputError("stability, state space", "a state on its own", "one of ident.stability(...)")
        return self._whole()

    def to_ss(self) -> StateSpace:
        """The same for python-control (extra ``control``): A, B, C, D with names."""
        return self.state_space().to_ss()


@dataclass(frozen=True)
class StabilityMap:
    """Stability of straight level motion over speeds and depths.

    Attributes
    ----------
    title : The vehicle's.
    version : Of the database.
    states : Depth by depth.

    Examples
    --------
    >>> import ident
    >>> states = ident.stability("my-boat/zigzag.toml", db="coeff_db", speeds=[3.0, 5.0], depths=[40.0])
    >>> states.table[["speed", "depth"]].values.tolist()
    [[3.0, 40.0], [5.0, 40.0]]
    """

    title: str
    version: int
    states: tuple[Stability, ...]

    def __len__(self) -> int:
        return len(self.states)

    def __iter__(self) -> Iterator[Stability]:
        return iter(self.states)

    @property
    def table(self) -> pd.DataFrame:
        """One row a state: speed, depth, indices, neutral points, critical speeds."""
        import pandas as pd

        return pd.DataFrame([{k: getattr(s, k) for k in _TABLED} for s in self.states], columns=list(_TABLED))

    def to_ss(self) -> StateSpace | tuple[StateSpace, ...]:
        """``to_ss()`` of the state, or of each in their order where there are several.

        Raises
        ------
        InputError
            Where there is no self-propulsion.
        """
        systems = tuple(s.to_ss() for s in self.states)
        return systems[0] if len(systems) == 1 else systems

    def to_dict(self) -> list[dict[str, Any]]:
        """``to_dict()`` of every state."""
        return [s.to_dict() for s in self.states]

    def __repr__(self) -> str:
        return f"StabilityMap({self.title}, version {self.version}: {len(self.states)} states)"

    def _repr_html_(self) -> str:
        rows = [["-" if x is None else f"{x:.4g}" for x in row] for row in self.table.itertuples(index=False)]
        return html_table(f"{self.title}, database version {self.version}", _TABLED, rows)
