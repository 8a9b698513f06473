"""`ident fit`: read a campaign, identify, commit one version, say what was done."""

from __future__ import annotations

import json
import logging
import math
import os
from collections.abc import Collection
from dataclasses import asdict, astuple, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ident.captive.campaign import Campaign, find_campaigns, read_campaign
from ident.captive.campaign_file import CampaignFile
from ident.captive.combine import by_vehicle
from ident.checks.check import check_campaign, refuse_errors, seen_in_runs
from ident.checks.findings import SEVERITIES, Finding
from ident.cluster import cluster
from ident.database.provenance import conversions, run_sources
from ident.database.store import commit, database_rows, digest, no_rows
from ident.deprecation import gathered
from ident.estimates.predict import Estimated, predicted
from ident.estimates.turning import Given, Shared
from ident.fitting.coefficients import coefficient_summaries
from ident.fitting.summary import summary
from ident.identification.identify import Identification, identify
from ident.options import Work
from ident.output import Results, html_table
from ident.processes import meanwhile, withheld
from ident.text import on_screen
from sim.files.errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Fit:
    """One fitted campaign, committed.

    Attributes
    ----------
    campaign, identification : What was read and identified.
    rows : The database rows, one a tabulated value; columns as in ``DatabaseVersion.rows``.
    version : Number of the version that holds them.
    new : False when the latest version held them already.
    digest : SHA-256 of the content of the rows.
    findings : Of the quality checks, errors first.
    estimates : What became of each named estimate; empty for a version of the runs alone.

    Examples
    --------
    >>> import ident
    >>> (done,) = ident.fit("my-boat/captive", db="coeff_db")
    >>> done.version, done.new
    (0, False)
    >>> int(done.coefficients.loc["N_v", "runs"])
    12
    """

    campaign: Campaign
    identification: Identification
    rows: pd.DataFrame
    version: int
    new: bool
    digest: str
    findings: list[Finding]
    estimates: list[Estimated]

    @property
    def coefficients(self) -> pd.DataFrame:
        """One row a coefficient: points, measured, runs, estimated, median relative error, worst residual, quality."""
        import pandas as pd

        return pd.DataFrame([asdict(one) for one in coefficient_summaries(self.rows)]).set_index("coefficient")

    def to_dict(self) -> dict[str, Any]:
        """The fit for a program to read."""
        return {
            "campaign": self.campaign.header.name,
            "vehicle": self.campaign.vehicle.name,
            "version": self.version,
            "new": self.new,
            "digest": self.digest,
            "runs": len(self.campaign.runs),
            "conversions": conversions(self.campaign),
            "measured_only": not self.estimates,
            "estimates": [vars(e) for e in self.estimates],
            "coefficients": [asdict(one) for one in coefficient_summaries(self.rows)],
            "unused": [one.to_dict() for one in self.identification.unused],
            "warnings": [one.to_dict() for one in self.identification.warnings],
            "checks": [f.as_json() for f in self.findings],
            "between": [asdict(one) for one in self.identification.between],
        }

    def __repr__(self) -> str:
        return f"Fit({self.campaign.header.name}: version {self.version}, {len(self.rows)} rows)"

    def _repr_html_(self) -> str:
        title = f"{self.campaign.header.name}: version {self.version}, digest {self.digest[:16]}"
        table = self.coefficients
        rows = [
            (name, *row[:4], "-" if row[4] is None else f"{100 * row[4]:.1f} %", f"{row[5]:.1f}")
            for name, *row in table.itertuples()
        ]
        return html_table(title, ("coefficient", *table.columns[:6]), rows)


def given_of(campaign: Campaign) -> Given:
    """What estimates need of a campaign beside its rows."""
    runs, header = campaign.runs, campaign.header
    arm = runs[runs["test"] == "rotating_arm"]
    speed = {
        str(r): float(u) for r, u in zip(arm["run_id"], arm["U"], strict=True) if math.isfinite(float(u)) and u > 0.0
    }
    shared = []
    for one in header.shared_error:
        chosen = runs[runs["test"].isin(one.tests)] if one.tests else runs
        chosen = chosen[chosen["part"].isin(one.parts)] if one.parts else chosen
        if chosen.empty:
            where = f"{header.name}, key shared_error, {one.name}"
            raise InputError(where, f"no run of {' '.join(one.tests + one.parts)}", "tests and parts of the campaign")
        offset = {load: header.frame.frame.sign(load) * prime for load, prime in one.offset.items()}
        ids = frozenset(chosen["run_id"].astype(str))
        shared.append(Shared(one.name, one.relative, ids, tuple(one.loads), offset))
    yaw = (header.pure_yaw.taken_off, header.pure_yaw.sigma) if header.pure_yaw else None
    planes = runs[runs["test"] == "plane_deflection"]
    propelled = bool((planes["n"] > 0.0).any()) if "n" in planes else False
    return Given(speed, yaw, tuple(shared), header.complete_from == "lines", propelled)


def completed(campaign: Campaign, rows: pd.DataFrame) -> pd.DataFrame:
    """The predicted rows of a campaign, from those that its runs alone gave."""
    return predicted(campaign.vehicle, rows, given_of(campaign))[0]


def _options(header: CampaignFile) -> dict[str, Any]:
    """What the campaign states of its errors, with where it is said."""
    stated: dict[str, Any] = {"uncertainty": header.uncertainty.model_dump()}
    if header.pure_yaw is not None:
        stated["pure_yaw"] = header.pure_yaw.model_dump()
    return stated | {
        f"shared_error {one.name}": one.model_dump(exclude={"name"}, exclude_defaults=True)
        for one in header.shared_error
    }


def metadata(
    campaign: Campaign,
    identification: Identification,
    message: str,
    findings: list[Finding],
    estimates: list[Estimated],
    force: str = "",
) -> dict[str, str]:
    """What a commit carries beside its rows: provenance, inputs, conversions, estimates, notes of the fit."""
    header, given = campaign.header, given_of(campaign)
    propelled = {"propelled": True} if given.propelled else {}
    # A version that was fitted without an error of the checks does not carry the key.
    forced = {"forced": force.strip()} if any(f.severity == "error" for f in findings) else {}
    return (
        {
            "campaign": header.name,
            "facility": header.facility,
            "provenance": header.provenance.strip(),
            "frame": f"x {header.frame.x}, y {header.frame.y}, z {header.frame.z}",
            "inputs": json.dumps(campaign.digests),
            "conversions": json.dumps(conversions(campaign)),
            "runs": json.dumps(run_sources(campaign)),
            "options": json.dumps(_options(header)),
            "unused": json.dumps([astuple(one) for one in identification.unused]),
            "warnings": json.dumps([astuple(one) for one in identification.warnings]),
            "quality": json.dumps({k: q.model_dump() for k, q in header.quality.items()}),
            "checks": json.dumps([f.as_json() for f in findings]),
            "estimates": json.dumps([vars(e) for e in estimates]),
            "given": json.dumps(
                {"speed": given.speed, "pure_yaw": given.pure_yaw, "complete": given.complete} | propelled
            ),
            "message": message,
        }
        | forced
        | ({"between": json.dumps([asdict(one) for one in identification.between])} if identification.between else {})
    )


@gathered(
    "0.2",
    {"work": Work},
    ("wait", "tell", "measured_only", "without", "dask"),
    wait="work",
    tell="work",
    dask="work",
)
def fit(
    folder: str | os.PathLike[str],
    db: str | os.PathLike[str] = "coeff_db",
    message: str = "",
    force: str = "",
    *,
    measured_only: bool = False,
    without: Collection[str] = (),
    work: Work = Work(),  # noqa: B008  (frozen)
) -> Results[Fit]:
    """Identify the coefficients of every campaign at or below a folder; commit one version each.

    Runs are turned to the program frame (x forward, y starboard, z down), made dimensionless and decoupled in order,
    with the errors of what was subtracted. What they do not say, named estimates do
    (``ident.estimates``): a row names its own. Either every campaign can be fitted, or nothing is committed.

    Parameters
    ----------
    folder : Campaign folder, or a folder of campaign folders.
    db : Folder or object-store URL of the database; made when there is none.
    message : Stored with the version.
    force : Why a campaign is fitted although a check finds an error, stored with the version; empty to refuse it.
    measured_only : Leave all estimates out.
    without : Names of estimates to leave out.
    work : How long to wait, who is told, and on which machines; the result does not depend on it.

    Returns
    -------
    Results of Fit
        One a vehicle, in folder order: campaigns of one are fitted together, with the error between facilities.

    Raises
    ------
    InputError
        For bad input or an error of a check, before anything is committed; for a reason where there is no error.

    References
    ----------
    Gertler, M., Hagen, G. R., "Standard equations of motion for submarine simulation", NSRDC Report 2510, 1967.

    Feldman, J., "DTNSRDC revised standard submarine equations of motion", DTNSRDC/SPD-0393-09, 1979.

    Kim, Y., "Development and Validation of Hydrodynamic Model for Near Free Surface Maneuvers of BB2 Joubert
    Generic Submarine", PhD thesis, University of Iowa, 2021, doi 10.17077/etd.005772, Eqs. (17)-(31).

    Examples
    --------
    >>> import ident
    >>> for done in ident.fit("my-boat/captive", db="coeff_db"):
    ...     print(done.campaign.vehicle.name, done.version, len(done.rows))
    my-boat 0 59
    """
    ready = _ready(Path(folder), force, measured_only, without, work)
    done = []
    for one, findings, rows, estimates in ready:
        said = metadata(one.campaign, one, message, findings, estimates, force)
        version, new = commit(os.fspath(db), rows, said, work.wait)
        done.append(Fit(one.campaign, one, rows, version, new, digest(rows), findings, estimates))
        _log_fit(done[-1])
    return Results(done)


def _ready(
    folder: Path, force: str, measured_only: bool, without: Collection[str], work: Work
) -> list[tuple[Identification, list[Finding], pd.DataFrame, list[Estimated]]]:
    """Every campaign identified and checked, its rows, and what became of each estimate."""
    with cluster(work.dask) as spread:
        paths = find_campaigns(folder)
        read, paths = by_vehicle([read_campaign(path, tell=work.tell, spread=spread) for path in paths], paths)
        # Beside the rest where two processes may; a copy would not have the threads of the client of a cluster.
        processes = None if work.dask else work.workers
        with meanwhile(partial(_seen, paths, read), processes) as seen:
            identified = [identify(campaign, work.tell, spread) for campaign in read]
            # What a check refuses is said before what estimates cannot do with it.
            estimated = withheld(partial(_every_rows, identified, measured_only, without))
            checked = _checked(paths, identified, seen(), force, work)
    rows = estimated()
    for one, (table, _) in zip(identified, rows, strict=True):
        if table.empty:
            nothing = "no run, and no estimate that works without"
            raise InputError(one.campaign.header.name, nothing, "runs, or a vehicle whose geometry file has a hull")
    return [(one, findings, *given) for one, findings, given in zip(identified, checked, rows, strict=True)]


def _log_fit(done: Fit) -> None:
    applied = " ".join(e.name for e in done.estimates if e.applied)
    said = {"campaign": done.campaign.header.name, "version": done.version, "estimates": applied}
    _log.info("campaign fitted", extra=said)


def _seen(paths: list[Path], read: list[Campaign]) -> list[dict[str, list[Finding]]]:
    """What checks see in the runs of every campaign alone."""
    return [seen_in_runs(campaign, path) for path, campaign in zip(paths, read, strict=True)]


def _checked(
    paths: list[Path],
    identified: list[Identification],
    seen: list[dict[str, list[Finding]]],
    force: str,
    work: Work,
) -> list[list[Finding]]:
    """What the checks find in every campaign; an error is refused without a reason."""
    each = zip(paths, identified, seen, strict=True)
    checked = [check_campaign(one.campaign, path, one, work.tell, known) for path, one, known in each]
    for one, findings in zip(identified, checked, strict=True):
        _log_checks(one.campaign, findings)
    if not force.strip():
        for path, findings in zip(paths, checked, strict=True):
            refuse_errors(path, findings)
    elif not any(f.severity == "error" for findings in checked for f in findings):
        raise InputError("--force", repr(force[:60]), "nothing: no check finds an error")
    return checked


def _every_rows(
    identified: list[Identification], measured_only: bool, without: Collection[str]
) -> list[tuple[pd.DataFrame, list[Estimated]]]:
    """Database rows of every campaign, and what became of each estimate."""
    return [_rows(one, measured_only, without) for one in identified]


def _rows(one: Identification, measured_only: bool, without: Collection[str]) -> tuple[pd.DataFrame, list[Estimated]]:
    """Database rows of a campaign, and what became of each estimate."""
    rows = _measured(one.campaign, one, measured_only)
    return (rows, []) if measured_only else predicted(one.campaign.vehicle, rows, given_of(one.campaign), without)


def _log_checks(campaign: Campaign, findings: list[Finding]) -> None:
    counts = {severity: sum(f.severity == severity for f in findings) for severity in SEVERITIES}
    _log.info("campaign checked", extra={"campaign": campaign.header.name, **counts})


def _measured(campaign: Campaign, identified: Identification, measured_only: bool) -> pd.DataFrame:
    """What the runs alone give; nothing for a campaign without runs, which estimates may start from."""
    return no_rows() if campaign.runs.empty and not measured_only else database_rows(identified)


def _estimates_line(estimates: list[Estimated]) -> str:
    """Which estimates stand beside the runs; why others do not is in the report."""
    applied = [one.name for one in estimates if one.applied]
    return f"estimates beside the runs: {', '.join(applied) or 'none applies'}" if estimates else ""


def show(done: Fit, console: Console) -> None:
    """Print the fit on one screen; all of it is in ``to_dict`` and in the version's report.

    Parameters
    ----------
    done : The fit.
    console : Where to print.
    """
    from rich.text import Text

    state = "committed" if done.new else "unchanged, nothing committed: already"
    last = f"{state} version {done.version}  digest {done.digest[:16]}"
    table = coefficient_summaries(done.rows)
    for style, line in summary(done.identification, done.rows, done.findings, table, last, console.width):
        console.print(Text(on_screen(line), style=style), no_wrap=True, overflow="crop")
    if said := _estimates_line(done.estimates):
        console.print(Text(on_screen(said)))
