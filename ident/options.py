"""What the public functions may be asked beyond their subject, in classes of what belongs together."""

from __future__ import annotations

import os
from dataclasses import dataclass

from ident.output import Tell, silent

# How long a writer waits for another [s].
WAIT = 60.0


@dataclass(frozen=True)
class Work:
    """How the work of ``fit`` and ``calibrate`` is done, and who is told of it; no result depends on it.

    Attributes
    ----------
    wait : How long to wait for other writers of the database [s].
    tell : Called with what is done, how much of it is, and of how much (0 where that is not known).
    dask : Of ``fit``: address of a Dask scheduler whose workers, which see the same folders, read the files,
        reduce their histories and solve the blocks of unknowns.
    workers : Of ``calibrate``: threads; all cores when None. Of ``fit``: processes, of which a second one
        checks the runs while the first one identifies and estimates; one when None, and 0 for one a core.

    Examples
    --------
    >>> import ident
    >>> seen = []
    >>> _ = ident.fit("my-boat/captive", db="coeff_db", work=ident.Work(tell=lambda what, done, of: seen.append(what)))
    >>> "identify" in " ".join(seen)
    True
    """

    wait: float = WAIT
    tell: Tell = silent
    dask: str | None = None
    workers: int | None = None


@dataclass(frozen=True)
class Diagnostics:
    """What ``calibrate`` also computes of its posterior (draws and design by the extra ``posterior``).

    Attributes
    ----------
    posterior : Draws of it, which the quadratic at the optimum is held against; 0 for none.
    sensitivity : Size of a design, a power of two, by which it is said which prior decides each channel; 0 for none.
    seed : Of draws and design; 0 when None.
    cross_validate : Whether each maneuver is predicted by a calibration on the others.

    Examples
    --------
    >>> import ident
    >>> ident.Diagnostics(posterior=4000, seed=3)
    Diagnostics(posterior=4000, sensitivity=0, seed=3, cross_validate=False)
    """

    posterior: int = 0
    sensitivity: int = 0
    seed: int | None = None
    cross_validate: bool = False


@dataclass(frozen=True)
class Conditions:
    """What ``validate`` flies a case at instead of the case's own; its references then do not apply.

    Attributes
    ----------
    speed_mps : U.
    depth_m : D0, of the sail top below the calm surface.
    angle_deg : Of planes or rudder.

    Examples
    --------
    >>> import ident
    >>> ident.Conditions(speed_mps=2.0)
    Conditions(speed_mps=2.0, depth_m=None, angle_deg=None)
    """

    speed_mps: float | None = None
    depth_m: float | None = None
    angle_deg: float | None = None


@dataclass(frozen=True)
class OwnReference:
    """A record of yours that ``validate`` holds a case against, and how it is to be read.

    Attributes
    ----------
    path : A recorded trial as ``ident trial`` reads it, or a CSV of source, channel, t or s, value, unit, and sigma
        where it is known.
    frame : ``source`` (x aft, z up) or ``program`` (x forward, z down); the case's when None.
    trial : ``trial.toml`` with what a recorded trial does not say of itself.

    Examples
    --------
    >>> import ident
    >>> ident.OwnReference("mine.csv", frame="program").frame
    'program'
    """

    path: str | os.PathLike[str]
    frame: str | None = None
    trial: str | os.PathLike[str] | None = None
