"""Expressions of JSBSim's function language: arithmetic, features of the state, tables with their rules.

JSBSim's tables have up to three axes, hold their ends, and are linear in between. What the simulator's tables have
beyond that is written out: a fourth axis as a sum over its nodes with hat functions, and ends that go on as the held
table with a slope outside. Nothing of a table is lost.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from xml.etree import ElementTree as xml

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import BOAT_FEATURES, STILL

Array = NDArray[np.float64]
Node = xml.Element
_KEYS = ("row", "column", "table")
ROOT = "ident"


def node(tag: str, *children: Node, text: str = "", **attributes: str) -> Node:
    """An element with its children."""
    made = xml.Element(tag, attributes)
    made.text = text or None
    made.extend(children)
    return made


def value(x: float) -> Node:
    """A number, to the last digit."""
    return node("value", text=repr(float(x)))


def read(name: str) -> Node:
    """The value of a property."""
    return node("property", text=name)


def total(*parts: Node) -> Node:
    """A sum of any number of parts."""
    if len(parts) < 2:
        return parts[0] if parts else value(0.0)
    return node("sum", *parts)


def scaled(factor: float, part: Node) -> Node:
    """A number times an expression."""
    return node("product", value(factor), part)


def plain(name: str) -> str:
    """A name that a property may have."""
    spelled = name.replace("*", "star").replace("/", "-by-").replace("(", "-").replace(")", "")
    return re.sub(r"[^A-Za-z0-9_.-]", "_", re.sub(r"\|([^|]*)\|", r"abs-\1", spelled))


def feature(name: str) -> str:
    """The property of a factor or axis of the term table that belongs to the whole boat."""
    return f"{ROOT}/feature/{plain(name)}"


def plane_feature(plane: str, name: str) -> str:
    """The property of a factor or axis that belongs to one plane."""
    return f"{ROOT}/feature/{plain(plane)}-{plain(name)}"


def function(name: str, body: Node, said: str = "") -> Node:
    """A function whose value is a property."""
    made = node("function", body, name=name)
    if said:
        made.insert(0, node("description", text=said))
    return made


def _where(condition: Node, yes: Node, no: Node) -> Node:
    return node("ifthen", condition, yes, no)


def _over(x: str, y: str, limit: float) -> Node:
    """x / y, or zero where the size of y is not above a limit."""
    ratio = node("quotient", read(feature(x)), read(feature(y)))
    return _where(node("gt", node("abs", read(feature(y))), value(limit)), ratio, value(0.0))


def arcsine(sine: Node) -> Node:
    """asin, of -1 to 1."""
    return node("asin", node("min", value(1.0), node("max", value(-1.0), sine)))


def _sign(x: str) -> Node:
    of = read(feature(x))
    return node("difference", node("gt", of, value(0.0)), node("lt", of, value(0.0)))


def _root(*squared: str) -> Node:
    squares = [node("product", read(feature(x)), read(feature(x))) for x in squared]
    return node("pow", total(*squares), value(0.5))


def boat_features(depth: Node, advance: Node, revolutions: Node) -> dict[str, Node]:
    """Every feature of the whole boat but the motions u to r, in an order in which each rests on earlier ones.

    Parameters
    ----------
    depth, advance, revolutions : D0 [m], J and n [1/s].
    """
    made: dict[str, Node] = {f"|{x}|": node("abs", read(feature(x))) for x in "uvwpqr"}
    made |= {"U": _root("u", "v", "w"), "S": _root("v", "w"), "sgn(v)": _sign("v"), "sgn(w)": _sign("w")}
    made["alpha"] = node("atan2", read(feature("w")), read(feature("u")))
    made["v/U"], made["r/U"] = _over("v", "U", 0.0), _over("r", "U", 0.0)
    made["beta"] = arcsine(read(feature("v/U")))
    made |= {"D0": depth, "n": revolutions, "|n|": node("abs", read(feature("n"))), "J": advance}
    pairs = [*(a + b for a in "uvw" for b in "pqr"), "pq", "qr", "rp"]
    made |= {p: node("product", read(feature(p[0])), read(feature(p[1]))) for p in pairs}
    made |= {"v/r": _over("v", "r", STILL), "w/q": _over("w", "q", STILL)}
    return made


def known_features() -> frozenset[str]:
    """Features of the whole boat that there is an expression for."""
    return frozenset(boat_features(value(0.0), value(0.0), value(0.0))) | frozenset(BOAT_FEATURES[:6])


def look_up(grid: Array, nodes: Sequence[Array], rules: Sequence[str], properties: Sequence[str]) -> Node:
    """A table at the values of some properties.

    Parameters
    ----------
    grid : One dimension an axis. nodes : Values of each axis. rules : Beyond its ends.
    properties : Where each axis is met.

    Returns
    -------
    An expression equal to the multilinear look-up of the simulator.
    """
    kept = [k for k in range(grid.ndim) if grid.shape[k] > 1]
    grid = grid.reshape([grid.shape[k] for k in kept])
    axes = [(nodes[k], rules[k], properties[k]) for k in kept]
    return _open(grid, axes)


Axis = tuple[Array, str, str]


def _open(grid: Array, axes: list[Axis]) -> Node:
    """The table with the slopes of the first axis that goes on, the rest likewise."""
    held = [(nodes, "hold", name) for nodes, _, name in axes]
    outside: list[Node] = []
    for k, (nodes, rule, name) in enumerate(axes):
        rest = held[:k] + axes[k + 1 :]
        for end, inner, reach in ((0, 1, "min"), (-1, -2, "max")):
            beyond = _beyond(float(nodes[end]), float(nodes[inner]), rule, read(name), reach)
            if beyond is None:
                continue
            span, how_far = beyond
            slope = (np.take(grid, end, axis=k) - np.take(grid, inner, axis=k)) / span
            if slope.any():
                outside.append(node("product", how_far, _open(slope, rest)))
    return total(_held(grid, held), *outside)


def _beyond(end: float, inner: float, rule: str, x: Node, reach: str) -> tuple[float, Node] | None:
    """What the slope of the last two nodes is over, and how far beyond the end x is in that; None where it is held."""
    outward = node(reach, x, value(end))
    if rule == "linear":
        return end - inner, node("difference", outward, value(end))
    if rule == "linear_load" and end * inner > 0.0 and abs(end) > abs(inner):
        return 1.0 / end - 1.0 / inner, node("difference", node("quotient", value(1.0), outward), value(1.0 / end))
    return None


def _held(grid: Array, axes: list[Axis]) -> Node:
    """The table that holds its ends."""
    if not axes:
        return value(float(grid))
    if len(axes) <= len(_KEYS):
        return _table(grid, axes)
    hats = [_table(unit, [axes[-1]]) for unit in np.eye(axes[-1][0].size)]
    return total(*(node("product", hat, _held(grid[..., k], axes[:-1])) for k, hat in enumerate(hats)))


def _table(grid: Array, axes: list[Axis]) -> Node:
    made = node("table")
    for key, (_, _, name) in zip(_KEYS, axes, strict=False):
        made.append(node("independentVar", text=name, lookup=key))
    rows = axes[0][0]
    if grid.ndim == 1:
        made.append(node("tableData", text="\n".join(_line(*row) for row in zip(rows, grid, strict=True))))
        return made
    layers: Array = grid if grid.ndim == 3 else grid[..., None]
    for k in range(layers.shape[2]):
        lines = [_line(*axes[1][0]), *(_line(x, *layers[i, :, k]) for i, x in enumerate(rows))]
        at = {"breakPoint": repr(float(axes[2][0][k]))} if grid.ndim == 3 else {}
        made.append(node("tableData", text="\n".join(lines), **at))
    return made


def _line(*numbers: float) -> str:
    return " ".join(repr(float(x)) for x in numbers)


def named(names: Sequence[str], spell: Callable[[str], str] = plain) -> dict[str, str]:
    """Names as properties, each another.

    >>> named(["K_p|p|", "K_pp"])
    {'K_p|p|': 'K_pabs-p', 'K_pp': 'K_pp'}
    """
    taken: dict[str, str] = {}
    for name in names:
        spelled = spell(name)
        while spelled in taken.values():
            spelled += "_"
        taken[name] = spelled
    return taken
