"""The distribution of the critical friction: histogram, and share of pads that have lost it."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from squeal.analysis.variations import CONFIDENCE, Scatter
from squeal.plots.maps import symbol_of
from squeal.plots.style import SINGLE, Drawing, origin, style


def scatter_drawing(scatter: Scatter, name: str) -> Drawing:
    """Histogram over the cumulative share with the intervals of its quantiles, one axis of mu.

    Pads without a threshold in the range are missing from the histogram, and keep the share
    below 1.
    """
    known, n = scatter.critical[np.isfinite(scatter.critical)], len(scatter.critical)
    parameter = scatter.name
    with style():
        figure = Figure(figsize=(SINGLE, 3.6))
        upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1, 1.3]})
        if len(known):
            bins = int(np.clip(np.sqrt(len(known)), 8, 60))
            upper.hist(known, bins, color="#CFE6F5", edgecolor="k", linewidth=0.4)
            share = np.arange(1, len(known) + 1) / n
            lower.step(known, share, where="post", color="k", label="share of pads")
        label = f"quantiles, {100 * CONFIDENCE:g} %"
        for q in scatter.quantiles:
            if q.mu is not None and q.low and q.high is not None:
                lower.plot([q.low, q.high], [q.level] * 2, color="#3498DB", lw=2.2, label=label)
                label = ""
        if scatter.mu > 0.0:
            low, high = lower.get_xlim()
            room = 0.05 * (high - low)
            look: Any = {"color": "#C8380E", "linestyle": "--", "linewidth": 0.8, "gid": "own"}
            upper.axvline(scatter.mu, **look)
            words = f"present {symbol_of(parameter)} = {scatter.mu:.4g}"
            lower.axvline(scatter.mu, label=words, **look)
            lower.set_xlim(min(low, scatter.mu - room), max(high, scatter.mu + room))
        friction = "friction " if parameter == "mu" else ""
        upper.set_ylabel("pads")
        lower.set(ylim=(0.0, 1.0), ylabel="share unstable")
        lower.set_xlabel(f"critical {friction}{symbol_of(parameter)}")
        figure.align_ylabels([upper, lower])
        figure.legend(*lower.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    levels = [f"{100 * q.level:g} % at {q.mu:.4g}" for q in scatter.quantiles if q.mu is not None]
    text = (
        f"Histogram and cumulative share of the critical {parameter} of {n} samples of {name}: "
        f"{', '.join(levels)}. Stable at {scatter.mu:.4g}: {100 * scatter.stable:.1f} %."
    )
    title = f"Scatter of the critical {parameter} of {name}"
    return Drawing(figure, text, title, origin(__name__))
