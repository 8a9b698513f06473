"""Function objects of an OpenFOAM case as histories: moment point, density, a body that moves in the mesh."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ident.captive.campaign_file import CampaignFile
from ident.captive.channels import Channels, Moving, Pieces
from ident.captive.moving import moving_body
from ident.captive.readers import openfoam
from ident.captive.source import Source
from sim.files.errors import InputError


def foam_channels(
    path: Path, source: Source, header: CampaignFile, numbers: dict[str, float], where: str
) -> Iterator[tuple[str, Channels]]:
    """The function objects of an OpenFOAM case, each the history of one part."""
    if source.rho_inf is None:
        text = "the rhoInf of the function object: 1 for kinematic loads, or the density it used"
        raise InputError(f"{where}, key source.rho_inf", "nothing", text)
    if not path.is_dir():
        raise InputError(str(path), "a file", "a case folder, its postProcessing, or one function object in it")
    try:
        by_name = openfoam.objects(path)
    except OSError as error:
        raise InputError(str(path), f"cannot be read: {error.strerror}", "a readable folder") from error
    if not by_name:
        others = sorted({p.name for p in path.glob("**/*.dat")})[:5]
        seen = f", only {', '.join(others)}" if others else ""
        text = "postProcessing/<function object>/<start>/forces.dat or force.dat; coefficients are not read"
        raise InputError(str(path), f"no output of forces{seen}", text)
    for name in source.parts:
        if name not in by_name:
            raise InputError(str(path), f"no function object {name!r}", ", ".join(by_name))
    twice = [part for part in source.parts.values() if list(source.parts.values()).count(part) > 1]
    if twice:
        text = "one function object a part: it sums the patches that it is given"
        raise InputError(f"{where}, key source.parts", f"{twice[0]!r} twice", text)
    chosen = source.parts or (dict.fromkeys(by_name, "") if len(by_name) == 1 else {})
    if not chosen:
        text = f"[source.parts] naming the part of each: {', '.join(by_name)}"
        raise InputError(str(path), f"{len(by_name)} function objects", text)
    for name, part in chosen.items():
        pieces = _pieces(by_name[name], source, header, where)
        moving = _moving(by_name[name], source, header, numbers, where)
        yield part, Channels(path, ["time", *openfoam.LOADS], pieces, moving=moving)


def _moving(folder: Path, source: Source, header: CampaignFile, numbers: dict[str, float], where: str) -> Moving | None:
    """What a moving body asks for: its CofR stays in the header where the file has no column for it."""
    rule = source.reduction
    if rule is None or rule.kind != "oscillatory":
        return None
    if rule.motion in ("roll", "pitch", "yaw") and not source.axes and "axes" not in header.frame.model_fields_set:
        text = "tank where the body turns in the mesh (the loads are along the mesh's axes), body where it does not"
        raise InputError(f"{where}, key source.axes", f"nothing, and a motion of {rule.motion}", text)
    moves = next((m for _, _, m in openfoam.loads(folder, source.cofr)), False)
    if moves and source.moments_about == "fixed":
        raise InputError(
            f"{where}, key source.moments_about", "'fixed'", "nothing: the file's CofR moves with the body"
        )
    about = "body" if moves else source.moments_about or "fixed"
    return moving_body(list(openfoam.LOADS), source, header, numbers, about, where)


def _pieces(folder: Path, source: Source, header: CampaignFile, where: str) -> Pieces:
    """Starts reading one function object: SI, moments about the campaign's point."""
    density = header.fluid.density_kgpm3 / float(source.rho_inf or 1.0)
    factors = np.ones(7)
    for name, value in source.factor.items():
        if name not in openfoam.LOADS:
            raise InputError(f"{where}, key source.factor.{name}", "no load of the file", ", ".join(openfoam.LOADS))
        factors[1 + openfoam.LOADS.index(name)] = value
    point = header.moment_point
    origin = source.vehicle_origin

    def pieces() -> Iterator[np.ndarray]:
        fixed = None
        for values, centre, moving in openfoam.loads(folder, source.cofr):
            if not moving:
                if fixed is not None and (centre != fixed).any():
                    raise InputError(str(folder), f"CofR {fixed} and {centre}", "one moment point in all restarts")
                fixed = centre
            elif origin is not None:
                text = "no vehicle_origin: a moving CofR is the body's moment point"
                raise InputError(str(folder), "CofR moves", text)
            out = values * factors
            if origin is not None:
                arm = centre - np.array(origin) - np.array([point.x_m, point.y_m, point.z_m])
                out[:, 4:] += np.cross(np.broadcast_to(arm, (len(out), 3)), out[:, 1:4])
            out[:, 1:] *= density
            yield out

    return pieces
