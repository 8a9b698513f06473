"""A folder of users' own cases, in which their vehicle, campaign or calibration may lie beside them."""

from __future__ import annotations

from pathlib import Path

from sim.files.errors import InputError
from sim.files.toml_files import read_toml

# What no file of that kind is without, and no case has.
KINDS = {
    "vehicle": ("term_set", "particulars"),
    "campaign": ("facility", "moment_point"),
    "calibration": ("training", "group"),
    "geometry": ("parts", "origin"),
}

# Without these there is no case.
_OF_A_CASE = ("vehicle", "environment", "run", "command")


def kind_of(path: Path) -> str:
    """``vehicle``, ``campaign``, ``calibration``, ``geometry``, ``trial``; ``case`` for everything else.

    Raises
    ------
    InputError
        For a file that is not TOML.
    """
    data, _ = read_toml(path, "")
    if (kind := next((kind for kind, keys in KINDS.items() if set(keys) <= set(data)), "")) != "":
        return kind
    from ident.trials.spec import TrialFile

    # Every key of a trial file may be left out, and none of these.
    told = data and set(data) <= set(TrialFile.model_fields) and not set(_OF_A_CASE) & set(data)
    return "trial" if told else "case"


def in_folder(folder: Path) -> tuple[list[str], dict[str, str]]:
    """Cases of a folder, and the files that declare themselves something else with what they are.

    A file that is neither is a case: what is wrong with it is said when it is read.

    Raises
    ------
    InputError
        When the folder does not exist or holds no case, or a file is not TOML.
    """
    every = sorted(folder.glob("*.toml")) if folder.is_dir() else []
    kinds = {str(path): kind_of(path) for path in every}
    cases = [name for name, kind in kinds.items() if kind == "case"]
    others = {name: kind for name, kind in kinds.items() if kind != "case"}
    if not cases:
        beside = ", ".join(f"{Path(name).name} (a {kind})" for name, kind in others.items())
        seen = f"no case file beside {beside}" if others else "no case file"
        raise InputError(str(folder), seen, "a folder with case files (*.toml)")
    return cases, others
