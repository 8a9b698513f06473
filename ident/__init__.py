"""Captive submarine tests to a versioned maneuvering-coefficient database, and back to sea.

The public names; everything else may change between versions. They are loaded when first used.

Examples
--------
>>> import ident
>>> ident.Database("coeff_db")[0]["N_v"].sizes
Frozen({})
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ident.arrival import register_with_gymnasium

if TYPE_CHECKING:
    from ident.analysis.result import Linear, Stability, StabilityMap
    from ident.analysis.stability import stability
    from ident.analysis.state_space import StateSpaceModel
    from ident.calibration.crossed import CrossedSeries
    from ident.calibration.result import Calibrated, CalibrationSummary, LeftOut, MultiplierGroup, Prior, TrainedSeries
    from ident.calibration.version import calibrate
    from ident.captive.campaign import Campaign, read_campaign
    from ident.cfd.batch import Batch, plan_cases
    from ident.checks.checked import Checked, check
    from ident.checks.findings import Finding
    from ident.database.compare import Change, Difference
    from ident.database.versions import Database, DatabaseVersion
    from ident.estimates.predict import Estimated
    from ident.fitting.fit import Fit, fit
    from ident.identification.identify import Identification
    from ident.identification.noted import FitWarning, UnusedLoad
    from ident.metrics.in_waves import InWaves
    from ident.metrics.metric import Interval, Metric
    from ident.metrics.turning import SpiralPoint
    from ident.options import Conditions, Diagnostics, OwnReference, Work
    from ident.output import Results
    from ident.planning.matrix import Need, Plan
    from ident.planning.plan import plan
    from ident.schemas.describe import schema
    from ident.starter.write import write_starter
    from ident.validation.band_summary import BandSummary, VarianceShare
    from ident.validation.bands import Bands
    from ident.validation.board import BoardCase, ComparedError, Scoreboard
    from ident.validation.coverage import OutsideUse
    from ident.validation.other_boat import Saturated
    from ident.validation.result import ChannelError, Validation
    from ident.validation.scoreboard import scoreboard
    from ident.validation.sweep import SweepPoint
    from ident.validation.validate import validate
    from sim.files.errors import InputError
    from sim.flight.guidance import LineOfSight
    from sim.flight.plant import Plant
    from sim.flight.sensors import Sensors
    from sim.flight.series import Series
    from sim.flight.simulation import Simulation
    from sim.flight.trim import NoEquilibrium, Trim

__version__ = "0.1.0"

# Public name -> where it lives. The rooms are named by nouns, so that none hides a function here.
_PLACES = {
    "read_campaign": "ident.captive.campaign",
    "check": "ident.checks.checked",
    "plan": "ident.planning.plan",
    "plan_cases": "ident.cfd.batch",
    "fit": "ident.fitting.fit",
    "calibrate": "ident.calibration.version",
    "validate": "ident.validation.validate",
    "scoreboard": "ident.validation.scoreboard",
    "stability": "ident.analysis.stability",
    "write_starter": "ident.starter.write",
    "schema": "ident.schemas.describe",
    "Plant": "sim.flight.plant",
    "Sensors": "sim.flight.sensors",
    "LineOfSight": "sim.flight.guidance",
    "Database": "ident.database.versions",
    "DatabaseVersion": "ident.database.versions",
    "Difference": "ident.database.compare",
    "Change": "ident.database.compare",
    "Campaign": "ident.captive.campaign",
    "Checked": "ident.checks.checked",
    "Finding": "ident.checks.findings",
    "Plan": "ident.planning.matrix",
    "Need": "ident.planning.matrix",
    "Batch": "ident.cfd.batch",
    "Fit": "ident.fitting.fit",
    "Calibrated": "ident.calibration.result",
    "Validation": "ident.validation.result",
    "ChannelError": "ident.validation.result",
    "Simulation": "sim.flight.simulation",
    "StabilityMap": "ident.analysis.result",
    "Stability": "ident.analysis.result",
    "Linear": "ident.analysis.result",
    "Scoreboard": "ident.validation.board",
    "BoardCase": "ident.validation.board",
    "ComparedError": "ident.validation.board",
    "Metric": "ident.metrics.metric",
    "Interval": "ident.metrics.metric",
    "InWaves": "ident.metrics.in_waves",
    "SpiralPoint": "ident.metrics.turning",
    "SweepPoint": "ident.validation.sweep",
    "Bands": "ident.validation.bands",
    "BandSummary": "ident.validation.band_summary",
    "VarianceShare": "ident.validation.band_summary",
    "OutsideUse": "ident.validation.coverage",
    "Saturated": "ident.validation.other_boat",
    "Identification": "ident.identification.identify",
    "UnusedLoad": "ident.identification.noted",
    "FitWarning": "ident.identification.noted",
    "Estimated": "ident.estimates.predict",
    "CalibrationSummary": "ident.calibration.result",
    "MultiplierGroup": "ident.calibration.result",
    "Prior": "ident.calibration.result",
    "CrossedSeries": "ident.calibration.crossed",
    "LeftOut": "ident.calibration.result",
    "TrainedSeries": "ident.calibration.result",
    "Series": "sim.flight.series",
    "Trim": "sim.flight.trim",
    "StateSpaceModel": "ident.analysis.state_space",
    "Results": "ident.output",
    "Work": "ident.options",
    "Diagnostics": "ident.options",
    "Conditions": "ident.options",
    "OwnReference": "ident.options",
    "InputError": "sim.files.errors",
    "NoEquilibrium": "sim.flight.trim",
}

__all__ = [  # noqa: RUF022  (in the order of the work)
    "read_campaign",
    "check",
    "plan",
    "plan_cases",
    "fit",
    "calibrate",
    "validate",
    "scoreboard",
    "stability",
    "write_starter",
    "schema",
    "Plant",
    "Sensors",
    "LineOfSight",
    "Database",
    "DatabaseVersion",
    "Difference",
    "Change",
    "Campaign",
    "Checked",
    "Finding",
    "Plan",
    "Need",
    "Batch",
    "Fit",
    "Calibrated",
    "Validation",
    "ChannelError",
    "Simulation",
    "StabilityMap",
    "Stability",
    "Linear",
    "Scoreboard",
    "BoardCase",
    "ComparedError",
    "Metric",
    "Interval",
    "InWaves",
    "SpiralPoint",
    "SweepPoint",
    "Bands",
    "BandSummary",
    "VarianceShare",
    "OutsideUse",
    "Saturated",
    "Identification",
    "UnusedLoad",
    "FitWarning",
    "Estimated",
    "CalibrationSummary",
    "MultiplierGroup",
    "Prior",
    "CrossedSeries",
    "LeftOut",
    "TrainedSeries",
    "Series",
    "Trim",
    "StateSpaceModel",
    "Results",
    "Work",
    "Diagnostics",
    "Conditions",
    "OwnReference",
    "InputError",
    "NoEquilibrium",
]


register_with_gymnasium()


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'ident' has no attribute {name!r}")
    public = globals()[name] = getattr(import_module(_PLACES[name]), name)
    return public


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
