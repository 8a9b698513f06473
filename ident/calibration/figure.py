"""Figure of a calibration: prior, captive error and posterior of every group."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence

import numpy as np

from ident.calibration.result import MultiplierGroup
from ident.text import in_figure


def prior_and_posterior(groups: Sequence[MultiplierGroup], stamp: str) -> str:
    """Prior, posterior and captive range of each multiplier, as an SVG ``data:`` address.

    Parameters
    ----------
    groups : Those of the calibration.
    stamp : Vehicle, version and frame, printed below the title.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 0.34 * len(groups) + 1.6), layout="constrained")
    axes = figure.subplots()
    place = np.arange(len(groups))[::-1]
    for y, group in zip(place, groups, strict=True):
        neutral = 1.0 if group.kind == "multiplier" else 0.0
        reach = 2.0 * group.captive_sigma
        axes.plot([neutral - reach, neutral + reach], [y, y], color="0.85", lw=9, solid_capstyle="butt", zorder=1)
        prior, after = group.prior, group.posterior
        axes.errorbar(prior.mean, y + 0.16, xerr=prior.sigma, fmt="o", color="0.45", ms=3.5, lw=1.1)
        colour = "#a3161d" if group.beyond_captive else "#1d6b36"
        axes.errorbar(after.value, y - 0.16, xerr=after.sigma, fmt="s", color=colour, ms=4, lw=1.6)
    axes.axvline(1.0, color="0.6", lw=0.8, zorder=0)
    axes.set_yticks(place, [in_figure(g.name.replace("_", " ")) for g in groups])
    axes.set_xlabel("multiplier on the captive coefficients [-] (offsets: prime form)")
    axes.set_title(
        f"Prior (grey), posterior (green; red: beyond captive), two captive standard errors (bar)\n{in_figure(stamp)}",
        fontsize=9,
    )
    axes.grid(axis="x", color="0.92")
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(stream.getvalue()).decode()
