"""``campaign.toml`` of a matrix: every run a ``[[source]]`` that reads its case as it is."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ident.captive.campaign_file import CampaignFile
from ident.cfd.case import Case
from ident.cfd.motions import motion_word
from ident.cfd.template import Template, settings
from sim.boat.vehicle import Vehicle
from sim.files.extras import library
from sim.files.schema import checked
from sim.files.temporary import take_place

_UNITS = {"U": "mps", "D0": "m", "alpha": "deg", "beta": "deg", "plane": "deg"}
# Motions whose displacement is an angle.
_TURNS = ("pdot", "qdot", "rdot")


def write_campaign(out: Path, cases: Sequence[Case], vehicle: Vehicle, vehicle_file: str, template: Template) -> None:
    """Write ``campaign.toml``, checked by the schema that will read it.

    Parameters
    ----------
    out : Folder of the matrix.
    cases : All of them.
    vehicle, vehicle_file : The boat, and its bundled name or a path.
    template : Density, scale, errors.
    """
    tomli_w = library("tomli_w", "cfd", "cases", "tomli-w")
    path = out / "campaign.toml"
    data = header(out, vehicle, vehicle_file, template)
    data["source"] = [source(case, template) for case in cases]
    checked(CampaignFile, data, str(path))
    first = "# Written by ident plan --cases: each [[source]] reads one case of cases/; runs to come are awaited.\n"
    # A further batch reads this file and writes it anew: it takes its own place.
    new = path.with_name(".campaign.new.toml")
    try:
        new.write_text(first + tomli_w.dumps(data), encoding="utf-8")
        take_place(new, path)
    finally:
        new.unlink(missing_ok=True)


def header(out: Path, vehicle: Vehicle, vehicle_file: str, template: Template) -> dict[str, Any]:
    """Everything but the sources."""
    named = vehicle_file
    if vehicle_file.endswith(".toml"):
        named = Path(os.path.relpath(Path(vehicle_file).resolve(), out.resolve())).as_posix()
    ratio, flow = template.surface.ratio, template.flow
    around = "a plane of symmetry at the water's surface" if flow.free_surface == "double_body" else "unbounded water"
    return {
        "name": f"{vehicle.name}-openfoam",
        "vehicle": named,
        "facility": f"OpenFOAM {template.openfoam}",
        "provenance": f"Computed by OpenFOAM {template.openfoam}, {flow.turbulence}, {around}.",
        "frame": {"x": "forward", "y": "starboard", "z": "down", "angles": "flight", "axes": "body"},
        "moment_point": {"x_m": 0.0, "y_m": 0.0, "z_m": 0.0, "about": "the vehicle's origin"},
        "scale": {"ratio": ratio, "length_m": vehicle.particulars.length.value / ratio},
        "fluid": {"density_kgpm3": template.fluid.density_kgpm3, "source": template.fluid.source},
        "inertia": {"model_inertia_in_loads": False},
        "uncertainty": {"floor": template.uncertainty.floor, "source": template.uncertainty.source},
        "quality": {"computed_here": {"factor": 1.0, "meaning": "computed by a case of this folder"}},
    }


def source(case: Case, template: Template) -> dict[str, Any]:
    """``[[source]]`` of one case."""
    constants: dict[str, Any] = {"run_id": case.run_id, "test": case.test, "quality": "computed_here"}
    constants["source"] = f"OpenFOAM {template.openfoam}, {case.kind}"
    constants |= {_key(name): _number(name, value) for name, value in case.state.items() if not _made(name, case)}
    constants["rel_sigma"] = template.uncertainty.rel_sigma
    made: dict[str, Any] = {
        "files": f"cases/{case.run_id}/{case.grids[0]}/postProcessing",
        "reader": "openfoam",
        "rows": "history",
        "awaited": True,
        "rho_inf": 1.0,
        "parts": {f"forces_{case.part}": case.part},
        "constants": constants,
        "reduction": _reduction(case),
    }
    if case.axes != "body":
        made["axes"] = case.axes
    elif case.frequency_hz:
        made["axes"] = "body"
    if case.towed:
        made["deduction"] = {
            "towed": f"cases/{case.towed}/{case.grids[0]}/postProcessing",
            "thrust_n": case.thrust_n,
            "source": case.thrust_source,
        }
    if len(case.grids) == 3:
        made["grids"] = {"finest": case.grids[0], "coarser": case.grids[1:], "refinement": template.grid.refinement}
    return made


def _made(name: str, case: Case) -> bool:
    """Whether an oscillation's reduction makes the quantity."""
    return bool(case.frequency_hz) and name.endswith("dot")


def _key(name: str) -> str:
    unit = _UNITS.get(name, "radps2" if name in _TURNS else "mps2" if name.endswith("dot") else "radps")
    return f"{name}_{unit}"


def _number(name: str, value: float) -> float:
    """A state in the unit of its key; twelve digits, so that runs of one table point share it."""
    return float(f"{math.degrees(value) if _UNITS.get(name) == 'deg' else value:.14g}") + 0.0


def _reduction(case: Case) -> dict[str, Any]:
    if case.frequency_hz:
        name = next(k for k in case.state if k.endswith("dot") and case.state[k])
        return {
            "kind": "oscillatory",
            "motion": motion_word(name),
            "frequency_hz": case.frequency_hz,
            "amplitude": case.amplitude,
            "phase_deg": 0.0,
            "start_s": 1.0 / case.frequency_hz,
        }
    if case.kind in ("accelerated", "spun"):
        return {"kind": "acceleration", "start_s": settings()["start"] * case.duration}
    return {"kind": "steady", "start_s": float(math.floor((1.0 - settings()["window"]) * case.iterations))}
