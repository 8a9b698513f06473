"""How the numbers of a version came to be: what was done to the runs before they were fitted."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ident.captive.other_loads import tare_applies
from ident.captive.run_table import MOTION
from ident.timeseries.reduction import ERROR, TRANSIENT
from sim.boat.catalogue import OUTPUTS
from sim.boat.vehicle import Vehicle
from sim.files.frames import PROGRAM, SENSES

if TYPE_CHECKING:
    from ident.captive.campaign import Campaign

_TURNED = (*OUTPUTS, *MOTION)
# Keys of a source that are kept where they are stated.
_STATED = (
    "table",
    "axes",
    "moment_axes",
    "moments_about",
    "factor",
    "missing",
    "words",
    "plus_minus",
    "marks",
    "reference",
    "cofr",
    "vehicle_origin",
    "within",
    "match",
    "deduction",
    "grids",
)


def conversions(campaign: Campaign) -> dict[str, Any]:
    """Every conversion of a campaign with its numbers, as stored with a version.

    Parameters
    ----------
    campaign : As read.

    Returns
    -------
    JSON content, keys in the order of ``ident.captive.conversions``: ``vehicle``, ``sources`` and ``histories``
    (reduction), ``tare``, ``frame``, ``moment_point``, ``inertia``, ``half_model``, ``scale``,
    ``fluid``, ``uncertainty``; as in ``campaign.toml``, model scale and campaign frame, with
    how many runs each concerns and which components changed sign.
    """
    if campaign.members:
        first, *_ = campaign.members.values()
        return conversions(first) | {"campaigns": _of_members(campaign)}
    header, runs = campaign.header, campaign.runs
    data = header.model_dump(mode="json")
    frame = header.frame.frame
    tares = [
        one | {"runs": int(tare_applies(runs, tare).sum())} for one, tare in zip(data["tare"], header.tare, strict=True)
    ]
    inertia = data["inertia"]
    if header.inertia.model_inertia_in_loads:
        inertia |= {"runs": int(runs["part"].isin(header.inertia.parts).sum())}
    return {
        "vehicle": vehicle_stated(campaign.vehicle),
        "sources": [
            {k: one[k] for k in ("files", "rows", "normalisation", "rho_inf", "reduction", "subtract")}
            | {k: one[k] for k in _STATED if one[k]}
            for one in data["source"]
        ],
        "histories": [{"run_id": r.run_id, "file": r.file, "reduction": r.words()} for r in campaign.reduced],
        "tare": tares,
        "frame": {k: v for k, v in data["frame"].items() if k != "moment_axes" or v}
        | {
            "rotations": frame.rotations or SENSES[0],
            "to": str(PROGRAM),
            "changed_sign": [q for q in _TURNED if frame.sign(q) < 0],
            "beta_changed_sign": header.frame.angles == "ittc",
        },
        "moment_point": data["moment_point"],
        **({"motion_point": data["motion_point"]} if data["motion_point"] else {}),
        "inertia": inertia,
        "half_model": data["half_model"],
        **({"hydrostatics": data["hydrostatics"]} if data["hydrostatics"] else {}),
        **({"absent": data["absent"]} if data["absent"] else {}),
        "scale": data["scale"],
        "fluid": data["fluid"],
        "uncertainty": data["uncertainty"],
    }


def vehicle_stated(vehicle: Vehicle) -> dict[str, Any]:
    """The vehicle file that a version was made with, in the program frame; of files beside it, their names.

    Parameters
    ----------
    vehicle : As read.
    """
    data = vehicle.model_dump(mode="json", exclude_none=True)
    return data | {k: Path(data[k]).name for k in ("geometry", "errata", "terms") if k in data}


def _of_members(campaign: Campaign) -> dict[str, Any]:
    """Conversions of each of several campaigns, by its name."""
    return {name: conversions(one) for name, one in campaign.members.items()}


def run_sources(campaign: Campaign) -> dict[str, Any]:
    """File, row and source of every run, as stored with a version.

    Parameters
    ----------
    campaign : As read.

    Returns
    -------
    JSON content: ``files`` and ``sources``, each text once, and ``runs``, run id -> place in
    ``files``, row, place in ``sources``.
    """
    runs = campaign.runs
    if runs.empty:
        return {"files": [], "sources": [], "runs": {}}
    told = runs["source"].fillna("").astype(str)
    files, sources = (list(dict.fromkeys(column)) for column in (runs["file"].astype(str), told))
    file_at, source_at = ({text: i for i, text in enumerate(texts)} for texts in (files, sources))
    every = zip(runs["run_id"], runs["file"].astype(str), runs["row"], told, strict=True)
    return {
        "files": files,
        "sources": sources,
        "runs": {str(i): [file_at[f], int(r), source_at[s]] for i, f, r, s in every},
    }


def steps(stored: dict[str, Any]) -> list[tuple[str, str]]:
    """What ``conversions`` stored, in words.

    Parameters
    ----------
    stored : From the metadata of a version; empty for a version written before it was kept.

    Returns
    -------
    Step and what was done, in the order it was done.
    """
    if not stored:
        return []
    if "campaigns" in stored:
        return [(f"{name}: {step}", text) for name, one in stored["campaigns"].items() for step, text in steps(one)]
    return [
        ("Files", _sources(stored["sources"])),
        *_subtract(stored["sources"]),
        *_reduction(stored["sources"], stored["histories"]),
        ("Tare", _tare(stored["tare"])),
        *_frame(stored["frame"]),
        ("Moments", _moments(stored["moment_point"])),
        *_motions(stored.get("motion_point")),
        ("Model's own inertia", _inertia(stored["inertia"])),
        ("Half model", _half(stored["half_model"])),
        *_hydrostatics(stored.get("hydrostatics")),
        ("Scale", _scale(stored["scale"], stored["fluid"])),
        ("Standard errors", f"floor {stored['uncertainty']['floor']:g}; {stored['uncertainty']['source']}"),
    ]


def _sources(sources: list[dict[str, Any]]) -> str:
    """The files, and how their dimensionless columns were made dimensional."""
    if not sources:
        return "one table of runs a test, loads with their units"
    texts = []
    for one in sources:
        text = f"{one['files']}: " + ("a history a run" if one["rows"] == "history" else "a row a run")
        text += f", dimensionless by {one['normalisation']}" if one["normalisation"] else ""
        text += f", rhoInf {one['rho_inf']:g}" if one["rho_inf"] else ""
        texts.append(text + "".join(f", {k} {one[k]}" for k in _STATED if one.get(k)))
    return "; ".join(texts)


def _subtract(sources: list[dict[str, Any]]) -> list[tuple[str, str]]:
    """What was measured of parts and taken off the total; a version from before has none."""
    texts = []
    for source in sources:
        for one in source.get("subtract", []):
            columns = ", ".join(f"{name} ({load})" for name, load in one["columns"].items())
            at = f", at ({', '.join(f'{x:g}' for x in one['at_m'])}) m" if one["at_m"] else ""
            texts.append(f"{source['files']}: {one['what']}, {one['factor']:g} times {columns}{at} ({one['source']})")
    return [("Parts taken off", "; ".join(texts))] if texts else []


def _reduction(sources: list[dict[str, Any]], histories: list[dict[str, str]]) -> list[tuple[str, str]]:
    """Settings of each source that is reduced, and the verdict on each history."""
    texts = []
    for one in sources:
        if one["reduction"]:
            settings = {k: v for k, v in one["reduction"].items() if v not in (None, 0.0)}
            texts.append(f"{one['files']}: " + ", ".join(f"{k} {v}" for k, v in settings.items()))
    rows = [("Reduction", "; ".join(texts))] if texts else []
    if histories:
        method = f"start-up transient {TRANSIENT}, standard error {ERROR}"
        rows.append(("Histories reduced", f"{len(histories)}; {method}"))
    return rows + [(one["run_id"], one["reduction"]) for one in histories]


def _tare(tares: list[dict[str, Any]]) -> str:
    texts = []
    for one in tares:
        loads = [f"{k} {v}" for k, v in one["loads"].items()]
        loads += [f"{k} {v:g} U^2" for k, v in one["per_speed_squared"].items()]
        texts.append(f"{one['what']} taken off {one['runs']} runs: {', '.join(loads)} ({one['source']})")
    return "; ".join(texts) or "none taken off"


def _frame(frame: dict[str, Any]) -> list[tuple[str, str]]:
    axes = ", ".join(f"{a} {frame[a]}" for a in "xyz")
    changed = " ".join(frame["changed_sign"])
    angles = {
        "flight": "flight: beta = asin(v/U), positive with starboard windward; taken over",
        "ittc": "ittc: the ship's drift angle, positive with port windward; beta changed sign",
    }
    return [
        (
            "Axes",
            f"{axes}; turned to {frame['to']}: " + (f"{changed} changed sign" if changed else "nothing changed sign"),
        ),
        ("Rotations", f"{frame['rotations']} about these axes"),
        ("Angles", angles[frame["angles"]]),
        *([("Loads along", f"the {frame['axes']}, turned to the body")] if frame.get("axes", "body") != "body" else []),
        *([("Moments along", f"the {frame['moment_axes']}")] if frame.get("moment_axes") else []),
    ]


def _moments(point: dict[str, Any]) -> str:
    place = [point[k] for k in ("x_m", "y_m", "z_m")]
    shown = ", ".join(f"{x:g}" for x in place)
    moved = f"moved to the vehicle's origin from ({shown}) m" if any(place) else "about the vehicle's origin: not moved"
    return f"{moved}; {point['about']}"


def _motions(point: dict[str, Any] | None) -> list[tuple[str, str]]:
    if point is None:
        return []
    shown = ", ".join(f"{point[k]:g}" for k in ("x_m", "y_m", "z_m"))
    return [("Motions", f"of turning runs taken to the vehicle's origin from ({shown}) m; {point['about']}")]


def _inertia(inertia: dict[str, Any]) -> str:
    if not inertia["model_inertia_in_loads"]:
        return "not in the loads: nothing added back"
    centre, tensor = (", ".join(f"{x:g}" for x in inertia[k]) for k in ("centre_of_gravity_m", "tensor_kgm2"))
    text = f"measured = water - m a, so m a added to {inertia['runs']} runs of {' '.join(inertia['parts'])}"
    text += f": m = {inertia['mass_kg']:g} kg"
    return f"{text}, centre of gravity ({centre}) m, tensor ({tensor}) kg m2; {inertia['source'] or 'no source'}"


def _half(half: dict[str, Any] | None) -> str:
    return f"{half['plane']}: loads doubled ({half['source']})" if half else "no: the whole body was tested"


def _hydrostatics(load: dict[str, Any] | None) -> list[tuple[str, str]]:
    if not load:
        return []
    centre = ", ".join(f"{x:g}" for x in load["centre_m"])
    text = f"{load['force_n']:g} N upwards at ({centre}) m taken off {' '.join(load['parts'])}, body {load['attitude']}"
    return [("Hydrostatic load", f"{text}; {load['source']}")]


def _scale(scale: dict[str, Any], fluid: dict[str, Any]) -> str:
    ratio = f"1:{scale['ratio']:g} by Froude's law to full scale" if scale["ratio"] != 1.0 else "1:1, as tested"
    draught = f", draught {scale['draught_m']:g} m" if scale["draught_m"] else ""
    water = f"density {fluid['density_kgpm3']:g} kg/m3 ({fluid['source']})"
    return f"{ratio}; length {scale['length_m']:g} m{draught}; {water}"
