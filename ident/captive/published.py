"""Derivatives that a publication gives as they are, with their standard errors.

They enter like runs: one row a coefficient, test ``published_derivative``, through the same
fit into the same database, so that no vehicle needs a list of coefficients beside it.
"""

from __future__ import annotations

import math

import pandas as pd

from sim.boat.catalogue import OUTPUTS, Term
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.files.frames import Frame

TEST = "published_derivative"


def turn_sign(term: Term, frame: Frame) -> int:
    """Sign of a coefficient when it is turned between a frame and the program frame.

    The product of the signs of its load and of its multiplier; magnitudes, S and plane
    deflections (about the plane's own axis) do not turn.
    """
    sign = int(frame.sign(term.output))
    for factor in term.factors:
        bare = factor[4:-1] if factor.startswith("sgn(") else factor
        bare = bare.removesuffix("/U")
        sign *= 1 if factor.startswith("|") or factor == "deflection" else int(frame.sign(bare))
    return sign


def _term(run: pd.Series, terms: dict[str, Term], place: str) -> Term:
    """The row of the term table a published row names, or a refusal."""
    name = run["coefficient"]
    if name not in terms:
        known = ", ".join(t.name for t in terms.values() if not t.axes)
        raise InputError(f"{place}, column coefficient", repr(name), f"a term of the vehicle's set: {known}")
    term = terms[name]
    if term.axes or not term.output:
        text = "a constant coefficient; tabulated ones are given as runs"
        raise InputError(f"{place}, column coefficient", f"{name}, tabulated over {' '.join(term.axes)}", text)
    if run["part"] != term.part and term.part != "section":
        raise InputError(f"{place}, column part", repr(run["part"]), term.part)
    return term


def to_program(
    runs: pd.DataFrame, vehicle: Vehicle, frame: Frame, length: float, point: list[float], folder: str
) -> pd.DataFrame:
    """Published rows checked, in the program frame and on the vehicle's reference length.

    Parameters
    ----------
    runs : Rows of a campaign; ``coefficient`` and ``value`` in published ones.
    vehicle : Its term set decides which coefficients there are.
    frame : The campaign's.
    length : Reference length of the published values [m].
    point : Moment point from the vehicle's origin [m].
    folder : For messages.

    Returns
    -------
    ``runs`` with ``value`` turned and renormalised.

    Raises
    ------
    InputError
        For a coefficient the vehicle's set does not have, one that is tabulated, a row of
        another test with a coefficient, or moments about another point, or a frame
        with x aft.
    """
    chosen = (runs["coefficient"] != "") | (runs["test"] == TEST) | runs["value"].notna()
    terms = {t.name: t for t in vehicle_terms(vehicle)}
    out = runs.copy()
    for i, run in runs[chosen].iterrows():
        place = f"{folder}/{run['file']}, row {run['row']}"
        if run["test"] != TEST:
            raise InputError(f"{place}, column coefficient or value", "not blank", f"blank but for {TEST} rows")
        given = [o for o in (*OUTPUTS, "KT", "KQ", "t") if pd.notna(run[o])]
        if given:
            raise InputError(f"{place}, column {given[0]}", str(run[given[0]]), f"nothing but value in a {TEST} row")
        term = _term(run, terms, place)
        if frame.signs["x"] < 0:
            # Is Z_w there a factor of U w or of u w, with u < 0? Sources differ.
            raise InputError(f"{place}, frame x", "aft", "published derivatives in a frame with x forward")
        if any(point):
            text = "published derivatives about the vehicle's origin: one alone cannot be moved"
            raise InputError(f"{place}, moment point", f"{math.hypot(*point):g} m from it", text)
        ratio = length / vehicle.particulars.length.value
        factor = ratio**term.power if term.norm == "rho/2 L" else 1.0
        out.loc[i, "value"] = run["value"] * turn_sign(term, frame) * factor
    return out
