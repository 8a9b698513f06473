"""The linear equations of runs in tabulated values, and their solution with its covariance."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.campaign import Campaign
from ident.captive.published import TEST as PUBLISHED
from ident.captive.run_table import MEASURED
from ident.cluster import Spread, here
from ident.identification.equations import ALWAYS, BEYOND, NONZERO, Equations, Form, Note, Runs
from ident.identification.facilities import Left
from ident.identification.nodes import Node, by_coefficient, key_point, table_points
from ident.identification.noted import UNTOLD, FitWarning, UnusedLoad
from ident.identification.stage_solve import Loads, solve_stage
from sim.boat.catalogue import ACCELERATIONS, OUTPUTS, Term
from sim.boat.forces import axis_values, boat_features, body_velocity, multiplier, plane_features
from sim.boat.parts import Mirror, Point, mirror_of, parts_of, vehicle_terms
from sim.boat.tables import Table

Array = NDArray[np.float64]
Key = tuple[str, str]
# A row of the run table.
Run = Mapping[str, Any] | pd.Series

# Relative to the length: levers closer than this are the same lever, rounded.
_LEVER_DIGITS = 1e-5


class Solver:
    """The growing set of tabulated values with their covariance, stage by stage."""

    def __init__(self, campaign: Campaign) -> None:
        self.campaign = campaign
        self.vehicle = campaign.vehicle
        # Terms that no test identifies come from estimates, after the runs.
        self.terms = [t for t in vehicle_terms(self.vehicle) if t.tests]
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
        self._members: tuple[int, dict[Key, list[int]]] = (0, {})
        self.tables: dict[Key, tuple[Table, list[int], list[int]]] = {}
        # What each stage leaves of its loads, kept where several campaigns are compared.
        self.left: list[Left] = []
        self.unused: list[UnusedLoad] = []
        self.warnings: list[FitWarning] = []
        particulars, fluid = self.vehicle.particulars, campaign.header.fluid
        self.diameter = self.vehicle.diameter
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
            if self._members[0] != len(self.nodes):
                self._members = (len(self.nodes), by_coefficient(self.nodes))
            points, nodes, signs = table_points(self.nodes, term, part, self.vehicle, self._members[1])
            if not points:
                return None
            rules = tuple(term.extrapolation[a] for a in term.axes)
            table = Table(term.axes, rules, np.array(points, dtype=float).reshape(len(points), -1))
            self.tables[key] = (table, nodes, signs)
        return self.tables[key]

    def row(self, term: Term, part: str, features: dict[str, float]) -> dict[int, float] | None:
        """Weights of the nodes in a known term's coefficient at a state."""
        tabulated = self.table(term, part)
        if tabulated is None:
            return None
        table, nodes, signs = tabulated
        shares = table.weights(axis_values(term, features)) * np.array(signs)
        row: dict[int, float] = {}
        for node, weight in zip(nodes, shares, strict=True):
            if weight != 0.0:
                row[node] = row.get(node, 0.0) + float(weight)
        return row

    # -- equations -----------------------------------------------------------------------

    def features(self, run: Run) -> dict[str, float]:
        """Feature values of a run's state."""
        given = {k: float(run[k]) for k in ("U", "alpha", "beta", "p", "q", "r", "plane", *ACCELERATIONS)}
        zero = {k: 0.0 if math.isnan(x) else x for k, x in given.items()}
        velocity = body_velocity(zero["U"], zero["alpha"], zero["beta"])
        rates = (zero["p"], zero["q"], zero["r"])
        values = boat_features(velocity, rates, float(run["D0"]), float(run["n"]), float(run["J"]))
        if run["part"] in self.planes:
            values |= plane_features(self.planes[run["part"]], velocity, rates, zero["plane"])
        return values | {name: zero[name] for name in ACCELERATIONS}

    def active(self, run: Run, output: str, features: dict[str, float]) -> list[tuple[Term, float]]:
        """Terms of the run's part that load this output in this state."""
        active = []
        for term in self.loading.get((output, run["part"]), []):
            m = multiplier(term, features)
            if m != 0.0 and not math.isnan(m):
                active.append((term, m))
        return active

    def skip(self, run: Run, output: str, reason: str) -> None:
        """Note that a load of a run is not used, and why."""
        self.unused.append(UnusedLoad(run["run_id"], run["file"], int(run["row"]), output, reason))

    def load_form(self, run: Run, output: str, features: dict[str, float]) -> tuple[Form, list[Note]]:
        """One load of a state: terms its test identifies are unknown, the others known."""
        form, notes = Form(output, {}, {}), []
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
                form.unknowns[node] = form.unknowns.get(node, 0.0) + sign * factor
            elif run["decoupled"] != "True":
                row = self.row(term, run["part"], features)
                if row is None and self.canonical(term.name, run["part"], self.place(term, features))[1] == 0:
                    continue
                if row is None:
                    text = f"{term.name} acts on this run but no test identifies it: not subtracted"
                    notes.append(Note(output, text, unused=False))
                    continue
                for node, weight in row.items():
                    form.known[node] = form.known.get(node, 0.0) + factor * weight
        if not form.unknowns and zero_by_symmetry:
            text = f"{output} = {{value:g}} where port/starboard symmetry makes it zero"
            notes.append(Note(output, text, unused=False, when=BEYOND))
        elif not form.unknowns:
            text = f"no term that {run['test']} identifies acts on this load in this state"
            notes.append(Note(output, text, unused=True, when=NONZERO))
        return form, notes

    def direct_form(self, run: Run, output: str, features: dict[str, float]) -> tuple[Form, list[Note]]:
        """A coefficient given as it is: of a propeller test, or published."""
        published = run["test"] == PUBLISHED
        term = self.by_name[run["coefficient"] if published else output]
        if not published and run["test"] not in term.tests:
            return Form(output, {}, {}), [Note(output, f"{output} is not taken from a {run['test']} run", unused=True)]
        part = run["part"] if published else term.part
        key, sign = self.canonical(term.name, part, self.place(term, features))
        if not published or part == "propeller":
            # A propeller turns one way: the mirror does not hold for it.
            sign = 1
        if sign == 0:
            return Form(output, {}, {}), [Note(output, f"{term.name} is zero by port/starboard symmetry", unused=True)]
        node = self.node(key)
        self.nodes[node].seen.add((part, key[2]))
        return Form(output, {node: float(sign)}, {}), []

    def forms(self, run: Run) -> tuple[list[Form], list[Note]]:
        """Every usable load and directly measured coefficient of a state, and what is to be said of the others.

        Parameters
        ----------
        run : The first run of the state.
        """
        features = self.features(run)
        excluded = run["exclude"].split()
        forms: list[Form] = []
        notes: list[Note] = []
        for output in MEASURED:
            if math.isnan(run[output]):
                continue
            if output in excluded:
                notes.append(Note(output, run["reason"] or "excluded in the run file", unused=True))
                continue
            make = self.load_form if output in OUTPUTS else self.direct_form
            form, said = make(run, output, features)
            forms += [form] if form.unknowns else []
            notes += said
        return forms, notes

    def equations(self, runs: Runs, rows: NDArray[np.int64]) -> Equations:
        """The equations of some runs; nodes are entered as they come, and loads left out are noted.

        Parameters
        ----------
        runs : All of the campaign.
        rows : Those of a stage, rows of the run table in rising order.
        """
        states, at = np.unique(runs.state[rows], return_index=True)
        order = np.argsort(at)
        forms: list[Form] = []
        notes: dict[int, list[Note]] = {}
        number = np.full((len(runs.first), len(MEASURED)), -1)
        for state, run in runs.records(states[order]):
            of_state, said = self.forms(run)
            number[state, [MEASURED.index(f.output) for f in of_state]] = np.arange(
                len(forms), len(forms) + len(of_state)
            )
            forms += of_state
            if said:
                notes[state] = said
        self._note(runs, rows, notes)
        grid = number[runs.state[rows]]
        place, output = np.nonzero(grid >= 0)
        which = rows[place]
        return Equations(
            forms, grid[place, output], which, output, runs.value[which, output], runs.sigma[which, output]
        )

    def _note(self, runs: Runs, rows: NDArray[np.int64], notes: dict[int, list[Note]]) -> None:
        """Say of every run what its state gives occasion to."""
        said = np.zeros(len(runs.first), dtype=bool)
        said[list(notes)] = True
        names, files, places = (runs.words(c) for c in ("run_id", "file", "row"))
        for row in rows[said[runs.state[rows]]].tolist():
            for note in notes[int(runs.state[row])]:
                at = MEASURED.index(note.output)
                value, sigma = float(runs.value[row, at]), float(runs.sigma[row, at])
                if note.when != ALWAYS and (value == 0.0 or (note.when == BEYOND and not abs(value) > 2.0 * sigma)):
                    continue
                if note.unused:
                    self.unused.append(UnusedLoad(names[row], files[row], int(places[row]), note.output, note.text))
                else:
                    self.warnings.append(FitWarning(names[row], note.text.replace("{value:g}", f"{value:g}")))

    # -- solution ------------------------------------------------------------------------

    def solve(self, runs: Runs, equations: Equations, first: int, spread: Spread = here) -> None:
        """Weighted least squares for the nodes from ``first`` on; carries the covariance."""
        if len(self.nodes) == first:
            return
        a, b = equations.design(first)
        sign = np.sign(equations.value)
        shared = runs.origins()[equations.run] * len(MEASURED) + equations.output
        loads = Loads(equations.value, equations.sigma, sign, shared)
        solution = solve_stage(a, b, loads, self.values, self.covariance, spread=spread)
        for node in solution.lost:
            bad = self.nodes[first + node]
            text = f"{bad.part} at {bad.point}: {UNTOLD}"
            self.warnings.append(FitWarning(bad.name, text))
        self.covariance = np.block([[self.covariance, solution.cross.T], [solution.cross, solution.covariance]])
        self.values = np.concatenate([self.values, solution.values])
        if self.campaign.members:
            self.left.append(self._left(equations, solution.residual))
        self._record(runs, equations, solution.scores(equations.sigma), first)
        self._forget(first, solution.lost)

    def _left(self, equations: Equations, residual: Array) -> Left:
        """What the solution leaves of every load, with the values that it is an equation for."""
        keys = [" ".join(map(str, sorted(form.unknowns))) for form in equations.forms]
        outputs = np.array(MEASURED, dtype=object)[equations.output]
        values = np.array(keys, dtype=object)[equations.form]
        fitted = equations.value - residual
        return Left(equations.run, outputs, fitted, residual, equations.sigma, values)

    def _record(self, runs: Runs, equations: Equations, scores: Array, first: int) -> None:
        """Enter runs, tests, quality words and the worst disagreement in every node."""
        a, _ = equations.design(first)
        order = np.argsort(a.indices, kind="stable")
        equation = np.repeat(np.arange(len(equations.form)), np.diff(a.indptr))[order]
        ends = np.searchsorted(a.indices[order], np.arange(a.shape[1] + 1))
        names, qualities, kinds = (runs.words(c)[equations.run] for c in ("run_id", "quality", "test"))
        for k, (low, high) in enumerate(itertools.pairwise(ends)):
            lines, node = equation[low:high], self.nodes[first + k]
            node.runs += names[lines].tolist()
            node.qualities += dict.fromkeys(qualities[lines].tolist())
            node.tests |= set(kinds[lines].tolist())
            if lines.size and float(scores[lines].max()) > node.worst:
                worst = lines[int(np.argmax(scores[lines]))]
                node.worst, node.worst_run = float(scores[worst]), str(names[worst])
        for i in np.flatnonzero(scores > 2.0).tolist():
            form = equations.forms[equations.form[i]]
            name = self.nodes[next(iter(form.unknowns))].name
            text = f"{name}: {form.output} disagrees with runs at the same point by {scores[i]:.1f} standard errors"
            self.warnings.append(FitWarning(names[i], text))

    def _forget(self, first: int, lost: list[int]) -> None:
        """Drop nodes that could not be identified."""
        if not lost:
            return
        keep = [i for i in range(len(self.nodes)) if i - first not in lost]
        self.nodes = [self.nodes[i] for i in keep]
        self.index = {(n.name, n.part, n.point): i for i, n in enumerate(self.nodes)}
        self._members = (0, {})
        self.values, self.covariance = self.values[keep], self.covariance[np.ix_(keep, keep)]

    def append(self, key: tuple[str, str, Point], value: float, variance: float, row: Array) -> int:
        """Add one derived value with its covariance row against all others."""
        node = self.node(key)
        self.covariance = np.block([[self.covariance, row[:, None]], [row[None, :], np.array([[variance]])]])
        self.values = np.append(self.values, value)
        return node


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
            solver.warnings.append(FitWarning(str(runs.loc[i, "run_id"]), text))
