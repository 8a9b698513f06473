"""What each estimate changes alone: the table of docs/prediction.md, flown case by case."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from reference_tables import table

from ident.captive.campaign import Campaign
from ident.estimates.draft import measured_rows
from ident.estimates.predict import methods, predicted
from ident.estimates.turning import Given
from ident.fitting.fit import given_of
from ident.validation.board import geometric_mean
from ident.validation.boats import Boat, Fleet
from ident.validation.result import Validation
from ident.validation.validate import errors, flights, validated
from sim.boat.coefficients import Coefficients
from sim.files.toml_files import bundled
from sim.flight.case import load_case

VEHICLE = "bb2"


def choices(db: str, campaign: Campaign) -> str:
    """Geometric means of the error ratios to the published model, by case and over all, for each choice.

    Parameters
    ----------
    db : Database whose latest version of the vehicle is the predicted one.
    campaign : The vehicle's, for what estimates need beside the rows.
    """
    fleet = Fleet(db)
    names = [n for n in bundled("cases") if load_case(n)[0].vehicle == VEHICLE and load_case(n)[0].reference]
    held = [one for one in (validated(n, fleet) for n in names) if one.errors]
    base, given = held[0].boat, given_of(campaign)
    rows, every = measured_rows(base.rows), {m.name for m in methods()}

    def flown(without: Collection[str] = (), told: Given = given) -> dict[str, float]:
        made = predicted(base.vehicle, rows, told, without)[0]
        return ratios(held, Boat(base.vehicle, made, base.commit, Coefficients(base.vehicle, made)))

    whole, none = flown(), flown(every)
    found = {"measured only": none, "predicted": whole}
    for name in (m.name for m in methods()):
        found[f"predicted without `{name}`"] = flown({name})
        found[f"measured only with `{name}`"] = flown(every - {name})
    found["predicted, nothing taken off by the source (5.2.5)"] = flown(told=replace(given, pure_yaw=(0.0, 0.5)))
    found["predicted, all taken off by the source (A4)"] = flown(told=replace(given, pure_yaw=(1.0, 0.5)))
    kept = [k for k, v in found.items() if k in ("measured only", "predicted") or v not in (none, whole)]
    order = sorted(kept, key=lambda k: (k.startswith("measured only with"), list(found).index(k)))
    lines = [[k, *(f"{x:.2f}" for x in found[k].values())] for k in order]
    return table(["", *whole], lines)


def ratios(held: list[Validation], boat: Boat) -> dict[str, float]:
    """Geometric means by case and reference, then over all channels; those without a published model are left out."""
    by_case: dict[str, list[float]] = {}
    for one in held:
        for source, channels in errors(one.case, one.reference, *flights(one.case, boat)).items():
            by_case.setdefault(f"{one.case.name} {source}", []).extend(e.ratio for e in channels.values() if e.ratio)
    known = {name: found for name, found in by_case.items() if found}
    every = [ratio for found in known.values() for ratio in found]
    return {name: geometric_mean(found) or 0.0 for name, found in known.items()} | {"all": geometric_mean(every) or 0.0}


def main() -> None:
    """Print the table of the campaign as it lies."""
    import tempfile
    from pathlib import Path

    import ident

    with tempfile.TemporaryDirectory() as folder:
        db = str(Path(folder) / "db")
        fitted = ident.fit(Path(__file__).resolve().parents[1] / "raw_captive_data" / VEHICLE, db)[0]
        print(choices(db, fitted.campaign))


if __name__ == "__main__":
    main()
