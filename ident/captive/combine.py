"""Several campaigns of one boat (tank, rotating arm, CFD) as one table of runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from ident.captive.campaign import Campaign
from ident.captive.campaign_file import Quality
from ident.captive.run_table import sigma
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError


def by_vehicle(campaigns: Sequence[Campaign], paths: Sequence[Path]) -> tuple[list[Campaign], list[Path]]:
    """Campaigns of the same vehicle put together, in the order of the first of each.

    Returns
    -------
    campaigns : One a vehicle.
    paths : Their folders; the folder above those of several.

    Raises
    ------
    InputError
        As ``combined``.
    """
    groups: dict[str, list[int]] = {}
    for k, one in enumerate(campaigns):
        groups.setdefault(one.vehicle.name, []).append(k)
    made, places = [], []
    for group in groups.values():
        made.append(combined([campaigns[k] for k in group], [paths[k] for k in group]))
        places.append(paths[group[0]] if len(group) == 1 else paths[group[0]].parent)
    return made, places


def combined(campaigns: Sequence[Campaign], paths: Sequence[Path]) -> Campaign:
    """One campaign of the runs of several, each turned by its own frame, scale, moment point and errors.

    Loads are brought to the density of the first campaign's water. Names of runs and files have the
    campaign's folder before them; quality words of the same name have to mean the same factor.

    Parameters
    ----------
    campaigns : Of one vehicle, from ``read_campaign``.
    paths : Their folders.

    Returns
    -------
    The first header with the names of all; ``members`` are the campaigns, and the column
    ``campaign`` of the runs the folder each is from.

    Raises
    ------
    InputError
        For vehicles that are not the same, or a quality word with two factors.
    """
    first = campaigns[0]
    if len(campaigns) == 1:
        return first
    names = _names(paths)
    quality: dict[str, Quality] = {}
    tables: list[pd.DataFrame] = []
    digests: dict[str, str] = {}
    for name, path, one in zip(names, paths, campaigns, strict=True):
        _same_vehicle(first, one, path)
        for word, stated in one.header.quality.items():
            if word in quality and quality[word].factor != stated.factor:
                wrong = f"{word!r} with factor {stated.factor:g}, {quality[word].factor:g} in {paths[0]} or another"
                raise InputError(f"{path / 'campaign.toml'}, key quality", wrong, "one factor a word, or another word")
            quality.setdefault(word, stated)
        tables.append(_table(one, name, first.header.fluid.density_kgpm3))
        digests |= {f"{name}/{file}": digest for file, digest in one.digests.items()}
    header = first.header.model_copy(
        update={
            "name": " + ".join(one.header.name for one in campaigns),
            "facility": " + ".join(dict.fromkeys(one.header.facility for one in campaigns)),
            "provenance": "\n".join(one.header.provenance.strip() for one in campaigns),
            "quality": quality,
        }
    )
    reduced = tuple(
        replace(h, run_id=f"{n}/{h.run_id}", file=f"{n}/{h.file}")
        for n, c in zip(names, campaigns, strict=True)
        for h in c.reduced
    )
    refused = tuple(one for c in campaigns for one in c.refused)
    runs = pd.concat(tables, ignore_index=True)
    for text in ("copy_of", "exclude", "reason", "reduction", "coefficient", "unit", "decoupled", "notes"):
        runs[text] = runs[text].fillna("").astype(str)
    members = dict(zip(names, campaigns, strict=True))
    return replace(first, header=header, runs=runs, digests=digests, reduced=reduced, refused=refused, members=members)


def _names(paths: Sequence[Path]) -> list[str]:
    names = [path.resolve().name for path in paths]
    return names if len(set(names)) == len(names) else [str(path) for path in paths]


def _same_vehicle(first: Campaign, one: Campaign, path: Path) -> None:
    mine, other = first.vehicle.model_dump(), one.vehicle.model_dump()
    different = sorted(k for k in mine if mine[k] != other[k] and k not in ("source", "title", "geometry"))
    if different:
        wrong = f"vehicle {one.vehicle.name!r} with another {different[0]} than {first.header.name}'s"
        text = "one vehicle file for all campaigns of a boat: scale and moment point of a campaign are its own"
        raise InputError(f"{path / 'campaign.toml'}, key vehicle", wrong, text)


def _table(one: Campaign, name: str, density: float) -> pd.DataFrame:
    """Runs of a campaign under its name, loads in water of the given density."""
    runs = one.runs.copy()
    ratio = density / one.header.fluid.density_kgpm3
    for output in OUTPUTS:
        for column in (output, sigma(output)):
            if column in runs:
                runs[column] = runs[column] * ratio
    runs["campaign"] = name
    runs["run_id"] = name + "/" + runs["run_id"].astype(str)
    runs["copy_of"] = (name + "/" + runs["copy_of"].astype(str)).where(runs["copy_of"] != "", "")
    for column in ("file", "files"):
        if column in runs:
            runs[column] = name + "/" + runs[column].astype(str)
    return runs
