"""Terms that no run identifies, by Kirchhoff's equations with the added mass of the version.

A body in an unbounded ideal fluid carries the loads of its impulse (Lamb 1932, arts. 124 to 126)::

    F = - A dv/dt - Omega x P,     M = - ... - Omega x H - v x P,      (P, H) = A (v, Omega)

Each product of a velocity and a rate, or of two rates, has its coefficient in closed form. It is taken for the
width of what is not known, not for the value: the loads of the impulse do no work only together, and runs
hold some of them with what separation makes of them, so that the missing ones added to those would feed the motion
with energy that no flow has.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.estimates.draft import Draft, NotApplicable
from sim.boat.catalogue import OUTPUTS, Term
from sim.boat.coefficients import Coefficients
from sim.boat.parts import vehicle_terms
from sim.files.constants import constant
from sim.kernel.assemble import Environment, added_mass_matrix

Array = NDArray[np.float64]

_MOTIONS = ("u", "v", "w", "p", "q", "r")
# The density cancels: coefficients are over it.
_UNIT = Environment(1.0, constant("standard_gravity"))


def impulse_loads(added: Array, motion: Array) -> Array:
    """Loads of the impulse in steady motion.

    Parameters
    ----------
    added : (6, 6) added mass about the origin.
    motion : (6,) u v w p q r.

    Returns
    -------
    (6,) X Y Z K M N; they do no work, motion @ loads = 0.
    """
    impulse = added @ motion
    v, omega = motion[:3], motion[3:]
    return np.concatenate([-np.cross(omega, impulse[:3]), -np.cross(omega, impulse[3:]) - np.cross(v, impulse[:3])])


def product_load(added: Array, output: str, first: str, second: str) -> float:
    """Coefficient of the product of two components of the motion in one load.

    Example
    -------
    X of v r is minus Y_vdot, the added mass across the boat: with A = diag(0, m, 0, ...),
    ``product_load(A, "X", "v", "r")`` is m.
    """
    i, j, k = _MOTIONS.index(first), _MOTIONS.index(second), OUTPUTS.index(output)
    both, one, other = np.zeros(6), np.zeros(6), np.zeros(6)
    both[[i, j]] = 1.0
    one[i], other[j] = 1.0, 1.0
    loads = [impulse_loads(added, m)[k] for m in (both, one, other)]
    return float(loads[0] - loads[1] - loads[2])


def _product(term: Term) -> tuple[str, str] | None:
    """The two components whose product a term multiplies, a speed across or a rate with a rate; else None."""
    factors = term.factors
    if len(factors) != 2 or not set(factors) <= set(_MOTIONS[1:]) or factors[0] == factors[1]:
        return None
    return (factors[0], factors[1]) if term.part == "hull" and term.output else None


def unmeasured(draft: Draft) -> str:
    """Terms in vp, vq, vr, wp, wq, wr, pq, qr, rp without runs: zero within what potential flow makes of them.

    Raises
    ------
    NotApplicable
        When the version has no added mass of the whole boat, or no such term is missing; and for a set of
        constants, whose authors have said what they leave out.
    """
    if not draft.vehicle.terms_of.tabulated:
        raise NotApplicable(f"the set {draft.vehicle.term_set} is as its authors give it")
    if draft.vehicle.added_mass == "sections" or not draft.has("Y_vdot"):
        raise NotApplicable("no added mass of the whole boat")
    added = added_mass_matrix(Coefficients(draft.vehicle, draft.rows), _UNIT)
    length, diameter = draft.vehicle.particulars.length.value, draft.vehicle.diameter
    depth = float(np.nanmax(draft.axis("D0")))
    names = []
    for term in vehicle_terms(draft.vehicle):
        factors = _product(term)
        if factors is None or draft.has(term.name):
            continue
        value = product_load(added, term.output, *factors) / term.scale(1.0, length, diameter)
        if abs(value) < 1e-9:
            continue
        point = {a: depth if a == "D0" else 0.0 for a in term.axes}
        new = draft.add(term.name, [point], [0.0], f"unmeasured: zero within {abs(value):.2g}")
        draft.spread(f"potential {term.name}", np.where(new, abs(value), 0.0))
        names.append(term.name)
    if not names:
        raise NotApplicable("no term in a product of speed across and rate is missing")
    return f"{', '.join(names)}: zero, each within its value in potential flow"
