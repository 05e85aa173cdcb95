"""The distribution of critical frictions or growth rates: histogram, cumulative share, indices."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from squeal.analysis.scatter import CONFIDENCE, Scatter
from squeal.plots.maps import symbol_of
from squeal.plots.style import SINGLE, Drawing, origin, style


def scatter_drawing(scatter: Scatter, name: str) -> Drawing:
    """Histogram over the cumulative share with the intervals of its quantiles, one axis of values.

    Pads without a threshold in the range are missing from the histogram, and keep the share
    below 1. Below, where they were computed, the Sobol indices of each parameter.
    """
    known, n = scatter.values[np.isfinite(scatter.values)], len(scatter.values)
    growth, parameter = scatter.of == "growth", scatter.name
    own, level = (0.0, "stability") if growth else (scatter.mu, f"{scatter.mu:.4g}")
    friction = "friction " if parameter == "mu" else ""
    what = "growth rate, 1/s" if growth else f"critical {friction}{symbol_of(parameter)}"
    heights = [1.0, 1.3, *[0.25 + 0.16 * len(scatter.indices)] * bool(scatter.indices)]
    with style():
        figure = Figure(figsize=(SINGLE, 1.6 * sum(heights)))
        upper, lower, *more = figure.subplots(len(heights), 1, height_ratios=heights)
        upper.sharex(lower)
        upper.tick_params(labelbottom=False)
        if len(known):
            width = np.ptp(known) / np.clip(np.round(np.sqrt(len(known))), 8, 60) or 1.0
            edge = own + 1e-6 * width  # what neither grows nor decays lies below the limit
            low, high = (np.array([known.min(), known.max()]) - edge) / width
            edges = edge + width * np.arange(np.floor(low), np.floor(high) + 2)
            upper.hist(known, edges, color="#CFE6F5", edgecolor="k", linewidth=0.4)
            share = np.arange(1, len(known) + 1) / n
            lower.step(known, share, where="post", color="k", label="share of samples")
        label = f"quantiles, {100 * CONFIDENCE:g} %"
        for q in scatter.quantiles:
            if None not in (q.value, q.low, q.high):
                ends = [q.low, q.high]
                lower.plot(ends, [q.level] * 2, color="#3498DB", lw=2.2, label=label)
                label = ""
        if growth or own > 0.0:
            low, high = lower.get_xlim()
            room = 0.05 * (high - low)
            look: Any = {"color": "#C8380E", "linestyle": "--", "linewidth": 0.8, "gid": "own"}
            upper.axvline(own, **look)
            words = "stability limit" if growth else f"present {symbol_of(parameter)} = {level}"
            lower.axvline(own, label=words, **look)
            lower.set_xlim(min(low, own - room), max(high, own + room))
        upper.set_ylabel("samples")
        lower.set(ylim=(0.0, 1.0), ylabel="share below" if growth else "share unstable")
        lower.set_xlabel(what)
        for axes in more:
            places = np.arange(len(scatter.indices))
            names = [symbol_of(one.parameter) for one in scatter.indices]
            for order, color, up in (("total", "#CFE6F5", 0.19), ("first", "#3498DB", -0.19)):
                sizes = np.array([getattr(one, order) for one in scatter.indices])
                bounds = np.array([getattr(one, f"{order}_interval") for one in scatter.indices])
                about = np.abs(bounds.T - sizes)
                bars: Any = {"height": 0.36, "color": color, "label": order}
                axes.barh(places - up, sizes, xerr=about, error_kw={"lw": 0.8}, **bars)
            axes.set(yticks=places, yticklabels=names, xlim=(0.0, None))
            axes.set_xlabel("Sobol index")
            axes.invert_yaxis()
            axes.legend()
        figure.align_ylabels([upper, lower])
        figure.legend(*lower.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    levels = [
        f"{100 * q.level:g} % at {q.value:.4g}" for q in scatter.quantiles if q.value is not None
    ]
    text = (
        f"Histogram and cumulative share of the {what} of {n} samples of {name}: "
        f"{', '.join(levels)}. Stable{'' if growth else f' at {level}'}: "
        f"{100 * scatter.stable:.1f} %."
    )
    kind = "growth rates" if growth else f"critical {parameter}"
    return Drawing(figure, text, f"Scatter of the {kind} of {name}", origin(__name__))
