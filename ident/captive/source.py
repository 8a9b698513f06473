"""``[[source]]`` of ``campaign.toml``: which files, in which format, and what stands in them."""

from __future__ import annotations

import re
from typing import Annotated, Literal, get_args

from pydantic import Field, field_validator, model_validator

from ident.captive.patterns import compiled
from sim.files.schema import Data

Reader = Literal[
    "table",
    "parquet",
    "starccm",
    "columns",
    "openfoam",
    "workbook",
    "matlab",
    "hdf5",
    "netcdf",
    "tdms",
    "lvm",
    "fluent",
    "su2",
    "tecplot",
    "universal",
]
READERS = get_args(Reader)
# Motion of an oscillatory test -> velocity and acceleration it makes.
MOTIONS = {
    "surge": ("u", "udot"),
    "sway": ("v", "vdot"),
    "heave": ("w", "wdot"),
    "roll": ("p", "pdot"),
    "pitch": ("q", "qdot"),
    "yaw": ("r", "rdot"),
}
# Keys that say how a text is written, by reader; a key that a reader does not look at is refused.
_TEXT_KEYS = ("delimiter", "decimal", "thousands", "encoding", "skip")
_COLUMN_KEYS = ("columns", "patterns", "ignore", "normalisation", "reference", "subtract", "words")
_FOAM_KEYS = ("parts", "rho_inf", "vehicle_origin", "cofr")
LOOKED_AT = {
    "table": (*_TEXT_KEYS, *_COLUMN_KEYS, "header_pattern", "units_row"),
    "starccm": (*_TEXT_KEYS, *_COLUMN_KEYS, "header_pattern", "units_row"),
    "columns": (*_TEXT_KEYS, *_COLUMN_KEYS, "header_pattern", "names", "widths"),
    "parquet": _COLUMN_KEYS,
    "workbook": (*_COLUMN_KEYS, "table", "header_pattern", "units_row", "skip", "decimal", "thousands"),
    "matlab": (*_COLUMN_KEYS, "table", "names"),
    "hdf5": (*_COLUMN_KEYS, "table", "names"),
    "netcdf": (*_COLUMN_KEYS, "table", "names"),
    "tdms": (*_COLUMN_KEYS, "table"),
    "lvm": (*_COLUMN_KEYS, "encoding", "skip", "decimal", "thousands"),
    "fluent": (*_COLUMN_KEYS, *_TEXT_KEYS),
    "su2": (*_COLUMN_KEYS, *_TEXT_KEYS),
    "tecplot": (*_COLUMN_KEYS, "table", "encoding", "skip"),
    "universal": _COLUMN_KEYS,
    "openfoam": _FOAM_KEYS,
}
NO_COLUMNS = "no subtract: a function object of the patches that are wanted, OpenFOAM's files have no other columns"
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d{1,3})?", re.ASCII)
Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Positive = Annotated[float, Field(gt=0, le=1e9)]
Span = Annotated[list[float], Field(min_length=2, max_length=2)]

# Text encodings that can be stated; without one it is found from the file's first bytes.
Encoding = Literal["utf-8", "utf-16-le", "utf-16-be", "latin-1", "cp1252", "shift_jis", "cp932", "euc_jp", "gb18030"]


class Reduction(Data):
    """How a time history becomes runs.

    Attributes
    ----------
    kind : ``steady``: means. ``oscillatory``: harmonics 0-3 at the known frequency, then
        four runs, at the ends of the velocity and of the acceleration. ``acceleration``:
        the value at mid-time of a constant acceleration.
    start_s, end_s : Window, by hand; the start-up transient is found within it.
    rate_hz : Sampling rate, where the time column cannot be trusted; time is then the row.
    motion : What oscillates.
    frequency_hz : Its frequency, unless a column ``frequency`` gives it.
    amplitude : Amplitude of the displacement [m or rad], unless a column ``displacement``
        measures it.
    phase_deg : Phase of the displacement at time zero, A sin(2 pi f t + phase). Asked for where the
        clock does not start at zero and no column ``displacement`` measures it.
    path : Of a body that yaws or pitches. ``tangent``: it stays along its path (pure yaw, pure pitch of a planar
        motion mechanism). ``straight``: it swings about an axis that is towed straight, or stands in a stream.
    delay_s : Channel -> time by which it comes late (a filter, an acquisition), taken off: ``Y = 0.05``.
    """

    kind: Literal["steady", "oscillatory", "acceleration"]
    start_s: float | None = None
    end_s: float | None = None
    rate_hz: Positive | None = None
    motion: Literal["surge", "sway", "heave", "roll", "pitch", "yaw"] | None = None
    frequency_hz: Positive | None = None
    amplitude: Annotated[float, Field(gt=0, le=1e6)] | None = None
    phase_deg: Annotated[float, Field(ge=-360, le=360)] = 0.0
    path: Literal["", "tangent", "straight"] = ""
    delay_s: dict[str, Annotated[float, Field(ge=-1e3, le=1e3)]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _motion_is_named(self) -> Reduction:
        if self.kind == "oscillatory" and self.motion is None:
            raise ValueError(f"motion, one of {', '.join(MOTIONS)}: an oscillatory test needs it")
        if self.start_s is not None and self.end_s is not None and self.end_s <= self.start_s:
            raise ValueError("end_s after start_s")
        self._nothing_is_idle()
        return self

    def _nothing_is_idle(self) -> None:
        """Keys that this kind of reduction does not look at are refused."""
        if self.path and self.motion not in ("yaw", "pitch"):
            raise ValueError("no path: only a body that yaws or pitches may stand across its path")
        for key in ("motion", "frequency_hz", "amplitude", "phase_deg", "delay_s"):
            if self.kind != "oscillatory" and key in self.model_fields_set:
                raise ValueError(f"no {key}: a {self.kind} test has no oscillation that it is of")


class Reference(Data):
    """Area and length that coefficients were made dimensionless with.

    Attributes
    ----------
    area_m2 : Reference area A: ``REF_AREA`` of a solver, chord times span of a plane.
    length_m : Reference length of moments (and rates): ``REF_LENGTH``, the chord. Needed by moments alone.
    source : Where they are stated.
    """

    area_m2: Annotated[float, Field(gt=0, le=1e9)]
    length_m: Annotated[float, Field(gt=0, le=1e6)] | None = None
    source: Annotated[str, Field(min_length=1, max_length=500)]


class Subtract(Data):
    """Measured loads of a part, taken off the total: a rudder on its own balance, a thrust column.

    Attributes
    ----------
    what : The part.
    source : Where this is said.
    columns : Header -> load of the part, along the campaign's axes, perhaps with unit: ``RY = "Y [N]"``.
    at_m : Where its forces act and its moments are about, from the vehicle's origin, in the
        campaign's axes and scale: the moment of the forces is taken off too. Without it the moments
        in ``columns`` are about the campaign's moment point, and have to be complete.
    factor : On all of its loads: -1 for a column of the other sign, 1 + a_H for a rudder that also
        loads the hull.
    """

    what: Annotated[str, Field(min_length=1, max_length=200)]
    source: Annotated[str, Field(min_length=1, max_length=500)]
    columns: Annotated[dict[str, str], Field(min_length=1)]
    at_m: Vector | None = None
    factor: Annotated[float, Field(ge=-100, le=100)] = 1.0


class Grids(Data):
    """The same runs on coarser grids, from which the discretisation error of every load is estimated.

    Attributes
    ----------
    finest : Name of the folder, in the path of the files, that stands for the finest grid: ``fine``.
    coarser : Names of the folders with the same files on the two coarser grids, the finer of them first.
    refinement : Ratio of cell lengths between successive grids.
    """

    finest: Annotated[str, Field(min_length=1, max_length=100)]
    coarser: Annotated[list[Annotated[str, Field(min_length=1, max_length=100)]], Field(min_length=2, max_length=2)]
    refinement: Annotated[float, Field(gt=1, le=10)]

    @model_validator(mode="after")
    def _three(self) -> Grids:
        names = [self.finest, *self.coarser]
        if len(set(names)) < 3:
            raise ValueError("three folders of different names")
        odd = [n for n in names if "/" in n or "\\" in n or n in (".", "..")]
        if odd:
            raise ValueError(f"the name of a folder, not {odd[0]!r}")
        return self


class Deduction(Data):
    """The thrust deduction of a hull behind a propeller or disc of known thrust, from its towed run.

    Attributes
    ----------
    towed : Files of the same hull at the same state without thrust: a path below the campaign folder.
    thrust_n : Thrust, at the scale of the runs [N].
    source : Where the thrust comes from.
    """

    towed: Annotated[str, Field(min_length=1, max_length=300)]
    thrust_n: Annotated[float, Field(gt=0, le=1e10)]
    source: Annotated[str, Field(min_length=1, max_length=500)]


class Source(Data):
    """Some files of a campaign that share a format; every key is in ``docs/readers.md``.

    ``within`` limits the states whose loads are used: ``beta_deg = [-20, 20]``. Runs outside
    stay in the run table with all their loads excluded.

    Attributes
    ----------
    files : Path or glob below the campaign folder; for OpenFOAM the case folders.
    reader : How they are read; found by content when left out.
    rows : ``runs``: a row is a run. ``history``: a file is a run.
    columns : Header -> quantity, perhaps with unit: ``Fx = "X"``.
    patterns : Regular expression -> quantity; each fits exactly one header.
    ignore : Headers (with ``*``) to leave out.
    names : Columns in order, of files without a header.
    header_pattern : Regular expression that finds the header line.
    table : Worksheet, struct, group or zone of a file that holds several; each that fits where it has `*` or `?`.
    widths : Characters of each column, where numbers touch.
    units_row : Whether the row below the header holds the units.
    delimiter : Where it cannot be found out.
    decimal : Decimal mark, where it cannot be found out.
    thousands : Mark of digit groups, where it cannot be found out.
    encoding : Of the text, where no byte order mark says it.
    skip : Regular expression of lines that are no data.
    constants : What holds for every run: ``test``, ``part``, ``U = "2 m/s"``.
    within : State -> lowest and highest value whose loads are used.
    match : Regular expression over the path; its named groups are constants.
    normalisation : Of dimensionless columns: ``half_rho_L2``, ``half_rho_Ld`` or ``half_rho_A``.
    parts : OpenFOAM: function object -> part.
    rho_inf : OpenFOAM: density that the function object used.
    vehicle_origin : OpenFOAM: the vehicle's origin in mesh axes [m].
    cofr : OpenFOAM: the point the moments are about, of files whose header does not name it [m].
    axes : Axes of these files' loads, where they are not as ``[frame]`` says: ``body``, ``flow`` or ``tank``.
    moment_axes : Axes of the moments, where they are not those of the forces.
    moments_about : A point that moves with the ``body`` or stays ``fixed``, where the body moves in its axes.
    factor : Header or quantity -> what its values are multiplied by, where the header does not say it.
    missing : Numbers and words that stand for a value that was not measured: ``-9999``, ``"NaN"``, ``""`` for blanks.
    words : Words of the files -> those of this program.
    plus_minus : How many standard errors an error behind a plus-minus sign is: 1.96 for 95 % limits. Without
        it they are read as one, and ``ident check`` says so.
    marks : Footnote mark behind a number -> quality word of its run: ``"*" = "poor"``.
    reference : What dimensionless columns were made with.
    reduction : How a time history becomes runs.
    subtract : Measured loads of parts that are taken off.
    grids : The same histories on coarser grids: the discretisation error joins the standard errors.
    deduction : Of the loads of a self-propelled hull: they become the thrust deduction ``t``.
    awaited : Files that are not there yet are left out: a matrix of which some runs are still to come.
    """

    files: Annotated[str, Field(min_length=1, max_length=300)]
    reader: Reader | None = None
    rows: Literal["runs", "history"] = "runs"
    columns: dict[str, str] = Field(default_factory=dict)
    patterns: dict[str, str] = Field(default_factory=dict)
    ignore: list[str] = Field(default_factory=list)
    names: list[str] = Field(default_factory=list)
    header_pattern: str = ""
    table: Annotated[str, Field(max_length=300)] = ""
    widths: Annotated[list[Annotated[int, Field(ge=1, le=1000)]], Field(max_length=1000)] = Field(default_factory=list)
    units_row: bool = False
    delimiter: Literal["", ",", ";", "\t", " "] = ""
    decimal: Literal["", ".", ","] = ""
    thousands: Literal["", ".", ",", "'", " "] = ""
    encoding: Encoding = "utf-8"
    skip: str = ""
    constants: dict[str, str | float] = Field(default_factory=dict)
    within: dict[str, Span] = Field(default_factory=dict)
    match: str = ""
    normalisation: str = ""
    parts: dict[str, str] = Field(default_factory=dict)
    rho_inf: Positive | None = None
    vehicle_origin: Vector | None = None
    cofr: Vector | None = None
    axes: Literal["", "body", "flow", "tank"] = ""
    moment_axes: Literal["", "body", "flow", "tank"] = ""
    moments_about: Literal["", "body", "fixed"] = ""
    factor: dict[str, Annotated[float, Field(ge=-1e9, le=1e9)]] = Field(default_factory=dict)
    missing: Annotated[list[float | Annotated[str, Field(max_length=40)]], Field(max_length=20)] = Field(
        default_factory=list
    )
    words: dict[str, str] = Field(default_factory=dict)
    plus_minus: Annotated[float, Field(gt=0, le=10)] | None = None
    marks: Annotated[dict[Annotated[str, Field(min_length=1, max_length=5)], str], Field(max_length=20)] = Field(
        default_factory=dict
    )
    reference: Reference | None = None
    reduction: Reduction | None = None
    subtract: list[Subtract] = Field(default_factory=list)
    grids: Grids | None = None
    deduction: Deduction | None = None
    awaited: bool = False

    @field_validator("match", "header_pattern", "skip")
    @classmethod
    def _pattern_compiles(cls, text: str) -> str:
        compiled(text)
        return text

    @field_validator("patterns")
    @classmethod
    def _patterns_compile(cls, patterns: dict[str, str]) -> dict[str, str]:
        for text in patterns:
            compiled(text)
        return patterns

    @field_validator("within")
    @classmethod
    def _spans_rise(cls, within: dict[str, list[float]]) -> dict[str, list[float]]:
        for name, (low, high) in within.items():
            if not low < high:
                raise ValueError(f"{name} = [lowest, highest], the first below the second")
        return within

    @property
    def missing_numbers(self) -> tuple[float, ...]:
        """Those of ``missing`` that are numbers, whether they stand there as numbers or as text."""
        return tuple(float(m) for m in self.missing if not isinstance(m, str) or _NUMBER.fullmatch(m.strip()))

    @property
    def missing_words(self) -> frozenset[str]:
        """Those of ``missing`` that are words; the empty one is a blank cell."""
        return frozenset(m.strip() for m in self.missing if isinstance(m, str))

    @field_validator("factor")
    @classmethod
    def _factors_count(cls, factor: dict[str, float]) -> dict[str, float]:
        for name, value in factor.items():
            if value == 0.0:
                raise ValueError(f"another factor than zero for {name!r}; leave the column out with ignore")
        return factor

    @model_validator(mode="after")
    def _reduction_fits(self) -> Source:
        if self.rows == "history" and self.reduction is None:
            raise ValueError("a table [source.reduction]: rows = 'history' needs it")
        if self.rows == "runs" and self.reduction is not None and self.reduction.kind != "oscillatory":
            raise ValueError("rows = 'history': only time histories are reduced")
        if self.reader == "openfoam" and self.rows != "history":
            raise ValueError("rows = 'history': OpenFOAM writes time histories")
        if self.reader == "openfoam" and self.subtract:
            raise ValueError(NO_COLUMNS)
        if self.rows == "runs" and self.reduction is not None:
            for key in ("start_s", "end_s", "rate_hz", "phase_deg", "delay_s"):
                if key in self.reduction.model_fields_set:
                    raise ValueError(f"no reduction.{key} with rows = 'runs': there is no time in a table of harmonics")
        for key in ("plus_minus", "marks"):
            if self.rows == "history" and key in self.model_fields_set:
                raise ValueError(f"no {key} with rows = 'history': samples have no errors or marks behind them")
        if self.moments_about and (self.reduction is None or self.reduction.kind != "oscillatory"):
            raise ValueError("no moments_about: only in an oscillation does a body move away from a fixed moment point")
        if self.reference is not None and self.normalisation != "half_rho_A":
            raise ValueError("no table reference: normalisation = 'half_rho_A' alone divides by a stated area")
        if self.deduction is not None and (self.reduction is None or self.reduction.kind != "steady"):
            raise ValueError("rows = 'history' and reduction.kind = 'steady': of a deduction the loads are steady")
        if self.grids is not None and self.rows != "history":
            raise ValueError("rows = 'history': only histories are compared between grids")
        if self.grids is not None and self.grids.finest not in self.files.replace("\\", "/").split("/"):
            raise ValueError(f"a folder {self.grids.finest!r} in files: grids.finest names it")
        if self.names and self.header_pattern:
            raise ValueError("one of names and header_pattern: both say what the columns are")
        if self.files.startswith(("/", "~")) or ".." in self.files.replace("\\", "/").split("/"):
            raise ValueError("a path below the campaign folder")
        return self


def idle_keys(source: Source, reader: str) -> list[str]:
    """Keys of a source that its reader does not look at."""
    some = {key for keys in LOOKED_AT.values() for key in keys}
    looked_at = {*LOOKED_AT[reader], *(("subtract",) if reader == "openfoam" else ())}
    return sorted(k for k in source.model_fields_set if k in some and k not in looked_at)
