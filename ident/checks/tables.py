"""Checks of what stands beside the runs: derivatives, descriptions, names, tests."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator
from functools import cache
from importlib.resources import files

import numpy as np
import pandas as pd

from ident.captive.known_tests import tests
from ident.captive.published import TEST as PUBLISHED
from ident.captive.run_table import PROPULSION
from ident.checks.findings import Evidence, Finding, Rule, check, kept, rules
from ident.identification.equations import Runs
from ident.identification.nodes import vanishes
from ident.identification.solver import Solver
from sim.boat.catalogue import OUTPUTS
from sim.boat.parts import parts_of, vehicle_terms

# Horizontal coefficient, vertical one, and their sign on a body of revolution:
# v, r, Y, N answer to w, -q, Z, -M when the body is turned 90 deg about x.
_FACTORS = {"v": ("w", 1), "r": ("q", -1)}
_OUTPUTS = {"Y": ("Z", 1), "N": ("M", -1), "X": ("X", 1)}
_OWN_INERTIA = ("X_udot", "Y_vdot", "Z_wdot", "K_pdot", "M_qdot", "N_rdot")


def symbol(name: str) -> str:
    """A coefficient's name without separators and primes: ``Y_v|v|`` -> ``Yv|v|``."""
    return re.sub(r"[_'{}\s\\]", "", name)


def _values(table: pd.DataFrame) -> dict[str, tuple[float, str, int]]:
    """Name -> (value, file, row); the file may be missing."""
    numbers = pd.to_numeric(table["value"], errors="coerce")
    values = {}
    for i, (name, value) in enumerate(zip(table["coefficient"], numbers, strict=True)):
        if math.isfinite(value):
            file = str(table["file"].iloc[i]) if "file" in table else ""
            values[symbol(str(name))] = (float(value), file, int(table["row"].iloc[i]) if "row" in table else i + 2)
    return values


def _relative_errors(table: pd.DataFrame, *names: str) -> list[float]:
    """Standard errors over values, where the table has a column ``stderr``; else zero."""
    if "stderr" not in table:
        return [0.0]
    of_names = table[[symbol(str(n)) in names for n in table["coefficient"]]]
    return [abs(e / v) for v, e in zip(of_names["value"], of_names["stderr"], strict=True) if v]


def vertical_partner(name: str) -> tuple[str, int] | None:
    """The vertical coefficient of a horizontal one on a body of revolution, and its sign.

    Parameters
    ----------
    name : As ``Yvdot``, ``Nrr``, ``Yuudr``; from ``symbol``.

    Returns
    -------
    For ``Yvv`` (``Zww``, 1), for ``Nv`` (``Mw``, -1). None when the name holds other
    letters than v, r, u and dot, or neither v nor r.
    """
    hit = re.fullmatch(r"([YN])((?:u|v|r|\||dot)+)", name)
    if hit is None or not set(hit[2].replace("dot", "")) & {"v", "r"}:
        return None
    output, sign = _OUTPUTS[hit[1]]
    body = hit[2]
    count = {k: body.count(k) for k in _FACTORS}
    # v v and r r stand for v|v| and r|r|: odd, with the sign of the factor once.
    for factor, n in count.items():
        sign *= _FACTORS[factor][1] ** (1 if n else 0)
    for factor, (other, _) in _FACTORS.items():
        body = body.replace(factor, other)
    return output + body, sign


@check("inertia_sign")
def derivatives_of_inertia(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Own added-inertia derivatives above zero."""
    if evidence.derivatives is None:
        return
    known = _values(evidence.derivatives)
    for name in _OWN_INERTIA:
        value, file, row = known.get(symbol(name), (0.0, "", 0))
        if value > 0.0:
            yield rule.finding(file, [row], [name], f"{name} = {value:g}: added inertia below zero")


@check("revolution")
def body_of_revolution(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Horizontal against vertical coefficients, where the added masses say the body is round."""
    if evidence.derivatives is None:
        return
    known = _values(evidence.derivatives)
    sway, heave = (known.get(k, (math.nan,))[0] for k in ("Yvdot", "Zwdot"))
    if not abs(sway - heave) <= rule.limits["same"] * abs(heave):
        return
    # Equal values whose errors are larger than the differences looked for say nothing of the body.
    if max(_relative_errors(evidence.derivatives, "Yvdot", "Zwdot")) > rule.limits["differs"]:
        return
    for name, (value, file, row) in known.items():
        partner = vertical_partner(name)
        if partner is None or partner[0] not in known or known[partner[0]][0] == 0.0:
            continue
        other, _, other_row = known[partner[0]]
        ratio = value / (partner[1] * other)
        if abs(ratio - 1.0) > rule.limits["differs"]:
            text = f"{name} = {value:g} against {partner[0]} = {other:g}: a ratio of {ratio:.3g}, on a body whose "
            text += f"sway and heave added masses are equal ({sway:g}, {heave:g})"
            yield rule.finding(file, [row, other_row], [name, partner[0]], text)


@check("norm")
def length_over_draught(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The same coefficient in two tables, a factor L/d apart; or an added mass a factor L/d too large."""
    body = evidence.body
    if evidence.derivatives is None or body is None or not body.draught:
        return
    known, step = _values(evidence.derivatives), body.length / body.draught
    other = _values(evidence.reference) if evidence.reference is not None else {}
    ratios = {n: abs(v / other[n][0]) for n, (v, _, _) in known.items() if other.get(n, (0.0,))[0] and v}
    # A ratio that leaves the floating-point range is no factor L/d.
    ratios = {n: r for n, r in ratios.items() if 0.0 < r < math.inf}
    for claim, factor in (("1/2 rho L d, not 1/2 rho L^2", step), ("1/2 rho L^2, not 1/2 rho L d", 1.0 / step)):
        near = {n: r for n, r in ratios.items() if abs(math.log(r / factor)) < math.log1p(rule.limits["share"])}
        if near and len(near) > len(ratios) / 2:
            name, ratio = min(near.items(), key=lambda item: abs(math.log(item[1] / factor)))
            text = (
                f"{', '.join(near)} are off the reference by about L/d = {step:.4g} ({name} by {ratio:.3g}): in {claim}"
            )
            yield rule.finding(known[name][1], [known[n][2] for n in near], list(near), text)
    yield from _added_mass_norm(known, evidence, rule)


def _added_mass_norm(known: dict[str, tuple[float, str, int]], evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Sway added mass against the body's own: plausible only in the other norm."""
    body = evidence.body
    assert body is not None
    if "Yvdot" not in known or body.mass is None or not body.draught:
        return
    displaced = body.mass / (0.5 * body.density * body.length**3)
    value, file, row = known["Yvdot"]
    limits, step = rules()["inertia_left_in"].limits, body.length / body.draught
    times = abs(value) / displaced
    if times > limits["v"] and limits["least"] <= times / step <= limits["v"]:
        text = f"Y_vdot = {value:g} is {times:.1f} times the displaced mass {displaced:.3g} in 1/2 rho L^2; "
        yield rule.finding(file, [row], ["Y_vdot"], text + f"in 1/2 rho L d it would be {times / step:.2f}")


@cache
def _words() -> dict[str, tuple[set[str], set[str]]]:
    with (files("ident") / "data" / "label_words.csv").open(encoding="utf-8") as stream:
        return {r["column"]: (set(r["own"].split()), set(r["foreign"].split())) for r in csv.DictReader(stream)}


@check("angle_name")
def descriptions(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Columns described with the words of another quantity and none of their own."""
    if evidence.labels is None:
        return
    for _, label in evidence.labels.iterrows():
        name = re.sub(r"['_ ].*$|_?mean'?$", "", str(label["column"]).strip())
        words_of, foreign = _words().get(name, (set(), set()))
        words = set(re.findall(r"[a-z]+", str(label["description"]).lower()))
        if words & foreign and not words & words_of:
            sheet = f" on sheet {label['sheet']!r}" if label["sheet"] else ""
            text = f"column {name!r} is described as {label['description']!r}{sheet}"
            yield rule.finding(str(label["file"]), [label["row"]], [name], text)


@check("configuration")
def configurations(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Numbers for names, one name for two boats, two names for one boat."""
    table = evidence.configurations
    if table is not None:
        file, names = str(table["file"].iloc[0]), table["configuration"].astype(str)
        bare = names.str.fullmatch(r"(?i)(config(uration)?\W*)?\d+")
        if bare.any():
            text = f"configurations {', '.join(dict.fromkeys(names[bare]))} are known by number only"
            yield rule.finding(file, table["row"][bare], ["configuration"], text, "info")
        for by, other in (("appendages", "configuration"), ("configuration", "appendages")):
            for key, group in table.groupby(by, sort=False):
                values = list(dict.fromkeys(group[other].astype(str)))
                if len(values) > 1:
                    text = f"{by} {key} stands under {len(values)} {other} names: {'; '.join(values)}"
                    yield rule.finding(file, group["row"], [by, other], text)
    campaign = evidence.campaign
    for text in (campaign.vehicle.title, campaign.header.name) if campaign else ():
        if re.search(r"(?i)\bconfig(uration)?\.?[ _-]*\d+", text):
            yield rule.finding("campaign.toml", [], [], f"{text!r} names a configuration by a number")


@check("essential")
def loads_a_boat_needs(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Tests of the hull whose runs lack the loads that they are made for, as where a column was forgotten.

    A campaign of one such test gives a part of a model, from which no boat is flown: there it is a warning.
    """
    campaign = evidence.campaign
    if campaign is None:
        return
    made_for = [test for test, essential in tests()["essential"].items() if essential]
    single = campaign.runs.loc[campaign.runs["test"].isin(made_for), "test"].nunique() == 1
    severity = "warning" if single else rule.severity
    terms = vehicle_terms(campaign.vehicle)
    declared = dict(campaign.header.absent)
    for test, essential in tests()["essential"].items():
        runs = campaign.runs[(campaign.runs["test"] == test) & (campaign.runs["part"] == "hull")]
        runs = runs[~runs["run_id"].astype(str).str.contains(r"[+-][av]$")] if len(runs) else runs
        wanted = {t.output for t in terms if test in t.tests and t.part == "hull"}
        for output in str(essential).split():
            reason = declared.pop(f"{test}.{output}", None)
            if runs.empty or output not in wanted:
                continue
            given = kept(runs, output)
            bare = not given.any()
            # An empty channel reads zero.
            idle = not bare and not (runs[output][given] != 0.0).any() and _unsymmetric(runs[given], output)
            if (bare or idle) and reason is None:
                gives = f"gives {output}" if bare else f"gives a {output} that is not zero"
                what = f"none of {len(runs)} {test} runs {gives}: the boat would have no {output} from it"
                yield rule.finding(str(runs["file"].iloc[0]), [], [output], what, severity)
            if not (bare or idle) and reason is not None:
                what = f"{test}.{output} is declared absent, and {int(kept(runs, output).sum())} runs give it"
                yield rule.finding("campaign.toml", [], ["absent"], what)
    for name in declared:
        known = ", ".join(f"{t}.{o}" for t, loads in tests()["essential"].items() for o in str(loads).split())
        yield rule.finding("campaign.toml", [], ["absent"], f"{name!r} is declared absent; known are {known}")


@check("essential")
def damping_of_turns(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Turns of the hull about an axis, none of whose runs gives the moment that opposes them."""
    runs = evidence.runs
    turns = runs[runs["test"].isin(["rotating_arm", "pure_rotation"]) & runs["part"].isin(["hull", ""])]
    for file, turning in turns.groupby("file", sort=False):
        for rate, moment in (("p", "K"), ("q", "M"), ("r", "N")):
            others = [r for r in "pqr" if r != rate]
            about = turning[(turning[rate].fillna(0.0) != 0.0) & (turning[others].fillna(0.0) == 0.0).all(axis=1)]
            if len(about) > 1 and about[moment].isna().all():
                what = f"none of {len(about)} runs that turn with {rate} gives {moment}, which opposes the turn"
                yield rule.finding(str(file), about["row"], [moment], what, "warning")


def _unsymmetric(runs: pd.DataFrame, output: str) -> bool:
    """Whether runs include a state in which a load may not vanish by symmetry: a flow angle in its plane."""
    angle = {"Y": "beta", "N": "beta", "Z": "alpha", "M": "alpha"}.get(output)
    return angle is None or bool((runs[angle].fillna(0.0) != 0.0).any())


@check("missing")
def unsupported_terms(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Terms of the vehicle's set without a run or published value, or with copies of other runs only."""
    campaign = evidence.campaign
    if campaign is None:
        return
    solver = Solver(campaign)
    seen, identified = set(), set()
    runs = Runs.of(campaign.runs)
    # Whether a state has a run of its own, beside copies of others that are no mirror images.
    first_hand = (runs.words("copy_of") == "") | (runs.words("quality") == "mirrored")
    measured = np.bincount(runs.state, weights=first_hand, minlength=len(runs.first)) > 0
    for state, run in runs.records(np.arange(len(runs.first))):
        features = solver.features(run)
        if run["test"] == PUBLISHED and "value" in run["exclude"].split():
            continue
        if run["test"] == PUBLISHED:
            term = solver.by_name[run["coefficient"]]
            identified.add(solver.canonical(term.name, run["part"], solver.place(term, features))[0][:2])
            continue
        given = [o for o in (*OUTPUTS, *PROPULSION) if not math.isnan(run[o]) and o not in run["exclude"].split()]
        names = {(o, "propeller") for o in given if o in PROPULSION}
        for output in given:
            for term, _ in solver.active(run, output, features) if output in OUTPUTS else ():
                key, sign = solver.canonical(term.name, run["part"], solver.place(term, features))
                names |= {key[:2]} if run["test"] in term.tests and sign else set()
        seen |= names
        identified |= names if measured[state] else set()
    absent: dict[str, list[str]] = {}
    copied: dict[str, list[str]] = {}
    for term in vehicle_terms(campaign.vehicle):
        if not term.tests:
            # An estimate gives it, no run can.
            continue
        keys = {(m.name, m.part) for k, m in solver.mirrors.items() if k[0] == term.name}
        keys |= {(term.name, part) for part in parts_of(term, campaign.vehicle)}
        idle = all(vanishes(term, part, campaign.vehicle) for part in parts_of(term, campaign.vehicle))
        if term.name != "w_T" and not idle and not keys & identified:
            (copied if keys & seen else absent).setdefault(" or ".join(term.tests), []).append(term.name)
    for groups, text, severity in (
        (absent, "no run or published value gives", rule.severity),
        (copied, "only copies or mappings of other runs give", "info"),
    ):
        for test, symbols in groups.items():
            what = f"{test}: {text} {', '.join(symbols)} ({len(symbols)} terms of set {campaign.vehicle.term_set})"
            yield rule.finding("campaign.toml", [], [], what, severity)


@check("notes")
def signs_behind_numbers(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Errors and footnote marks behind numbers whose meaning the campaign does not state; one finding a file."""
    runs = evidence.runs
    if "notes" not in runs:
        return
    noted = runs[runs["notes"].fillna("") != ""]
    for file, of_file in noted.groupby("file", sort=False):
        every = [note for text in of_file["notes"] for note in text.split("; ")]
        signs = [n for n in every if n.endswith("+-")]
        marks = dict.fromkeys(n.split(": ")[1] for n in every if not n.endswith("+-"))
        words = [f"{len(signs)} errors behind numbers, read as one standard error each"] if signs else []
        words += [f"footnote marks {' '.join(marks)} behind {len(every) - len(signs)} numbers"] if marks else []
        columns = list(dict.fromkeys(n.split(": ")[0] for n in every))
        yield rule.finding(str(file), of_file["row"], columns, "; ".join(words))
