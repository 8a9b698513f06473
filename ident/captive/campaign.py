"""Read a captive campaign: schema check, units, frame, moment point, scale, errors.

A campaign is a folder with ``campaign.toml`` and run files: one CSV a test, or whatever
``[[source]]`` names (see ``docs/readers.md``). It leaves here as one table of runs in the
program frame, SI and radians, with a standard error for every load.
"""

from __future__ import annotations

import glob
import hashlib
import logging
import os
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from ident.captive import published
from ident.captive.axes import to_body
from ident.captive.campaign_file import CampaignFile, read_header
from ident.captive.channels import NotRising
from ident.captive.complete import check_complete, check_parts, check_words
from ident.captive.conversions import (
    arm_rates,
    at_origin,
    deflected_left_out,
    move_moments,
    standard_errors,
    to_full_scale,
    turn,
    turning,
    whole_model,
)
from ident.captive.histories import Reduced
from ident.captive.known_tests import tests
from ident.captive.other_loads import tare_applies, without_hydrostatics, without_inertia, without_tare
from ident.captive.readers.opening import inputs
from ident.captive.run_table import NUMBERS, run_table
from ident.captive.runs import Gathered, source_runs
from ident.captive.source import Source
from ident.cluster import Spread, here
from ident.output import Tell, html_table, silent
from sim.boat.catalogue import OUTPUTS
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files.errors import InputError
from sim.files.frames import Frame
from sim.files.inputs import note

# Further files that one message names.
_SHOWN = 20
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Campaign:
    """A campaign turned to the program frame.

    Attributes
    ----------
    header : The checked ``campaign.toml``.
    vehicle : The vehicle the runs belong to.
    runs : One row a run; columns U, alpha, beta, D0, p..r, accelerations, plane, n, J in
        SI and radians, X..N [N, N m] about the vehicle's origin, s_X..s_N standard errors,
        KT KQ t with s_KT.., ``value`` of a published ``coefficient``, and the text columns
        plus ``file``, ``row`` and ``reduction``.
    digests : SHA-256 of every input file.
    reduced : The time histories that were reduced to runs, for their plots.
    refused : Those that were left out because their time stamps do not rise.
    members : Name -> campaign of several that were put together (``ident.captive.combine``).
    folder : Where it lies, for messages.

    Examples
    --------
    >>> import ident
    >>> campaign = ident.read_campaign("my-boat/captive")
    >>> drift = campaign.runs[campaign.runs["test"] == "drift_horizontal"]
    >>> drift.plot.scatter("beta", "N")  # doctest: +SKIP
    """

    header: CampaignFile
    vehicle: Vehicle
    runs: pd.DataFrame
    digests: dict[str, str] = field(default_factory=dict)
    reduced: tuple[Reduced, ...] = ()
    refused: tuple[NotRising, ...] = ()
    members: dict[str, Campaign] = field(default_factory=dict)
    folder: str = ""

    def __repr__(self) -> str:
        return f"Campaign({self.header.name} of {self.vehicle.name}: {len(self.runs)} runs)"

    def _repr_html_(self) -> str:
        groups = self.runs.groupby(["file", "test", "part"], sort=False)
        rows = [(*key, len(g), " ".join(o for o in OUTPUTS if g[o].notna().any())) for key, g in groups]
        title = f"{self.header.name} of {self.vehicle.title}: {len(self.runs)} runs"
        return html_table(title, ("file", "test", "part", "runs", "loads"), rows)


@cache
def _digest(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(str(path), f"cannot be read: {error.strerror}", "a readable file") from error


def _sources(folder: Path, header: CampaignFile, vehicle: Vehicle, none_yet: bool) -> list[Source]:
    """The sources a campaign declares, else one CSV or Parquet file a test beside it."""
    if header.source:
        return header.source
    # Tables that the vehicle file names are no runs.
    named = [Path(p) for p in (vehicle.terms, vehicle.errata, vehicle.geometry) if p]
    beside = {*header.tables.given().values(), *(p.name for p in named if p.parent.resolve() == folder.resolve())}
    every = sorted(p for p in folder.glob("[!.]*") if p.name not in beside)
    # RUNS.CSV is a table as well: some systems write names in capitals.
    names = [[p.name for p in every if p.suffix.lower() == kind] for kind in (".csv", ".parquet")]
    sources = [Source(files=glob.escape(name)) for kind in names for name in kind]
    if not sources and not none_yet and vehicle.geometry is None:
        allowed = "one CSV a test beside campaign.toml, or [[source]]; without runs, a vehicle with a geometry file"
        raise InputError(str(folder), "no CSV file of runs", allowed)
    return sources


def read_runs(
    folder: Path,
    header: CampaignFile,
    vehicle: Vehicle,
    tell: Tell = silent,
    spread: Spread = here,
    none_yet: bool = False,
) -> tuple[pd.DataFrame, Gathered]:
    """The checked runs of every source, in SI and radians but still in the campaign's frame.

    Parameters
    ----------
    folder : The campaign's.
    header, vehicle : For the sources, the quality vocabulary and the names of the parts.
    tell : Told of every file.
    spread : Reads them.
    none_yet : Whether a folder without files of runs is a campaign whose runs are still to come.

    Returns
    -------
    runs : Those that could be read, in one table.
    gathered : The histories that were reduced or refused, and the files that were read.

    Raises
    ------
    InputError
        Naming file, row, column, what was found and what is allowed.
    """
    gathered = Gathered()
    words = {"test": list(tests().index), "part": vehicle.part_names(), "quality": list(header.quality)}
    for source in _sources(folder, header, vehicle, none_yet):
        for table in source_runs(folder, source, header, gathered, tell, spread):
            check_words(folder, table, {**words, "decoupled": ["", "True", "False"]})
            check_complete(folder, table, vehicle)
            check_parts(folder, table, vehicle)
    runs = pd.concat(gathered.tables, ignore_index=True) if gathered.tables else pd.DataFrame()
    for column in NUMBERS:
        if column not in runs:
            runs[column] = np.nan
    return runs, gathered


def _refuse(refused: list[NotRising]) -> None:
    """One message on every history whose time stamps do not rise."""
    if not refused:
        return
    first, more = refused[0], refused[1:]
    rest = "; ".join(f"{one.file}, data row {one.row}: {one.found}" for one in more[:_SHOWN])
    rest = f"; and in {len(more)} more: {rest}" if more else ""
    rest += f"; ... {len(more) - _SHOWN} more, see ident check" if len(more) > _SHOWN else ""
    raise InputError(first.where, first.found + rest, first.allowed)


def _check_completed(header: CampaignFile, runs: pd.DataFrame, where: str) -> None:
    """Refuse ``complete_from`` where it changes nothing."""
    if header.complete_from and (runs.empty or not runs["test"].eq(published.TEST).any()):
        text = "a campaign with published derivatives: what runs leave out is estimated anyway"
        raise InputError(f"{where}, key complete_from", repr(header.complete_from), text)


def read_campaign(
    folder: str | os.PathLike[str],
    leave_out: bool = False,
    tell: Tell = silent,
    spread: Spread = here,
    none_yet: bool = False,
) -> Campaign:
    """Read one captive campaign and turn it to the program frame.

    Parameters
    ----------
    folder : Folder with ``campaign.toml`` and the files of runs.
    leave_out : Leave histories whose time stamps do not rise to the quality checks, instead of
        refusing them all in one message.
    tell : Told of every file.
    spread : Reads the files and reduces their histories, here or on a cluster (``ident.cluster``).
    none_yet : Whether a folder without files of runs is a campaign whose runs are still to come; refused else.

    Returns
    -------
    Campaign in the program frame, full scale, moments about the vehicle's origin.

    Raises
    ------
    InputError
        For anything a user can mend: missing file or column, unknown test, unit, part or
        quality word, text or a non-finite number, a frame that is not declared.

    Examples
    --------
    >>> import ident
    >>> campaign = ident.read_campaign("my-boat/captive")
    >>> campaign.runs.set_index("run_id").loc["OW-0.4", ["file", "row", "source"]].astype(str).tolist()
    ['open_water.csv', '4', 'computed']
    """
    folder = Path(folder)
    header, raw = read_header(folder)
    where = str(folder / "campaign.toml")
    vehicle = load_vehicle(header.vehicle, beside=folder / "campaign.toml")
    frame = header.frame.declared(f"{where}, [frame]")
    _check_named(header, vehicle, where)
    runs, gathered = read_runs(folder, header, vehicle, tell, spread, none_yet)
    if not leave_out:
        _refuse(gathered.refused)
    digests = {"campaign.toml": hashlib.sha256(raw).hexdigest()}
    for path in sorted({f for p in gathered.inputs for f in inputs(p)}):
        # Another process may have read it.
        note(path)
        digests[path.relative_to(folder).as_posix()] = _digest(path)
    histories = (tuple(gathered.reduced), tuple(gathered.refused))
    if runs.empty and header.source and not (none_yet or gathered.refused):
        text = "runs that are back; ident runs shows how far a matrix of cases is"
        raise InputError(where, "no file of any [[source]], all of them awaited", text)
    _check_completed(header, runs, where)
    if runs.empty:
        return Campaign(header, vehicle, run_table({}), digests, *histories, folder=str(folder))
    runs = _converted(runs, folder, header, vehicle, frame)
    said = {"campaign": header.name, "vehicle": vehicle.name, "runs": len(runs), "files": len(digests)}
    _log.info("campaign read", extra=said)
    return Campaign(header, vehicle, runs, digests, *histories)


def _converted(runs: pd.DataFrame, folder: Path, header: CampaignFile, vehicle: Vehicle, frame: Frame) -> pd.DataFrame:
    """Runs as read, named once each and turned to the program's frame at full scale, all of them finite."""
    where = str(folder / "campaign.toml")
    runs["run_id"] = _own_names(runs)
    runs = runs.drop(columns="of_table", errors="ignore")
    runs["copy_of"] = _originals(folder, runs)
    _check_used(header, runs, where)
    point = frame.vector([header.moment_point.x_m, header.moment_point.y_m, header.moment_point.z_m])
    runs = arm_rates(runs, str(folder))
    runs = published.to_program(runs, vehicle, header, point, str(folder))
    runs = deflected_left_out(runs, vehicle)
    runs = _in_program_frame(runs, header, frame, where)
    loads = runs[[*OUTPUTS, *(f"s_{o}" for o in OUTPUTS)]]
    bad = (~np.isfinite(loads) & loads.notna()).any(axis=1)
    if bad.any():
        run = runs[bad].iloc[0]
        place = f"{folder / run['file']}, row {run['row']}"
        raise InputError(place, "a load that is not finite at full scale", "smaller numbers")
    return runs


def _check_named(header: CampaignFile, vehicle: Vehicle, where: str) -> None:
    """Tests and parts that ``[inertia]`` and ``[[tare]]`` name exist: a slip would take nothing off."""
    known = {"tests": list(tests().index), "parts": vehicle.part_names()}
    named = [("inertia", "parts", header.inertia.parts if header.inertia.model_inertia_in_loads else [])]
    named += [("hydrostatics", "parts", header.hydrostatics.parts)] if header.hydrostatics else []
    named += [(f"tare.{k}", key, getattr(tare, key)) for k, tare in enumerate(header.tare) for key in known]
    for table, key, words in named:
        for word in words:
            if word not in known[key]:
                raise InputError(f"{where}, key {table}.{key}", repr(word), ", ".join(known[key]))


def _check_used(header: CampaignFile, runs: pd.DataFrame, where: str) -> None:
    """Every tare, inertia and hydrostatic load has a run that it is taken off."""
    for k, tare in enumerate(header.tare):
        taken_off = runs[tare_applies(runs, tare)]
        for key in ("loads", "per_speed_squared"):
            for output in getattr(tare, key):
                if taken_off[output].isna().all():
                    idle = f"no run it applies to measures {output}"
                    raise InputError(f"{where}, key tare.{k}.{key}", idle, "tests, parts and components of the runs")
        if not (tare.loads or tare.per_speed_squared):
            raise InputError(f"{where}, key tare.{k}", "no load", "loads or per_speed_squared: nothing is taken off")
    tables = [("inertia", header.inertia.parts)] if header.inertia.model_inertia_in_loads else []
    tables += [("hydrostatics", header.hydrostatics.parts)] if header.hydrostatics else []
    loaded = runs[list(OUTPUTS)].notna().any(axis=1)
    for name, parts in tables:
        for part in parts:
            if not (loaded & (runs["part"] == part)).any():
                raise InputError(f"{where}, key {name}.parts", f"{part!r}, and no run of it", "parts of the runs")
    if header.half_model is not None and not loaded.any():
        raise InputError(f"{where}, key half_model", "declared, and no run has loads", "nothing")
    _check_axes_used(header, runs, bool(loaded.any()), where)


def _check_axes_used(header: CampaignFile, runs: pd.DataFrame, loaded: bool, where: str) -> None:
    """Axes of loads and a motion point have runs that they change."""
    for key in ("axes", "moment_axes"):
        stated = getattr(header.frame, key)
        if stated not in ("", "body") and not loaded:
            raise InputError(f"{where}, key frame.{key}", f"{stated!r}, and no run has loads", "nothing")
    if header.frame.moment_axes and runs[[*"KMN"]].isna().all(axis=None):
        raise InputError(f"{where}, key frame.moment_axes", "declared, and no run has a moment", "nothing")
    if header.motion_point is not None and not turning(runs).any():
        raise InputError(f"{where}, key motion_point", "declared, and no run turns", "nothing")


def _in_program_frame(runs: pd.DataFrame, header: CampaignFile, frame: Frame, where: str) -> pd.DataFrame:
    """Every conversion, in the order of ``ident.captive.conversions``."""
    ratio, point = header.scale.ratio, header.moment_point
    runs = turn(without_tare(runs, header.tare, where), frame, header.frame.angles)
    runs = to_body(runs, runs["axes"], runs["moment_axes"])
    runs = move_moments(runs, frame.vector([point.x_m, point.y_m, point.z_m]))
    runs = without_hydrostatics(runs, header, frame)
    if header.motion_point is not None:
        moved = header.motion_point
        runs = at_origin(runs, frame.vector([moved.x_m, moved.y_m, moved.z_m]))
    runs = whole_model(without_inertia(runs, header, frame), header)
    return standard_errors(to_full_scale(runs, ratio), header, ratio * header.scale.length_m)


def _own_names(runs: pd.DataFrame) -> pd.Series:
    """Run names, with their file, or worksheet, before those that stand in several: sheets number their runs anew."""
    if "of_table" in runs:
        table = runs["of_table"].fillna("").astype(str)
        several = table.groupby([runs["run_id"], runs["file"]]).transform("nunique") > 1
        runs = runs.assign(run_id=runs["run_id"].where(~several, table + "/" + runs["run_id"].astype(str)))
    files = runs.groupby("run_id")["file"].transform("nunique")
    shared = files > 1
    stem = runs["file"].map(lambda file: Path(str(file)).name.partition(".")[0])
    return runs["run_id"].where(~shared, stem + "/" + runs["run_id"].astype(str))


def _originals(folder: Path, runs: pd.DataFrame) -> pd.Series:
    """The run each copy goes back to, through copies of copies; empty for originals."""
    repeated = runs[runs["run_id"].duplicated()]
    if not repeated.empty:
        run = repeated.iloc[0]
        place = f"{folder / run['file']}, row {run['row']}, column run_id"
        text = "each run_id once a campaign; match = '(?P<run_id>...)' in [[source]] takes it from the path"
        raise InputError(place, repr(run["run_id"]), text)
    copies = runs[runs["copy_of"] != ""]
    parent = dict(zip(copies["run_id"], copies["copy_of"], strict=True))
    known = set(runs["run_id"]) if parent else set()

    def origin(name: str, place: str) -> str:
        seen, at = {name}, parent[name]
        while True:
            if at not in known or at in seen:
                allowed = "the run_id of another run, without a circle"
                raise InputError(f"{place}, column copy_of", repr(parent[name]), allowed)
            if at not in parent:
                return at
            seen.add(at)
            at = parent[at]

    places = zip(copies["run_id"], copies["file"], copies["row"], strict=True)
    originals = runs["copy_of"].copy()
    originals[copies.index] = [origin(name, f"{folder / file}, row {row}") for name, file, row in places]
    return originals


def find_campaigns(folder: Path) -> list[Path]:
    """The campaign folders at or directly below ``folder``.

    Raises
    ------
    InputError
        When there is none.
    """
    if not folder.is_dir():
        raise InputError(str(folder), "not a folder", "a folder with campaign.toml, or one that holds such folders")
    if (folder / "campaign.toml").is_file():
        return [folder]
    folders = sorted(p.parent for p in folder.glob("*/campaign.toml"))
    if not folders:
        raise InputError(str(folder), "no campaign.toml here or one level below", "a campaign folder")
    return folders
