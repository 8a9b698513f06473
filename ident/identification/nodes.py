"""Tabulated values as unknowns, port/starboard folded onto one side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sim.boat.catalogue import Term
from sim.boat.parts import Point, mirror_of
from sim.boat.vehicle import Vehicle


@dataclass
class Node:
    """One unknown tabulated value: coefficient, part, point, and the runs behind it.

    ``seen`` holds the (part, point) where runs stood: this one, its mirror image, or both.
    ``tests`` names the tests of its runs. ``worst`` is the largest disagreement among the runs, in standard errors,
    and ``worst_run`` the run that it is of.
    """

    name: str
    part: str
    point: Point
    runs: list[str] = field(default_factory=list)
    qualities: list[str] = field(default_factory=list)
    tests: set[str] = field(default_factory=set)
    worst: float = 0.0
    worst_run: str = ""
    seen: set[tuple[str, Point]] = field(default_factory=set)


def key_point(values: Sequence[float]) -> Point:
    """Axis values that compare equal however they were computed."""
    return tuple(float(f"{v:.12g}") + 0.0 for v in values)


def vanishes(term: Term, part: str, vehicle: Vehicle) -> bool:
    """True for a coefficient that port/starboard symmetry makes zero at every point."""
    mirror = mirror_of(term, part, vehicle)
    itself = (mirror.name, mirror.part) == (term.name, part)
    return itself and mirror.sign < 0 and min(mirror.axis_signs, default=1) > 0


def by_coefficient(nodes: Sequence[Node]) -> dict[tuple[str, str], list[int]]:
    """Numbers of the nodes of every coefficient and part, in order."""
    places: dict[tuple[str, str], list[int]] = {}
    for i, node in enumerate(nodes):
        places.setdefault((node.name, node.part), []).append(i)
    return places


def table_points(
    nodes: Sequence[Node],
    term: Term,
    part: str,
    vehicle: Vehicle,
    members: Mapping[tuple[str, str], list[int]] | None = None,
) -> tuple[list[Point], list[int], list[int]]:
    """Points at which a coefficient is known, from runs and by symmetry.

    Parameters
    ----------
    nodes : The values found.
    term, part, vehicle : The coefficient.
    members : ``by_coefficient`` of the nodes, where it is at hand.

    Returns
    -------
    points : Sorted.
    indices : Node of each point.
    signs : Coefficient = sign * node; 0 where symmetry makes it zero.
    """
    mirror = mirror_of(term, part, vehicle)
    members = members if members is not None else by_coefficient(nodes)
    points: dict[Point, tuple[int, int]] = {nodes[i].point: (i, 1) for i in members.get((term.name, part), [])}
    for i in members.get((mirror.name, mirror.part), []):
        # A mirror undoes itself, so its signs lead back as well.
        points.setdefault(mirror.point(nodes[i].point), (i, mirror.sign))
    flips = [k for k, s in enumerate(mirror.axis_signs) if s < 0]
    if flips and (mirror.name, mirror.part) == (term.name, part) and mirror.sign < 0:
        for point, (i, _) in list(points.items()):
            points.setdefault(tuple(0.0 if k in flips else x for k, x in enumerate(point)), (i, 0))
    places = sorted(points)
    return places, [points[p][0] for p in places], [points[p][1] for p in places]
