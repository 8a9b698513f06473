"""`ident new`: write the starter files into a folder."""

from __future__ import annotations

import os
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from ident.output import check_folder, is_left, whole
from sim.files.errors import InputError


def _every(folder: Traversable, place: Path) -> list[tuple[Path, Traversable]]:
    """Every file at or below a folder of the package, with where it goes."""
    files: list[tuple[Path, Traversable]] = []
    for one in sorted(folder.iterdir(), key=lambda entry: entry.name):
        if one.is_dir():
            files += _every(one, place / one.name)
        elif not one.name.startswith((".", "__")):
            files.append((place / one.name, one))
    return files


def _is_begun(place: Path, every: dict[Path, Traversable]) -> bool:
    """Whether a folder holds a part of the starter files as they are, as a command that was killed leaves it."""
    there = [p for p in place.rglob("*") if not p.is_dir()]
    done = [p for p in there if p in every and p.read_bytes() == every[p].read_bytes()]
    left = [p for p in there if is_left(p)]
    return len(done) < len(every) and len(done) + len(left) == len(there)


def write_starter(folder: str | os.PathLike[str]) -> tuple[Path, ...]:
    """Write a commented boat, campaign, case, trial and calibration, to be changed into your own.

    The boat is invented; its captive loads are computed from known coefficients with 2 % noise, and
    its trial is the same boat flown with them.

    Parameters
    ----------
    folder : New or empty folder, or one that a killed ``ident new`` began.

    Returns
    -------
    tuple of pathlib.Path
        The files: ``my-boat.toml`` (vehicle), ``captive/campaign.toml`` with its runs,
        ``zigzag.toml`` (case) with ``zigzag_trial.csv``, ``calibration.toml``.

    Raises
    ------
    InputError
        When the folder is not empty or cannot be written to.

    Examples
    --------
    >>> import ident
    >>> written = ident.write_starter("new-boat")
    >>> (done,) = ident.fit("new-boat/captive", db="new-boat/db")
    >>> ident.validate("new-boat/zigzag.toml", db="new-boat/db").passed
    True
    """
    place = Path(folder)
    check_folder(place)
    every = _every(files("ident") / "starter" / "files", place)
    if place.is_dir() and any(place.iterdir()) and not _is_begun(place, dict(every)):
        raise InputError(str(place), "a folder that is not empty", "a new or empty folder: nothing is overwritten")
    written = []
    for path, source in every:
        with whole(path) as part:
            part.write_bytes(source.read_bytes())
        written.append(path)
    return tuple(written)
