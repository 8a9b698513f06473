"""Session fixtures: the bundled campaign, what it identifies, and the model it gives."""

from __future__ import annotations

import os
from pathlib import Path

# Tests run side by side, one a core: threads of linear algebra would only stand in each other's way.
if "PYTEST_XDIST_WORKER" in os.environ:
    for library in ("OMP", "OPENBLAS", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import numpy as np
import pytest
from damaged_databases import commits, times
from deltalake import DeltaTable
from hypothesis import settings
from small_campaign import fitted, write

from ident.captive.campaign import read_campaign
from ident.database.store import commit, database_rows
from ident.identification.identify import identify
from sim.boat.catalogue import OUTPUTS
from sim.boat.coefficients import Coefficients
from sim.boat.forces import axis_values, boat_features, multiplier, plane_features
from sim.boat.mass import Environment
from sim.kernel.assemble import assemble

ROOT = Path(__file__).parents[1]

# A run that gates a change repeats itself; runs at a desk explore.
settings.register_profile("ci", derandomize=True)
if os.environ.get("CI"):
    settings.load_profile("ci")


# Files that take minutes begin first: a file is one worker's, and the last to begin is waited for.
LONGEST = ("test_whatever_a_source_declares_counts", "test_whatever_a_campaign_declares_counts")


def pytest_collection_modifyitems(items):
    """The longest files first, the others in their order."""
    items.sort(key=lambda item: item.path.stem not in LONGEST)


@pytest.fixture(scope="session")
def campaign():
    return read_campaign(ROOT / "raw_captive_data" / "bb2")


@pytest.fixture(scope="session")
def identification(campaign):
    return identify(campaign)


@pytest.fixture(scope="session")
def rows(identification):
    return database_rows(identification)


@pytest.fixture(scope="session")
def coefficients(campaign, rows):
    return Coefficients(campaign.vehicle, rows)


@pytest.fixture(scope="session")
def environment():
    return Environment(1025.0, 9.81)


@pytest.fixture(scope="session")
def model(coefficients, environment):
    return assemble(coefficients, environment)


@pytest.fixture(scope="session")
def fitted_db(rows, tmp_path_factory):
    path = str(tmp_path_factory.mktemp("database") / "coeff_db")
    commit(path, rows, {"message": "test"})
    return path


@pytest.fixture(scope="session")
def plain_loads(coefficients, environment):
    """Loads as the term table reads, without the kernel: sum of scale * C(axes) * m(state).

    Called with a state and controls; returns the six loads and, for tolerances, the six sums
    of absolute contributions.
    """
    vehicle = coefficients.vehicle
    scales = (environment.density, vehicle.particulars.length.value, vehicle.propeller.diameter.value)
    sail_top = vehicle.particulars.sail_top.value[2]
    wake = float(coefficients.get("w_T").values[0])
    deduction = coefficients.get("t")

    def loads(y, c):
        n = c[-1]
        advance = (1.0 - wake) * y[0] / (n * scales[2]) if n else 0.0
        boat = boat_features(y[:3], y[3:6], y[8] + sail_top, n, advance)
        own = {
            p.name: boat | plane_features(p, y[:3], y[3:6], angle)
            for p, angle in zip(vehicle.planes, c[:-1], strict=True)
        }
        total, size = np.zeros(6), np.zeros(6)
        for k in coefficients:
            if k.term.is_acceleration or not k.term.output:
                continue
            features = own.get(k.part, boat)
            value = k.at(axis_values(k.term, features)) * multiplier(k.term, features) * k.term.scale(*scales)
            if k.term.name == "KT":
                value *= 1.0 - deduction.at(axis_values(deduction.term, features))
            total[OUTPUTS.index(k.term.output)] += value
            size[OUTPUTS.index(k.term.output)] += abs(value)
        return total, size

    return loads


# Why a test may be left out. Anything else that is left out where changes are gated is a fault.
_MAY_BE_ABSENT = (
    "the benchmark's sheets are not distributed with the program",  # KVLCC2 as HMRI's sheets lie
    "needs ffmpeg",
    "capytaine is installed",
    "the optional extra 'panels' (capytaine) is not installed",
    "needs the extra dask",
    "needs a C compiler",
)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Where changes are gated, a test that is left out for a reason not listed fails."""
    report = yield
    if report.skipped and os.environ.get("CI") and not hasattr(report, "wasxfail"):
        reason = str(call.excinfo.value) if call.excinfo else ""
        if not any(text in reason for text in _MAY_BE_ABSENT):
            report.outcome = "failed"
            report.longrepr = f"{item.nodeid}: left out without a reason listed in tests/conftest.py: {reason}"
    return report


@pytest.fixture(scope="session")
def few_rows(tmp_path_factory):
    """Rows of a small campaign, for what is about databases and not about their content."""
    return fitted(write(tmp_path_factory.mktemp("small") / "campaign"))


@pytest.fixture(scope="session")
def three_versions(few_rows, tmp_path_factory):
    """A database of three versions of two vehicles."""
    path = tmp_path_factory.mktemp("three") / "db"
    commit(str(path), few_rows, {"message": "first", "campaign": "small"})
    commit(str(path), few_rows.assign(vehicle="suboff", value=few_rows["value"] * 3), {"message": "\u00b0"})
    commit(str(path), few_rows.assign(value=few_rows["value"] * 2), {"message": "third", "trained": "[]"})
    return path


@pytest.fixture(scope="session")
def checkpointed(few_rows, tmp_path_factory):
    """Twelve versions and a checkpoint, which the storage engine writes of itself every hundred versions."""
    path = tmp_path_factory.mktemp("checkpointed") / "db"
    commits(str(path), few_rows, 11)
    DeltaTable(path).create_checkpoint()
    commit(str(path), times(few_rows, 5.0), {})
    return path
