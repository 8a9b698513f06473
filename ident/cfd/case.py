"""What is known of one case: its run, how it is made, on which mesh and grids."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Case:
    """One run of the matrix.

    Attributes
    ----------
    run_id : Its name, and that of its folder.
    test, part : As in the plan.
    state : Quantities that are not blank, program frame, SI and radians, at the surface's scale.
    kind : How it is made, see ``Motion``.
    mesh : Name of its mesh.
    grids : Grids it is run on, finest first.
    axes : ``body``, or ``tank`` where body and mesh are turned against each other.
    frequency_hz, amplitude, duration : Of an unsteady run.
    iterations : Of a steady run, at most.
    towed : Of self-propulsion: run of the same state without the disc.
    thrust_n, thrust_source : Thrust of the disc [N], and where it comes from.
    """

    run_id: str
    test: str
    part: str
    state: dict[str, float]
    kind: str
    mesh: str
    grids: list[str]
    axes: str = "body"
    frequency_hz: float = 0.0
    amplitude: float = 0.0
    duration: float = 0.0
    iterations: int = 0
    towed: str = ""
    thrust_n: float = 0.0
    thrust_source: str = ""
