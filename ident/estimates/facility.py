"""Errors that runs have in common, and what a small resultant hides.

Standard errors of runs average out over runs; the error of one grid, one balance or one normalisation does not. The
campaign says which there are (``[[shared_error]]``). One unknown a load component is shared by all its values.
"""

from __future__ import annotations

import numpy as np

from ident.estimates.draft import Draft, Mask, NotApplicable
from ident.estimates.turning import Given, Shared
from sim.boat.parts import vehicle_terms
from sim.files.errors import InputError

# Share of the change of axial force by drift that may not be there.
_SUCTION = 0.5
# Factors of a term whose coefficient is a prime load.
_DYNAMIC_PRESSURE = (("U", "U"), ("u", "u"))


def shared_errors(draft: Draft, given: Given) -> str:
    """Errors that the campaign says its runs share.

    Raises
    ------
    NotApplicable
        When it says none.
    InputError
        For an offset of a load that the runs give no coefficient of.
    """
    if not given.shared:
        raise NotApplicable("the campaign states no error that its runs share")
    runs = [frozenset(str(text).split()) for text in draft.rows["runs"]]
    said = []
    for one in given.shared:
        chosen = np.array([bool(r) and (not one.runs or bool(r & one.runs)) for r in runs])
        if one.relative is None:
            said.append(_offset(draft, one, chosen))
        else:
            _relative(draft, one, one.relative, chosen)
            said.append(f"{one.name} {100.0 * one.relative:.0f} %")
    return ", ".join(said)


def _relative(draft: Draft, one: Shared, relative: float, chosen: Mask) -> None:
    """An error in proportion to the values."""
    output = draft.rows["output"].to_numpy()
    for name in sorted(set(output[chosen]) - {""}):
        if one.outputs and name not in one.outputs:
            continue
        # Side force, yaw and roll of one flow are wrong by one factor.
        unknown = f"shared {one.name}" + ("" if one.outputs else f" {name}")
        draft.spread(unknown, np.where(chosen & (output == name), relative * draft.value, 0.0))


def _offset(draft: Draft, one: Shared, chosen: Mask) -> str:
    """A prime load that all runs may lack, of one unknown; coefficients that are such loads themselves move by it."""
    steady = {term.name for term in vehicle_terms(draft.vehicle) if term.factors in _DYNAMIC_PRESSURE}
    loads = np.array([name in steady for name in draft.names])
    output = draft.rows["output"].to_numpy()
    for name, prime in one.offset.items():
        moved = chosen & loads & (output == name)
        if not moved.any():
            text = f"no coefficient of these runs is a prime load {name}"
            raise InputError(f"key shared_error.offset of {one.name}", text, "loads that the tests identify")
        draft.spread(f"shared {one.name}", np.where(moved, prime, 0.0))
    return f"{one.name} {' '.join(f'{name} {prime:+.1e}' for name, prime in one.offset.items())}"


def axial_in_drift(draft: Draft) -> str:
    """Error of the axial force in drift: half of what drift changes in it.

    It is the small resultant of pressures that drift makes large: suction at the nose and at the leading edge of the
    sail against the drag of the separated side. How much of the suction separation leaves is not known, and a
    relative error of the resultant says nothing of it.

    Raises
    ------
    NotApplicable
        Without axial force in drift.
    """
    rows, beta = draft.rows, draft.axis("beta")
    drift = draft.where(["X_uvw"]) & (beta != 0.0)
    if not drift.any():
        raise NotApplicable("no axial force in drift")
    change = np.zeros(len(rows))
    ahead = draft.where(["X_uvw"]) & (beta == 0.0) & (draft.axis("alpha") == 0.0)
    for i in np.flatnonzero(drift):
        same = ahead & (rows["speed_mps"] == rows["speed_mps"].iloc[i]) & (rows["depth_m"] == rows["depth_m"].iloc[i])
        if same.any():
            change[i] = _SUCTION * (draft.value[i] - float(np.mean(draft.value[same.to_numpy()])))
    draft.spread("axial force in drift", change)
    return "half of what drift changes"
