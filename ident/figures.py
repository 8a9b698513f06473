"""Figures of flown cases, labelled with units, frame and version."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ident.bands import Bands
from ident.validate import Validation
from sim.simulate import CHANNELS

FRAME = "frame: x forward, y starboard, z down; psi and r positive to starboard"
_LABELS = {
    "psi": "heading psi",
    "theta": "pitch theta",
    "phi": "heel phi",
    "u": "surge speed u",
    "v": "sway speed v",
    "w": "heave speed w",
    "p": "roll rate p",
    "q": "pitch rate q",
    "r": "yaw rate r",
    "x": "advance x",
    "y": "transfer y",
    "z": "depth of the origin z",
    "u_over_U0": "surge speed u/U0",
    "dz_over_L0": "depth change dz/L",
}
_STYLE = {"EXP": ("k", "o"), "CFD": ("tab:blue", "s")}


def _shown(channel: str, values: np.ndarray, unit: str) -> tuple[np.ndarray, str]:
    """Angles in degrees, everything else as it is."""
    if unit.startswith("rad"):
        return np.degrees(values), unit.replace("rad", "deg")
    return values, unit


def case_figure(done: Validation, path: Path, bands: Bands | None = None) -> Path:
    """Draw the simulated channels over the references.

    Parameters
    ----------
    done : A flown case.
    path : File to write; the suffix chooses the format.
    bands : Flown samples, drawn as 50 and 95 % bands.

    Returns
    -------
    ``path``.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    reference = done.case.reference
    channels = reference.channels if reference else ["psi", "theta", "phi", "u", "z", "r"]
    rows = (len(channels) + 1) // 2
    figure, axes = plt.subplots(rows, 2, figsize=(11, 2.7 * rows), sharex=True, layout="constrained")
    for channel, axis in zip(channels, np.ravel(axes), strict=False):
        unit = CHANNELS[channel]
        for source in [*reference.compare, reference.published_model] if reference else []:
            series = done.reference[source or ""]
            if channel not in series:
                continue
            time, value, unit = series[channel]
            values, _ = _shown(channel, value, unit)
            if reference and source == reference.published_model:
                axis.plot(time, values, color="tab:green", lw=1.2, ls="--", label=f"published model ({source})")
            else:
                colour, marker = _STYLE.get(str(source), ("tab:gray", "^"))
                axis.plot(time, values, color=colour, marker=marker, ms=2.5, lw=0.6, markevery=4, label=source)
        values, unit = _shown(channel, done.simulation[channel], CHANNELS[channel])
        if bands:
            for level, alpha in (("95", 0.15), ("50", 0.3)):
                low, high = (_shown(channel, edge, CHANNELS[channel])[0] for edge in bands.band(channel, level))
                axis.fill_between(bands.time, low, high, color="tab:red", alpha=alpha, lw=0, label=f"{level} % band")
        axis.plot(done.simulation["t"], values, color="tab:red", lw=1.6, label="simulated from the database")
        axis.set_ylabel(f"{_LABELS.get(channel, channel)} [{unit}]")
        axis.grid(alpha=0.3)
    for axis in np.atleast_2d(axes)[-1]:
        axis.set_xlabel("time t [s]")
    handles, labels = np.ravel(axes)[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    database = done.result["database"]
    figure.suptitle(
        f"{done.case.title}, {done.case.vehicle}\n"
        f"database version {database['version']} ({database['digest'][:16]}); {FRAME}",
        fontsize=10,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)
    plt.close(figure)
    return path
