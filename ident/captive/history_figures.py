"""Plots of reduced time histories: channels, what was cut, what was fitted."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ident.captive.histories import Reduced
from ident.output import whole
from ident.text import in_figure

_UNITS = {**dict.fromkeys("XYZ", "N"), **dict.fromkeys("KMN", "N m")}
_POINTS = 2000


def history_figure(reduced: Reduced, path: Path) -> Path:
    """Draw one reduced history.

    Parameters
    ----------
    reduced : From ``Campaign.reduced``; loads in the campaign's frame, as measured.
    path : File to write; the suffix chooses the format.

    Returns
    -------
    ``path``.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    fit = reduced.fit
    step = max(1, len(fit.time) // _POINTS)
    figure, axes = plt.subplots(
        len(reduced.loads), 1, figsize=(9, 1.6 * len(reduced.loads) + 1), sharex=True, squeeze=False
    )
    for c, (name, ax) in enumerate(zip(reduced.loads, axes[:, 0], strict=True)):
        ax.plot(fit.time[::step], fit.channels[::step, c], color="0.6", lw=0.8, label="measured")
        used = fit.time >= fit.start
        ax.plot(fit.time[used][::step], fit.model[used][::step, c], color="tab:blue", lw=1.2, label="fit")
        error = float(np.sqrt(max(fit.covariance[c, 0, 0], 0.0)))
        ax.axvspan(fit.time[0], fit.start, color="tab:red", alpha=0.1 if fit.cut else 0.0)
        low, high = fit.channels[used, c].min(), fit.channels[used, c].max()
        room = max(high - low, 0.05 * max(abs(low), abs(high)), 1e-12)
        # A start-up peak may leave the picture; what is used may not.
        ax.set_ylim(low - room, high + room)
        ax.set_ylabel(f"{name} [{_UNITS.get(name, 'SI')}]")
        ax.set_title(f"constant part {fit.values[0, c]:.4g} ± {error:.2g}", fontsize=8, loc="right")
    axes[0, 0].legend(loc="upper left", fontsize=8)
    axes[-1, 0].set_xlabel("time [s]")
    figure.suptitle(in_figure(f"{reduced.run_id}: {reduced.kind}, {fit.verdict}"[:160]), fontsize=9, wrap=True)
    figure.tight_layout()
    with whole(path) as part:
        figure.savefig(part, dpi=110)
    plt.close(figure)
    return path


def history_figures(reduced: tuple[Reduced, ...], folder: Path) -> list[Path]:
    """One PNG a history, named after its run."""
    names = [re.sub(r"[^\w.+-]", "_", one.run_id)[:100] for one in reduced]
    return [history_figure(one, folder / f"history_{name}.png") for one, name in zip(reduced, names, strict=True)]
