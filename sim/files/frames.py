"""Body and earth frames, declared by the direction of each axis.

The program frame is SNAME (1950): x forward, y starboard, z down, with earth axes north,
east, down. A campaign, a vehicle or a reference declares its own directions. In a
right-handed frame a component along an axis and the rotation about it change sign
together; a left-handed frame has to say by which hand its moments and rates turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

DIRECTIONS = {
    "x": {"forward": 1, "aft": -1},
    "y": {"starboard": 1, "port": -1},
    "z": {"down": 1, "up": -1},
}

# Which body axis each quantity belongs to; quantities not listed do not turn.
COMPONENTS = {
    **dict.fromkeys(("x", "u", "u_over_U0", "udot", "X", "K", "p", "pdot", "phi"), "x"),
    **dict.fromkeys(("y", "v", "vdot", "Y", "M", "q", "qdot", "theta"), "y"),
    **dict.fromkeys(("z", "w", "wdot", "Z", "N", "r", "rdot", "psi", "dz", "dz_over_L0"), "z"),
}

# Rotations about an axis: they change sign once more when they turn by the left hand.
ROTATIONS = frozenset(("K", "M", "N", "p", "q", "r", "pdot", "qdot", "rdot", "phi", "theta", "psi"))
SENSES = ("right-hand", "left-hand")


class FrameError(ValueError):
    """A frame is not declared, or not one this program can turn."""


@dataclass(frozen=True)
class Frame:
    """Axis directions of a body frame.

    Attributes
    ----------
    x : ``forward`` or ``aft``.
    y : ``starboard`` or ``port``.
    z : ``down`` or ``up``.
    rotations : Hand by which moments, rates and Euler angles turn about their axis,
        ``right-hand`` or ``left-hand``; empty is ``right-hand``.

    Raises
    ------
    FrameError
        For an unknown direction, or a left-handed set that does not say how it turns.
    """

    x: str = "forward"
    y: str = "starboard"
    z: str = "down"
    rotations: str = ""

    def __post_init__(self) -> None:
        for axis, allowed in DIRECTIONS.items():
            direction = getattr(self, axis)
            if direction not in allowed:
                raise FrameError(f"frame axis {axis} = {direction!r}; allowed: {', '.join(allowed)}")
        if self.rotations not in ("", *SENSES):
            raise FrameError(f"frame rotations = {self.rotations!r}; allowed: {', '.join(SENSES)}")
        if self.signs["x"] * self.signs["y"] * self.signs["z"] < 0 and not self.rotations:
            raise FrameError(f"frame {self} is left-handed and does not say by which hand it turns")

    @cached_property
    def signs(self) -> dict[str, int]:
        """Sign of each axis against the program frame."""
        return {a: DIRECTIONS[a][getattr(self, a)] for a in DIRECTIONS}

    def sign(self, quantity: str) -> int:
        """Factor that turns ``quantity`` between this frame and the program frame.

        Parameters
        ----------
        quantity : A component such as ``X``, ``w``, ``r``, ``psi``; anything that has no
            direction (``U``, ``alpha``, ``beta``, ``D0``, ``t``) gives +1.
        """
        axis = COMPONENTS.get(quantity)
        hand = -1 if quantity in ROTATIONS and self.rotations == "left-hand" else 1
        return hand * self.signs[axis] if axis else 1

    def vector(self, values: list[float]) -> list[float]:
        """Turn a position or direction (x, y, z) to the program frame (or back)."""
        return [self.signs[a] * float(v) for a, v in zip("xyz", values, strict=True)]

    def __str__(self) -> str:
        return f"x {self.x}, y {self.y}, z {self.z}"


PROGRAM = Frame()
