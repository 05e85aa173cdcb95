"""The distribution of the critical friction: histogram, and share of pads that have lost it."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from squeal.analysis.variations import CONFIDENCE, Scatter
from squeal.plots.coupling import symbol_of
from squeal.plots.style import SINGLE, Drawing, origin, style

BARS, CURVE, OWN = "#CFE6F5", "#3498DB", "#C8380E"


def scatter_figure(found: Scatter, parameter: str = "mu") -> Figure:
    """Histogram over the cumulative share with the intervals of its quantiles, one axis of mu.

    Pads without a threshold in the range are missing from the histogram, and keep the share
    below 1.
    """
    known, n = found.critical[np.isfinite(found.critical)], len(found.critical)
    with style():
        figure = Figure(figsize=(SINGLE, 3.6))
        upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1, 1.3]})
        if len(known):
            bins = int(np.clip(np.sqrt(len(known)), 8, 60))
            upper.hist(known, bins, color=BARS, edgecolor="k", linewidth=0.4)
            share = np.arange(1, len(known) + 1) / n
            lower.step(known, share, where="post", color="k", label="share of pads")
        label = f"quantiles, {100 * CONFIDENCE:g} %"
        for q in found.quantiles:
            if q.mu is not None and q.low and q.high is not None:
                lower.plot([q.low, q.high], [q.level] * 2, color=CURVE, lw=2.2, label=label)
                label = ""
        if found.mu > 0.0:
            low, high = lower.get_xlim()
            room = 0.05 * (high - low)
            look: Any = {"color": OWN, "linestyle": "--", "linewidth": 0.8, "gid": "own"}
            upper.axvline(found.mu, **look)
            words = f"present {symbol_of(parameter)} = {found.mu:.4g}"
            lower.axvline(found.mu, label=words, **look)
            lower.set_xlim(min(low, found.mu - room), max(high, found.mu + room))
        lower.set_ylim(0.0, 1.0)
        upper.set_ylabel("pads")
        lower.set_ylabel("share unstable")
        friction = "friction " if parameter == "mu" else ""
        lower.set_xlabel(f"critical {friction}{symbol_of(parameter)}")
        figure.align_ylabels([upper, lower])
        figure.legend(*lower.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def scatter_drawing(name: str, found: Scatter, parameter: str = "mu") -> Drawing:
    """The figure, ready to be saved."""
    quantiles = ", ".join(
        f"{100 * q.level:g} % at {q.mu:.4g}" for q in found.quantiles if q.mu is not None
    )
    text = (
        f"Histogram and cumulative share of the critical {parameter} of {len(found.critical)} "
        f"samples of {name}: {quantiles}. Stable at {found.mu:.4g}: {100 * found.stable:.1f} %."
    )
    title = f"Scatter of the critical {parameter} of {name}"
    return Drawing(scatter_figure(found, parameter), text, title, origin(__name__))
