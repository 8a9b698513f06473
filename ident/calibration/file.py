"""What a calibration is: training series, groups of coefficients, priors. A data file says it.

A group is a set of tabulated values that share one multiplier (or one offset). Its prior is
what is known before any maneuver: the captive error of the group, a named estimate, or
a stated range with its reason.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from fnmatch import fnmatchcase
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from sim.boat import catalogue
from sim.boat.database import axis_columns
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.files.schema import Data, Positive, checked
from sim.files.toml_files import read_toml

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
# A multiplier further than this many captive standard errors from one needs another reason.
ALLOWED = 2.0
# A multiplier and its spread beyond this are another coefficient, or a slip of a unit.
_MOST = 10.0
# What each method has factors of; the others have one.
_FACTORS = {"carry_over": ("force", "roll"), "tail_downwash": ("force", "pitch")}
# What the column ``estimated_by`` says of an estimate that a prior would bring in once more.
_IN_FORCE = {"carry_over": "carry_over x", "tail_downwash": "downwash x|hull_below x"}


class Training(Data):
    """One source of one case that the calibration learns from.

    ``differs_from`` names another source of the same case; ``share`` of the mean squared
    difference between the two counts as this source's own variance, channel by channel.

    Attributes
    ----------
    case : Bundled case, or a case file beside this one.
    source : Source of its reference that is trained on.
    channels : Channels that are trained on; all that the case compares without.
    differs_from : Another source of the same case that this one contradicts.
    share : Of the mean squared difference that counts as this source's variance.
    """

    case: str
    source: str
    channels: list[str] | None = None
    differs_from: str | None = None
    share: Annotated[float, Field(ge=0, le=1)] = 0.5

    @model_validator(mode="after")
    def _shares_a_difference(self) -> Training:
        if self.differs_from == self.source:
            raise ValueError(f"differs_from is {self.source!r} itself")
        if "share" in self.model_fields_set and self.differs_from is None:
            raise ValueError("a share is of the difference to another source: differs_from is not given")
        return self


class Prior(Data):
    """What is known of a multiplier or offset before any maneuver.

    ``version``: one (or no offset) within the error that the version states of the group, of runs and
    estimates together; ``captive`` is its older name. ``carry_over``: the vortex-lattice factor on force or
    roll moment of the plane geometry. ``tail_downwash``: factor on force or pitch moment of the sail planes by
    the hull below them and their vortices at the stern planes; both for a version of the runs alone. ``stated``:
    mean and sigma with their reason. ``sigma`` widens the others where given.

    Attributes
    ----------
    method : What it is from.
    mean : Of a stated prior, or instead of the method's.
    sigma : Standard deviation; widens those of the methods.
    of : Which factor of the method.
    source : Its reason.
    """

    method: Literal["version", "captive", "carry_over", "tail_downwash", "stated"]
    mean: float | None = None
    sigma: Positive | None = None
    of: Literal["force", "roll", "pitch"] = "force"
    source: str

    @model_validator(mode="after")
    def _stated_has_numbers(self) -> Prior:
        if self.method == "stated" and (self.mean is None or self.sigma is None):
            raise ValueError("a stated prior needs mean and sigma")
        factors = _FACTORS.get(self.method, ())
        if "of" in self.model_fields_set and self.of not in factors:
            text = f"of = {' or '.join(map(repr, factors))}" if factors else "no key of"
            raise ValueError(f"{text} with method {self.method!r}, not of = {self.of!r}")
        return self


class Group(Data):
    """Tabulated values that share one multiplier or offset.

    ``terms`` and ``parts`` are shell patterns; ``nonzero`` lists axes whose value must not
    be zero, such as beta for what drift adds; ``at_least`` gives axes whose size must not be less, in the
    database's unit, such as delta for planes beyond an angle.

    Attributes
    ----------
    name : Of the group.
    title : For people.
    terms : Shell patterns of coefficients.
    parts : Shell patterns of parts.
    nonzero : Axes whose value is not zero in the values of the group.
    at_least : Axis -> least size, in the database's unit.
    kind : One ``multiplier`` or one ``offset`` for all of them.
    prior : What is known before any maneuver.
    """

    name: str
    title: str
    terms: Annotated[list[str], Field(min_length=1)]
    parts: list[str] = Field(default_factory=lambda: ["*"])
    nonzero: list[str] = Field(default_factory=list)
    at_least: dict[str, Positive] = Field(default_factory=dict)
    kind: Literal["multiplier", "offset"] = "multiplier"
    prior: Prior

    @model_validator(mode="after")
    def _multipliers_turn_nothing_around(self) -> Group:
        mean, sigma = self.prior.mean, self.prior.sigma
        if self.kind == "offset":
            return self
        if mean is not None and mean <= 0.0:
            raise ValueError("a mean above zero: a multiplier of less turns a load around")
        if mean is not None and not 1.0 / _MOST <= mean <= _MOST:
            raise ValueError(f"a mean of {mean:g}: a multiplier is {1.0 / _MOST:g} to {_MOST:g}, and 1 changes nothing")
        if sigma is not None and sigma > _MOST:
            raise ValueError(f"a sigma of {sigma:g} of a multiplier: {_MOST:g} at most, which is 1000 % of the values")
        return self


class CalibrationFile(Data):
    """A calibration file.

    ``starts_from``: ``version``, the version as it is; ``runs``, what the runs alone gave in it, so that
    estimates come in as priors. ``choose``: ``all``, every group is free; ``evidence``, those whose freedom raises
    the evidence of the model, and the others stay at their prior means.

    Attributes
    ----------
    name : Of the calibration.
    vehicle : Bundled vehicle, or a vehicle file beside this one.
    source : Where the training data come from.
    starts_from, choose : See above.
    training : Series that are learnt from.
    group : Coefficients that share a multiplier or offset.
    """

    name: str
    vehicle: str
    source: str
    starts_from: Literal["version", "runs"] = "version"
    choose: Literal["all", "evidence"] = "all"
    training: Annotated[list[Training], Field(min_length=1)]
    group: Annotated[list[Group], Field(min_length=1)]

    @model_validator(mode="after")
    def _names_once(self) -> CalibrationFile:
        names = [g.name for g in self.group]
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise ValueError(f"group {twice[0]!r} stands twice")
        learnt: set[tuple[str, str, str]] = set()
        for one in self.training:
            for channel in one.channels or ["*"]:
                same = {(one.case, one.source, c) for c in (channel, "*")}
                if same & learnt or (channel == "*" and any(k[:2] == (one.case, one.source) for k in learnt)):
                    raise ValueError(f"training on {one.source} of {one.case} stands twice: it would count twice")
                learnt.add((one.case, one.source, channel))
        return self


@dataclass(frozen=True)
class Parameter:
    """A group with its rows and its prior in numbers.

    Attributes
    ----------
    group : As in the file.
    rows : (rows,) True for the database rows of the group.
    mean, sigma : Prior.
    captive : Captive standard error of the group as one multiplier (or offset), all its
        errors taken as one.
    method : Where the prior's numbers come from.
    """

    group: Group
    rows: Mask
    mean: float
    sigma: float
    captive: float
    method: str

    @property
    def neutral(self) -> float:
        """The value that changes nothing."""
        return 1.0 if self.group.kind == "multiplier" else 0.0

    def beyond_captive(self, value: float) -> bool:
        """True when the captive error alone does not allow ``value``."""
        return abs(value - self.neutral) > ALLOWED * self.captive


def bundled_calibrations() -> list[str]:
    """Names of the bundled calibrations."""
    return sorted(p.name[:-5] for p in (files("ident") / "calibrations").iterdir() if p.name.endswith(".toml"))


def load_calibration(name: str | Path) -> tuple[CalibrationFile, str, str]:
    """A bundled calibration or a path to one.

    Returns
    -------
    The file, the name to report, and its SHA-256.

    Raises
    ------
    InputError
        For a missing file, an unknown key, or a value out of range.
    """
    known = bundled_calibrations()
    inside = files("ident") / "calibrations" / f"{name}.toml"
    path = Path(str(inside)) if str(name) in known else Path(name)
    if path.suffix != ".toml" or not path.is_file():
        allowed = f"one of {', '.join(known)}, or a path to a .toml file"
        raise InputError(str(name)[:200], "no such calibration", allowed)
    data, where = read_toml(path, "cases")
    digest = hashlib.sha256(Path(where).read_bytes()).hexdigest()
    return checked(CalibrationFile, data, where), where, digest


def _rows_of(group: Group, rows: pd.DataFrame, where: str) -> Mask:
    chosen = np.ones(len(rows), dtype=bool)
    for key, patterns, column in (("terms", group.terms, "coefficient"), ("parts", group.parts, "part")):
        names = rows[column].astype(str)
        matched = [names.map(lambda name, p=p: fnmatchcase(name, p)).to_numpy(dtype=bool) for p in patterns]
        idle = next((p for p, hits in zip(patterns, matched, strict=True) if not hits.any()), None)
        if idle is not None:
            text = f"a pattern of {key} that the database version holds: {', '.join(sorted(set(names))[:12])} ..."
            raise InputError(f"{where}, group {group.name}, key {key}", f"no value matches {idle!r}", text)
        chosen &= np.any(matched, axis=0)
    columns = {axis: column for column, axis in axis_columns().items()}
    least = dict.fromkeys(group.nonzero, 0.0) | group.at_least
    for axis, size in least.items():
        if axis not in catalogue.axes():
            allowed = ", ".join(catalogue.axes())
            key = "nonzero" if axis in group.nonzero else "at_least"
            raise InputError(f"{where}, group {group.name}, key {key}", repr(axis), allowed)
        along = rows[columns[axis]].fillna(0.0).abs()
        chosen &= ((along >= size) & (along > 0.0)).to_numpy()
    if not chosen.any():
        text = "terms and parts that the database version holds"
        raise InputError(f"{where}, group {group.name}", f"no value matches {' '.join(group.terms)}", text)
    return chosen


def _whole_estimates(group: Group, rows: pd.DataFrame, chosen: Mask, where: str) -> None:
    """A value and its mirror image are one estimate and cannot be told apart."""
    estimate = rows["estimate"].to_numpy()
    shared = set(estimate[chosen & (estimate >= 0)]) & set(estimate[~chosen & (estimate >= 0)])
    if shared:
        row = rows[(estimate == min(shared)) & ~chosen].iloc[0]
        wrong = f"{row['coefficient']} of {row['part']} is left out, which is the mirror image of one inside"
        raise InputError(f"{where}, group {group.name}", wrong, "a value together with its mirror image")


def captive_sigma(rows: pd.DataFrame, chosen: Mask, kind: str) -> float:
    """Captive standard error of a group as one multiplier or offset.

    As if the group held one value only, of its mean information: all errors are taken as
    one, and nothing averages out. Values without a stated error do not count.
    """
    error, value = rows["stderr"].to_numpy()[chosen], rows["value"].to_numpy()[chosen]
    known = error > 0.0
    size = np.abs(value[known]) if kind == "multiplier" else 1.0
    information = float(np.mean((size / error[known]) ** 2)) if known.any() else 0.0
    return information**-0.5 if information > 0.0 else 0.0


def _estimated(prior: Prior, vehicle: Vehicle, rows: pd.DataFrame) -> tuple[float, float, str]:
    """Mean, standard deviation and method of an estimate from the geometry."""
    from ident.estimates.carry_over import carry_over

    planes = carry_over(vehicle)
    if prior.method == "carry_over":
        if prior.of == "force":
            return planes.force_factor, planes.force_sigma, planes.method
        return planes.roll_factor / planes.force_factor, planes.roll_sigma / planes.force_factor, planes.method
    from ident.estimates.downwash import tail_downwash

    tail = tail_downwash(vehicle, rows, planes)
    factor, sigma = (
        (tail.force_factor, tail.force_sigma) if prior.of == "force" else (tail.moment_factor, tail.moment_sigma)
    )
    return factor + planes.below, float(np.hypot(sigma, planes.below_sigma)), tail.method


def _prior(
    group: Group, captive: float, vehicle: Vehicle, rows: pd.DataFrame, chosen: Mask, where: str
) -> tuple[float, float, str]:
    prior = group.prior
    mean, sigma, method = 1.0 if group.kind == "multiplier" else 0.0, captive, "standard error of the version"
    if prior.method == "stated":
        mean, sigma, method = float(prior.mean or 0.0), float(prior.sigma or 0.0), "stated"
    elif prior.method not in ("version", "captive"):
        if rows.loc[chosen, "estimated_by"].str.contains(_IN_FORCE[prior.method]).any():
            text = 'method = "version": its values have the estimate in them'
            raise InputError(f"{where}, group {group.name}, key prior.method", repr(prior.method), text)
        mean, spread, method = _estimated(prior, vehicle, rows)
        sigma = float(np.hypot(spread, mean * captive))
    if prior.method != "stated":
        mean = mean if prior.mean is None else prior.mean
        if prior.sigma is not None and prior.sigma < sigma:
            text = f"above {sigma:.3g}, which {method} has already: sigma widens it; else leave it out"
            raise InputError(f"{where}, group {group.name}, key prior.sigma", f"{prior.sigma:g}", text)
        sigma = sigma if prior.sigma is None else prior.sigma
    if sigma <= 0.0:
        raise InputError(f"{where}, group {group.name}", "a prior without any spread", "prior.sigma, positive")
    return mean, sigma, method


def parameters(spec: CalibrationFile, vehicle: Vehicle, rows: pd.DataFrame, where: str) -> list[Parameter]:
    """The groups of a calibration with their rows and priors.

    Parameters
    ----------
    spec, where : From ``load_calibration``.
    vehicle, rows : What is calibrated.

    Raises
    ------
    InputError
        For a pattern that matches nothing, a group without rows, one that splits a value from its mirror image,
        a prior without spread, or a sigma below what the method states.
    """
    chosen_parameters: list[Parameter] = []
    for group in spec.group:
        chosen = _rows_of(group, rows, where)
        _whole_estimates(group, rows, chosen, where)
        captive = captive_sigma(rows, chosen, group.kind)
        mean, sigma, method = _prior(group, captive, vehicle, rows, chosen, where)
        chosen_parameters.append(Parameter(group, chosen, mean, sigma, captive, method))
    return chosen_parameters


def apply(values: Array, chosen: list[Parameter], theta: Array) -> Array:
    """Row values with every multiplier and offset in place.

    Parameters
    ----------
    values : (rows,) captive values.
    chosen : The parameters, (k,).
    theta : (k,) multipliers and offsets.
    """
    out = values.copy()
    for parameter, x in zip(chosen, theta, strict=True):
        if parameter.group.kind == "multiplier":
            out[parameter.rows] *= x
    for parameter, x in zip(chosen, theta, strict=True):
        if parameter.group.kind == "offset":
            # Mirror images carry the sign of their value.
            out[parameter.rows] += x * np.where(values[parameter.rows] < 0.0, -1.0, 1.0)
    return out
