"""The linear equations of runs in tabulated values, and their solution with its covariance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.campaign import Campaign
from ident.captive.published import TEST as PUBLISHED
from ident.captive.run_table import MEASURED
from ident.identification.nodes import Node, key_point, table_points
from ident.identification.stage_solve import gain_matrix, weights
from sim.boat.catalogue import ACCELERATIONS, OUTPUTS, Term
from sim.boat.forces import axis_values, boat_features, body_velocity, multiplier, plane_features
from sim.boat.parts import Mirror, Point, mirror_of, parts_of, vehicle_terms
from sim.boat.tables import Table

Array = NDArray[np.float64]
Key = tuple[str, str]

# Relative to the length: levers closer than this are the same lever, rounded.
_LEVER_DIGITS = 1e-5


@dataclass
class Equation:
    """One measured load (or directly measured coefficient) of one run."""

    run: pd.Series
    output: str
    value: float
    sigma: float
    unknowns: dict[int, float]
    known: dict[int, float]


class Solver:
    """The growing set of tabulated values with their covariance, stage by stage."""

    def __init__(self, campaign: Campaign) -> None:
        self.campaign = campaign
        self.vehicle = campaign.vehicle
        self.terms = vehicle_terms(self.vehicle)
        self.by_name = {t.name: t for t in self.terms}
        self.planes = {p.name: p for p in self.vehicle.planes}
        self.mirrors: dict[Key, Mirror] = {
            (t.name, part): mirror_of(t, part, self.vehicle) for t in self.terms for part in parts_of(t, self.vehicle)
        }
        self.order = {k: i for i, k in enumerate(self.mirrors)}
        self.loading: dict[tuple[str, str], list[Term]] = {}
        for name, part in self.mirrors:
            term = self.by_name[name]
            self.loading.setdefault((term.output, part), []).append(term)
        self.nodes: list[Node] = []
        self.index: dict[tuple[str, str, Point], int] = {}
        self.values: Array = np.zeros(0)
        self.covariance: Array = np.zeros((0, 0))
        self.tables: dict[Key, tuple[Table, list[int], list[int]]] = {}
        self.unused: list[tuple[str, str, int, str, str]] = []
        self.warnings: list[tuple[str, str]] = []
        particulars, fluid = self.vehicle.particulars, campaign.header.fluid
        self.diameter = self.vehicle.propeller.diameter.value
        self.scales = {
            t.name: t.scale(fluid.density_kgpm3, particulars.length.value, self.diameter) for t in self.terms
        }

    # -- where a value stands ------------------------------------------------------------

    def canonical(self, name: str, part: str, point: Point) -> tuple[tuple[str, str, Point], int]:
        """The node a point folds onto, and its sign; sign 0 when symmetry makes it zero."""
        mirror = self.mirrors[name, part]
        image = (mirror.name, mirror.part, mirror.point(point))
        here = (name, part, point)
        if here == image:
            return here, 1 if mirror.sign > 0 else 0
        swapped = (self.order[image[:2]], [-x for x in image[2]]) < (self.order[here[:2]], [-x for x in point])
        return (image, mirror.sign) if swapped else (here, 1)

    def place(self, term: Term, features: dict[str, float]) -> Point:
        """The tabulated point of a term in a state."""
        return key_point(axis_values(term, features))

    def node(self, key: tuple[str, str, Point]) -> int:
        """Number of the node at a place, new when nothing stood there."""
        if key not in self.index:
            self.index[key] = len(self.nodes)
            self.nodes.append(Node(*key))
        return self.index[key]

    def table(self, term: Term, part: str) -> tuple[Table, list[int], list[int]] | None:
        """Table over the points found so far, with the node and sign of each point."""
        key = (term.name, part)
        if key not in self.tables:
            points, nodes, signs = table_points(self.nodes, term, part, self.vehicle)
            if not points:
                return None
            rules = tuple(term.extrapolation[a] for a in term.axes)
            table = Table(term.axes, rules, np.array(points, dtype=float).reshape(len(points), -1))
            self.tables[key] = (table, nodes, signs)
        return self.tables[key]

    def row(self, term: Term, part: str, features: dict[str, float]) -> dict[int, float] | None:
        """Weights of the nodes in a known term's coefficient at a state."""
        found = self.table(term, part)
        if found is None:
            return None
        table, nodes, signs = found
        shares = table.weights(axis_values(term, features)) * np.array(signs)
        row: dict[int, float] = {}
        for node, weight in zip(nodes, shares, strict=True):
            if weight != 0.0:
                row[node] = row.get(node, 0.0) + float(weight)
        return row

    # -- equations -----------------------------------------------------------------------

    def features(self, run: pd.Series) -> dict[str, float]:
        """Feature values of a run's state."""
        zero = {k: 0.0 if pd.isna(run[k]) else float(run[k]) for k in ("U", "alpha", "beta", "p", "q", "r", "plane")}
        velocity = body_velocity(zero["U"], zero["alpha"], zero["beta"])
        rates = (zero["p"], zero["q"], zero["r"])
        found = boat_features(velocity, rates, float(run["D0"]), float(run["n"]), float(run["J"]))
        if run["part"] in self.planes:
            found |= plane_features(self.planes[run["part"]], velocity, rates, zero["plane"])
        for name in ACCELERATIONS:
            found[name] = 0.0 if pd.isna(run[name]) else float(run[name])
        return found

    def active(self, run: pd.Series, output: str, features: dict[str, float]) -> list[tuple[Term, float]]:
        """Terms of the run's part that load this output in this state."""
        found = []
        for term in self.loading.get((output, run["part"]), []):
            m = multiplier(term, features)
            if m != 0.0 and not math.isnan(m):
                found.append((term, m))
        return found

    def skip(self, run: pd.Series, output: str, reason: str) -> None:
        """Note that a load of a run is not used, and why."""
        self.unused.append((run["run_id"], run["file"], int(run["row"]), output, reason))

    def load_equation(self, run: pd.Series, output: str, features: dict[str, float]) -> Equation | None:
        """One load of a run: terms its test identifies are unknown, the others known."""
        unknowns: dict[int, float] = {}
        known: dict[int, float] = {}
        zero_by_symmetry = False
        for term, m in self.active(run, output, features):
            factor = self.scales[term.name] * m
            if run["test"] in term.tests:
                point = self.place(term, features)
                key, sign = self.canonical(term.name, run["part"], point)
                if sign == 0:
                    zero_by_symmetry = True
                    continue
                node = self.node(key)
                self.nodes[node].seen.add((run["part"], point))
                unknowns[node] = unknowns.get(node, 0.0) + sign * factor
            elif run["decoupled"] != "True":
                row = self.row(term, run["part"], features)
                if row is None and self.canonical(term.name, run["part"], self.place(term, features))[1] == 0:
                    continue
                if row is None:
                    text = f"{term.name} acts on this run but no test identifies it: not subtracted"
                    self.warnings.append((run["run_id"], text))
                    continue
                for node, weight in row.items():
                    known[node] = known.get(node, 0.0) + factor * weight
        value, sigma = float(run[output]), float(run[f"s_{output}"])
        if unknowns:
            return Equation(run, output, value, sigma, unknowns, known)
        if zero_by_symmetry:
            if abs(value) > 2.0 * sigma and value != 0.0:
                text = f"{output} = {value:g} where port/starboard symmetry makes it zero"
                self.warnings.append((run["run_id"], text))
        elif value != 0.0:
            self.skip(run, output, f"no term that {run['test']} identifies acts on this load in this state")
        return None

    def direct_equation(self, run: pd.Series, output: str, features: dict[str, float]) -> Equation | None:
        """A coefficient given as it is: of a propeller test, or published."""
        published = run["test"] == PUBLISHED
        term = self.by_name[run["coefficient"] if published else output]
        if not published and run["test"] not in term.tests:
            self.skip(run, output, f"{output} is not taken from a {run['test']} run")
            return None
        part = run["part"] if published else term.part
        key, sign = self.canonical(term.name, part, self.place(term, features))
        if published and sign == 0:
            self.skip(run, output, f"{term.name} is zero by port/starboard symmetry")
            return None
        if not published:
            # A propeller turns one way: the mirror does not hold for it.
            sign = 1
        node = self.node(key)
        self.nodes[node].seen.add((part, key[2]))
        return Equation(run, output, float(run[output]), float(run[f"s_{output}"]), {node: float(sign)}, {})

    def equations(self, run: pd.Series) -> list[Equation]:
        """Every usable load and directly measured coefficient of a run."""
        features = self.features(run)
        excluded = run["exclude"].split()
        found = []
        for output in MEASURED:
            if pd.isna(run[output]):
                continue
            if output in excluded:
                self.skip(run, output, run["reason"] or "excluded in the run file")
                continue
            if output in OUTPUTS:
                equation = self.load_equation(run, output, features)
            else:
                equation = self.direct_equation(run, output, features)
            if equation:
                found.append(equation)
        return found

    # -- solution ------------------------------------------------------------------------

    def solve(self, equations: list[Equation], first: int) -> None:
        """Weighted least squares for the nodes from ``first`` on; carries the covariance."""
        n_new, n_old = len(self.nodes) - first, first
        if not n_new:
            return
        a = np.zeros((len(equations), n_new))
        b = np.zeros((len(equations), n_old))
        for i, equation in enumerate(equations):
            for node, factor in equation.unknowns.items():
                a[i, node - first] = factor
            for node, factor in equation.known.items():
                b[i, node] = factor
        sigma = np.array([e.sigma for e in equations])
        y = np.array([e.value for e in equations]) - b @ self.values
        gain, lost = gain_matrix(a, weights(a, sigma))
        for node in lost:
            bad = self.nodes[first + node]
            text = f"{bad.part} at {bad.point}: the runs cannot tell it from other terms; dropped"
            self.warnings.append((bad.name, text))
        new = gain @ y
        noise = gain @ _error_covariance(equations, sigma) @ gain.T
        cross = -gain @ b @ self.covariance
        own = noise + gain @ b @ self.covariance @ b.T @ gain.T
        self.covariance = np.block([[self.covariance, cross.T], [cross, own]])
        self.values = np.concatenate([self.values, new])
        self._record(equations, y - a @ new, a, gain, sigma)
        self._forget(first, lost)

    def _record(self, equations: list[Equation], residual: Array, a: Array, gain: Array, sigma: Array) -> None:
        leverage = np.einsum("ij,ji->i", a, gain)
        for i, equation in enumerate(equations):
            spread = sigma[i] * math.sqrt(max(1.0 - leverage[i], 0.0))
            free = leverage[i] < 1.0 - 1e-9
            score = abs(residual[i]) / spread if free and spread > 0.0 else 0.0
            for node in equation.unknowns:
                record = self.nodes[node]
                record.runs.append(equation.run["run_id"])
                record.qualities.append(equation.run["quality"])
                record.tests.add(equation.run["test"])
                record.worst = max(record.worst, score)
            if score > 2.0:
                name = self.nodes[next(iter(equation.unknowns))].name
                text = f"{name}: {equation.output} disagrees with runs at the same point by {score:.1f} standard errors"
                self.warnings.append((equation.run["run_id"], text))

    def _forget(self, first: int, lost: list[int]) -> None:
        """Drop nodes that could not be identified."""
        if not lost:
            return
        keep = [i for i in range(len(self.nodes)) if i - first not in lost]
        self.nodes = [self.nodes[i] for i in keep]
        self.index = {(n.name, n.part, n.point): i for i, n in enumerate(self.nodes)}
        self.values, self.covariance = self.values[keep], self.covariance[np.ix_(keep, keep)]

    def append(self, key: tuple[str, str, Point], value: float, variance: float, row: Array) -> int:
        """Add one derived value with its covariance row against all others."""
        node = self.node(key)
        self.covariance = np.block([[self.covariance, row[:, None]], [row[None, :], np.array([[variance]])]])
        self.values = np.append(self.values, value)
        return node


def _error_covariance(equations: list[Equation], sigma: Array) -> Array:
    """Measurement covariance: copies of a run share its error, with the sign of the load."""
    covariance = np.diag(sigma**2)
    groups: dict[tuple[str, str], list[int]] = {}
    for i, e in enumerate(equations):
        groups.setdefault((e.run["copy_of"] or e.run["run_id"], e.output), []).append(i)
    for members in groups.values():
        for i in members:
            for j in members:
                if i != j:
                    sign = np.sign(equations[i].value * equations[j].value)
                    covariance[i, j] = sign * sigma[i] * sigma[j]
    return covariance


def check_levers(solver: Solver) -> None:
    """Warn where a section's lever in the runs is not the vehicle file's."""
    runs, sections = solver.campaign.runs, solver.vehicle.sections
    if sections is None or not {"x", "y", "z"} <= set(runs):
        return
    tolerance = _LEVER_DIGITS * solver.vehicle.particulars.length.value
    for section in sections.centres:
        levers = runs.loc[runs["part"] == section.name, ["x", "y", "z"]].dropna()
        off = (levers - section.position).abs().max(axis=1)
        for i in off.index[off > tolerance]:
            text = f"lever of {section.name} differs from the vehicle file's by {off[i]:.3g} m; the file's is used"
            solver.warnings.append((str(runs.loc[i, "run_id"]), text))
