"""Read a captive campaign: schema check, units, frame, moment point, scale, errors.

A campaign is a folder with ``campaign.toml`` and one CSV a test. It leaves here as one
table of runs in the program frame, SI and radians, with a standard error for every load.
"""

from __future__ import annotations

import csv
import hashlib
import tomllib
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from pydantic import Field

from ident import published
from sim.catalogue import ACCELERATIONS, OUTPUTS
from sim.errors import InputError
from sim.frames import Frame
from sim.schema import Data, FrameData, checked
from sim.vehicle import Vehicle, load_vehicle

TEXT = ("run_id", "test", "part", "quality", "source", "copy_of", "exclude", "reason", "decoupled", "coefficient")
REQUIRED = ("run_id", "test", "part", "quality", "source")
MOTION = ("p", "q", "r", *ACCELERATIONS)
DIRECT = ("KT", "KQ", "t", "value")

# Larger numbers are slips of the pen, and their powers leave the floating-point range.
_LARGEST = 1e15
# Flow beyond 60 deg from the axis is flow across the hull.
_ACROSS = 0.5


class CampaignFrame(FrameData):
    """Axis directions of the loads and rates, and the sign convention of the angles."""

    angles: Literal["flight"]


class MomentPoint(Data):
    """Point the moments are about, from the vehicle's origin, in the campaign frame."""

    x_m: float
    y_m: float
    z_m: float
    about: str


class Scale(Data):
    """Linear scale ratio (ship over model) and the length of the tested body."""

    ratio: Annotated[float, Field(gt=0, le=1e4)]
    length_m: Annotated[float, Field(gt=0, le=1e4)]


class Fluid(Data):
    """Water density of the tests."""

    density_kgpm3: Annotated[float, Field(gt=0, le=1e5)]
    source: str


class Inertia(Data):
    """Whether accelerated loads contain the model's own inertia (they must not)."""

    model_inertia_in_loads: Literal[False]


class Uncertainty(Data):
    """Rule for the standard error of a load."""

    floor: Annotated[float, Field(ge=0, le=1)]
    source: str


class Quality(Data):
    """A word of the quality vocabulary: factor on the standard error, and its meaning."""

    factor: Annotated[float, Field(ge=1, le=1e6)]
    meaning: str


class CampaignFile(Data):
    """Schema of ``campaign.toml``."""

    name: str
    vehicle: str
    facility: str
    provenance: str
    frame: CampaignFrame
    moment_point: MomentPoint
    scale: Scale
    fluid: Fluid
    inertia: Inertia
    uncertainty: Uncertainty
    quality: dict[str, Quality]


@dataclass(frozen=True)
class Campaign:
    """A campaign turned to the program frame.

    Attributes
    ----------
    header : The checked ``campaign.toml``.
    vehicle : The vehicle the runs belong to.
    runs : One row a run; columns U, alpha, beta, D0, p..r, accelerations, plane, n, J in
        SI and radians, X..N [N, N m] about the vehicle's origin, s_X..s_N standard errors,
        KT KQ t with s_KT.., ``value`` of a published ``coefficient``, and the text columns plus ``file`` and ``row``.
    digests : SHA-256 of every input file.
    """

    header: CampaignFile
    vehicle: Vehicle
    runs: pd.DataFrame
    digests: dict[str, str] = field(default_factory=dict)


@cache
def tests() -> pd.DataFrame:
    """Known captive tests by name: stage, required quantities, meaning."""
    with (files("ident") / "data" / "tests.csv").open(encoding="utf-8") as stream:
        return pd.read_csv(stream).set_index("test")


@cache
def _quantities() -> dict[str, tuple[str, float]]:
    """Column name -> (quantity, factor to SI)."""
    with (files("ident") / "data" / "quantities.csv").open(encoding="utf-8") as stream:
        table = pd.read_csv(stream, keep_default_na=False)
    known = {}
    for q, unit, factor in zip(table["quantity"], table["unit"], table["factor"], strict=True):
        known[f"{q}_{unit}" if unit else q] = (str(q), float(factor))
        if q in (*OUTPUTS, "value"):
            known[f"sigma_{q}_{unit}" if unit else f"sigma_{q}"] = (f"s_{q}", float(factor))
    return known


def _read_header(folder: Path) -> tuple[CampaignFile, bytes]:
    path = folder / "campaign.toml"
    if not path.is_file():
        raise InputError(str(path), "missing", "a campaign folder holds campaign.toml and one CSV a test")
    raw = path.read_bytes()
    try:
        data = tomllib.loads(raw.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise InputError(str(path), f"not TOML: {error}", "a TOML file in UTF-8") from error
    return checked(CampaignFile, data, str(path)), raw


def _cells(path: Path) -> pd.DataFrame:
    """The cells of a CSV file as text, no row longer than the header."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            lines = [line for line in csv.reader(stream, strict=True) if line]
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(str(path), f"not a table: {error}", "comma-separated values in UTF-8") from error
    if len(lines) < 2:
        raise InputError(str(path), "no runs", "at least one row below the header")
    header = [name.strip() for name in lines[0]]
    for row, line in enumerate(lines[1:], start=2):
        if len(line) > len(header):
            raise InputError(f"{path}, row {row}", f"{len(line)} cells", f"at most {len(header)}, as in the header")
        # Spreadsheets drop blank cells at the end of a row.
        line += [""] * (len(header) - len(line))
    for name in header:
        if header.count(name) > 1:
            raise InputError(f"{path}, row 1 (header)", f"column {name!r} stands twice", "each column once")
    return pd.DataFrame(lines[1:], columns=header, dtype=str)


def _check_columns(path: Path, table: pd.DataFrame) -> None:
    known = _quantities()
    for name in REQUIRED:
        if name not in table:
            raise InputError(str(path), f"column {name} missing", f"columns {', '.join(REQUIRED)} and quantities")
    for name in table.columns:
        if name in known or name in TEXT:
            continue
        stem = name.rsplit("_", 1)[0]
        like = [c for c in known if c.rsplit("_", 1)[0] == stem]
        allowed = ", ".join(like) if like else "a known quantity with its unit, such as U_mps, X_N, K_Nm"
        raise InputError(f"{path}, row 1 (header)", f"unknown column or unit {name!r}", allowed)


def _numbers(path: Path, table: pd.DataFrame, column: str, factor: float) -> pd.Series:
    text = table[column].str.strip()
    values = pd.to_numeric(text.where(text != ""), errors="coerce").astype(float)
    bad = (text != "") & ~(values.abs() <= _LARGEST)
    if bad.any():
        i = int(np.flatnonzero(bad.to_numpy())[0])
        raise InputError(
            f"{path}, row {i + 2}, column {column}",
            repr(table[column].iloc[i]),
            f"a finite number of at most {_LARGEST:g}, or blank",
        )
    if "sigma" in column and (values < 0.0).any():
        i = int(np.flatnonzero((values < 0.0).to_numpy())[0])
        raise InputError(f"{path}, row {i + 2}, column {column}", table[column].iloc[i], "zero or more")
    return values * factor


def _check_words(path: Path, table: pd.DataFrame, allowed: dict[str, list[str]]) -> None:
    for column, words in allowed.items():
        bad = ~table[column].isin(words)
        if bad.any():
            i = int(np.flatnonzero(bad.to_numpy())[0])
            raise InputError(f"{path}, row {i + 2}, column {column}", repr(table[column].iloc[i]), ", ".join(words))


def read_runs(path: Path, header: CampaignFile, vehicle: Vehicle) -> pd.DataFrame:
    """One CSV of runs, checked, in SI and radians but still in its own frame.

    Parameters
    ----------
    path : The file; UTF-8, comma separated, units in the header (``U_mps``, ``X_kN``).
    header, vehicle : For the quality vocabulary and the names of the parts.

    Raises
    ------
    InputError
        Naming file, row, column, what was found and what is allowed.
    """
    table = _cells(path)
    _check_columns(path, table)
    out = pd.DataFrame({c: table[c].str.strip() if c in table else "" for c in TEXT}, index=table.index)
    words = {"test": list(tests().index), "part": vehicle.part_names(), "quality": list(header.quality)}
    _check_words(path, out, words)
    _check_words(path, out, {"decoupled": ["", "True", "False"]})
    for column in table.columns:
        if column in _quantities():
            quantity, factor = _quantities()[column]
            if quantity in out:
                raise InputError(f"{path}, row 1 (header)", f"{quantity} stands twice", "one column a quantity")
            out[quantity] = _numbers(path, table, column, factor)
    out["file"], out["row"] = path.name, table.index + 2
    _check_complete(path, out)
    return out


def _check_complete(path: Path, runs: pd.DataFrame) -> None:
    """Every run has what its test needs, a load or coefficient, and an error to go with it."""
    for _, run in runs.iterrows():
        place = f"{path}, row {run['row']}"
        for need in str(tests().loc[run["test"], "requires"]).split():
            quantity = "plane" if need == "delta" else need
            if pd.isna(run.get(quantity, np.nan)):
                raise InputError(f"{place}, column {quantity}", "nothing", f"a number: a {run['test']} run needs it")
        if not run["run_id"]:
            raise InputError(f"{place}, column run_id", "nothing", "a name for the run")
        if run.get("U", np.nan) < 0:
            text = "zero or more: U is a speed, its direction is in alpha and beta"
            raise InputError(f"{place}, column U", str(run["U"]), text)
        measured = [o for o in (*OUTPUTS, *DIRECT) if pd.notna(run.get(o, np.nan))]
        if not measured:
            raise InputError(place, "no load and no coefficient", "at least one of X Y Z K M N, KT KQ, t, value")
        wrong = [w for w in run["exclude"].split() if w not in (*OUTPUTS, *DIRECT)]
        if wrong:
            raise InputError(f"{place}, column exclude", repr(wrong[0]), ", ".join((*OUTPUTS, *DIRECT)))
        relative = run.get("rel_sigma", np.nan)
        if pd.isna(relative):
            bare = [o for o in measured if pd.isna(run.get(f"s_{o}", np.nan))]
            if bare:
                raise InputError(f"{place}, column rel_sigma", "nothing", f"a number, or sigma_{bare[0]}_<unit>")
    repeated = runs["run_id"][runs["run_id"].duplicated()]
    if not repeated.empty:
        row = runs.loc[repeated.index[0], "row"]
        raise InputError(f"{path}, row {row}, column run_id", repr(repeated.iloc[0]), "each run_id once")


def _turn(runs: pd.DataFrame, frame: Frame) -> pd.DataFrame:
    turned = runs.copy()
    for quantity in (*OUTPUTS, *MOTION, "x", "y", "z"):
        if quantity in turned:
            turned[quantity] = turned[quantity] * frame.sign(quantity)
    return turned


def _to_full_scale(runs: pd.DataFrame, ratio: float) -> pd.DataFrame:
    """Froude scaling of motions and loads; dimensionless values do not change."""
    powers = {"U": 0.5, "D0": 1, "R0": 1, "n": -0.5, "x": 1, "y": 1, "z": 1}
    powers |= dict.fromkeys(("p", "q", "r"), -0.5) | dict.fromkeys(("pdot", "qdot", "rdot"), -1)
    powers |= {o: 3 if o in "XYZ" else 4 for o in OUTPUTS}
    powers |= {f"s_{o}": powers[o] for o in OUTPUTS}
    scaled = runs.copy()
    for name, power in powers.items():
        if name in scaled:
            scaled[name] = scaled[name] * ratio**power
    return scaled


def _move_moments(runs: pd.DataFrame, point: list[float]) -> pd.DataFrame:
    """Moments about the origin: M_O = M_P + r_P x F. Missing moments stay missing."""
    x, y, z = point
    levers = {"K": {"Z": y, "Y": -z}, "M": {"X": z, "Z": -x}, "N": {"Y": x, "X": -y}}
    moved = runs.copy()
    for moment, arms in levers.items():
        for force, arm in arms.items():
            if arm == 0.0:
                continue
            bare = runs[moment].notna() & runs[force].isna()
            if bare.any():
                run = runs[bare].iloc[0]
                place = f"{run['file']}, row {run['row']}, column {force}"
                raise InputError(place, "nothing", f"a number: moving {moment} to the vehicle's origin needs {force}")
            moved[moment] = moved[moment] + arm * runs[force]
    return moved


def _standard_errors(runs: pd.DataFrame, header: CampaignFile, length: float) -> pd.DataFrame:
    """Add s_X..s_N and s_KT, s_KQ, s_t by the campaign's rule."""
    out = runs.copy()
    factor = out["quality"].map({k: q.factor for k, q in header.quality.items()}).astype(float)
    original = out["copy_of"].map(dict(zip(out["run_id"], factor, strict=True))).astype(float)
    factor = factor.where(~(original > factor), original)
    still = {k: out[k].fillna(0.0) == 0.0 for k in MOTION}
    along = np.cos(out["alpha"].fillna(0.0)) * np.cos(out["beta"].fillna(0.0))
    still["u"] = pd.Series(along, index=out.index).abs() < _ACROSS
    kind = pd.DataFrame(still).apply(lambda moves: "".join("01"[m] for m in moves), axis=1) + out["coefficient"]
    rate2 = sum(out[c].fillna(0.0) ** 2 for c in ("p", "q", "r"))
    dynamic = out["U"].fillna(0.0) ** 2 + rate2 * length**2
    for name in (*OUTPUTS, *DIRECT):
        size = out[name].abs()
        prime = (size / dynamic).where(dynamic > 0) if name in OUTPUTS else size
        worst = prime.groupby([out["test"], out["part"], kind]).transform("max").fillna(0.0)
        floor = header.uncertainty.floor * worst * (dynamic if name in OUTPUTS else 1.0)
        ruled = factor * out["rel_sigma"] * np.maximum(size, floor)
        out[f"s_{name}"] = out[f"s_{name}"].fillna(ruled) if f"s_{name}" in out else ruled
    return out


def read_campaign(folder: Path) -> Campaign:
    """Read and turn one campaign.

    Parameters
    ----------
    folder : Folder with ``campaign.toml`` and CSV files of runs.

    Returns
    -------
    Campaign in the program frame, full scale, moments about the vehicle's origin.

    Raises
    ------
    InputError
        For anything a user can mend: missing file or column, unknown test, unit, part or
        quality word, text or a non-finite number, an undeclared or left-handed frame.
    """
    header, raw = _read_header(folder)
    vehicle = load_vehicle(header.vehicle, beside=folder / "campaign.toml")
    frame = header.frame.declared(f"{folder / 'campaign.toml'}, [frame]")
    paths = sorted(folder.glob("*.csv"))
    if not paths:
        raise InputError(str(folder), "no CSV file of runs", "one CSV a test beside campaign.toml")
    digests = {"campaign.toml": hashlib.sha256(raw).hexdigest()}
    tables = []
    for path in paths:
        digests[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
        tables.append(read_runs(path, header, vehicle))
    runs = pd.concat(tables, ignore_index=True)
    columns = ["U", "alpha", "beta", "D0", "plane", "n", "J", "rel_sigma", *MOTION, *OUTPUTS, *DIRECT]
    for column in columns:
        if column not in runs:
            runs[column] = np.nan
    runs["copy_of"] = _originals(folder, runs)
    runs = _to_full_scale(_turn(runs, frame), header.scale.ratio)
    point = header.moment_point
    at = [header.scale.ratio * c for c in frame.vector([point.x_m, point.y_m, point.z_m])]
    runs = published.to_program(runs, vehicle, frame, header.scale.ratio * header.scale.length_m, at, str(folder))
    runs = _standard_errors(_move_moments(runs, at), header, header.scale.ratio * header.scale.length_m)
    return Campaign(header, vehicle, runs, digests)


def _originals(folder: Path, runs: pd.DataFrame) -> pd.Series:
    """The run each copy goes back to, through copies of copies; empty for originals."""
    repeated = runs[runs["run_id"].duplicated()]
    if not repeated.empty:
        run = repeated.iloc[0]
        place = f"{folder / run['file']}, row {run['row']}, column run_id"
        raise InputError(place, repr(run["run_id"]), "each run_id once a campaign")
    parent = dict(zip(runs["run_id"], runs["copy_of"], strict=True))

    def origin(run: pd.Series) -> str:
        seen, at = {run["run_id"]}, run["copy_of"]
        while at:
            if at not in parent or at in seen:
                place = f"{folder / run['file']}, row {run['row']}, column copy_of"
                raise InputError(place, repr(run["copy_of"]), "the run_id of another run, without a circle")
            seen.add(at)
            if not parent[at]:
                return str(at)
            at = parent[at]
        return ""

    return runs.apply(origin, axis=1)


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
    found = sorted(p.parent for p in folder.glob("*/campaign.toml"))
    if not found:
        raise InputError(str(folder), "no campaign.toml here or one level below", "a campaign folder")
    return found
