"""A version without a term or an estimate: what decides a result."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from ident.estimates.draft import measured_rows
from ident.estimates.predict import names, predicted
from ident.estimates.turning import Given
from sim.boat.delta_log import Version
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


def without(
    vehicle: Vehicle, rows: pd.DataFrame, commit: Version, left_out: Collection[str], where: str
) -> pd.DataFrame:
    """Rows of a version with terms taken out, and with estimates undone.

    Values are those that the version would have; standard errors of what is undone stay those of the version.

    Parameters
    ----------
    vehicle, rows : Of the version.
    commit : That wrote it.
    left_out : Coefficients such as ``N_ur``, and estimates such as ``cross_flow``.
    where : The option, for messages.

    Raises
    ------
    InputError
        For a name that is neither, or an estimate of a version that has none or is calibrated.
    """
    estimates = [name for name in left_out if name in names()]
    terms = [name for name in left_out if name not in names()]
    known = set(rows["coefficient"])
    for name in terms:
        if name not in known:
            raise InputError(where, repr(name), f"a coefficient of the version, or an estimate: {', '.join(names())}")
    if estimates:
        if commit.trained:
            raise InputError(where, "an estimate of a calibrated version", "the version it was calibrated from")
        if rows["measured_value"].isna().all():
            raise InputError(where, "a version of the runs alone", "a version with estimates")
        given = commit.stored("given", {})
        yaw = given.get("pure_yaw")
        stored = Given(
            given.get("speed", {}),
            (yaw[0], yaw[1]) if yaw else None,
            complete=given.get("complete", False),
            propelled=given.get("propelled", False),
        )
        rows, _ = predicted(vehicle, measured_rows(rows), stored, estimates)
    return rows[~rows["coefficient"].isin(terms)].reset_index(drop=True)
