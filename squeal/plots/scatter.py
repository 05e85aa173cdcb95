"""The distribution of critical frictions or growth rates: histogram, cumulative share, indices."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.plots.maps import symbol_of
from squeal.plots.style import SINGLE, Drawing, origin, style
from squeal.results.scatter import CONFIDENCE, Scatter


def scatter_drawing(scatter: Scatter, name: str) -> Drawing:
    """Histogram over the cumulative share with the intervals of its quantiles, one axis of values.

    Pads without a threshold in the range are missing from the histogram, and keep the share
    below 1. Below, where they were computed, the Sobol indices of each parameter.
    """
    known = scatter.values[np.isfinite(scatter.values)]
    n = len(scatter.values)
    of_growth = scatter.of == "growth"
    parameter = scatter.name
    if of_growth:
        limit = 0.0
        limit_name = "stability limit"
        what = "growth rate, 1/s"
    else:
        limit = scatter.mu
        limit_name = f"present {symbol_of(parameter)} = {limit:.4g}"
        friction = "friction " if parameter == "mu" else ""
        what = f"critical {friction}{symbol_of(parameter)}"
    heights = [1.0, 1.3]
    if scatter.indices:
        heights.append(0.25 + 0.16 * len(scatter.indices))
    with style():
        figure = Figure(figsize=(SINGLE, 1.6 * sum(heights)))
        upper, lower, *more = figure.subplots(len(heights), 1, height_ratios=heights)
        upper.sharex(lower)
        upper.tick_params(labelbottom=False)
        if len(known):
            edges = _bin_edges(known, limit)
            upper.hist(known, edges, color="#CFE6F5", edgecolor="k", linewidth=0.4)
            share = np.arange(1, len(known) + 1) / n
            lower.step(known, share, where="post", color="k", label="share of samples")
        label = f"quantiles, {100 * CONFIDENCE:g} %"
        for q in scatter.quantiles:
            if None not in (q.value, q.low, q.high):
                ends = [q.low, q.high]
                lower.plot(ends, [q.level] * 2, color="#3498DB", lw=2.2, label=label)
                label = ""
        if of_growth or limit > 0.0:
            low, high = lower.get_xlim()
            margin = 0.05 * (high - low)
            look: Any = {"color": "#C8380E", "linestyle": "--", "linewidth": 0.8, "gid": "own"}
            upper.axvline(limit, **look)
            lower.axvline(limit, label=limit_name, **look)
            lower.set_xlim(min(low, limit - margin), max(high, limit + margin))
        upper.set_ylabel("samples")
        lower.set(ylim=(0.0, 1.0), ylabel="share below" if of_growth else "share unstable")
        lower.set_xlabel(what)
        for axes in more:
            _draw_indices(axes, scatter)
        figure.align_ylabels([upper, lower])
        figure.legend(*lower.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    levels = [
        f"{100 * q.level:g} % at {q.value:.4g}" for q in scatter.quantiles if q.value is not None
    ]
    text = (
        f"Histogram and cumulative share of the {what} of {n} samples of {name}: "
        f"{', '.join(levels)}. Stable{'' if of_growth else f' at {limit:.4g}'}: "
        f"{100 * scatter.stable:.1f} %."
    )
    kind = "growth rates" if of_growth else f"critical {parameter}"
    return Drawing(figure, text, f"Scatter of the {kind} of {name}", origin(__name__))


def _bin_edges(values: np.ndarray, limit: float) -> np.ndarray:
    """Edges of a histogram, one of them at a limit: what lies at it is counted below."""
    width = np.ptp(values) / np.clip(np.round(np.sqrt(len(values))), 8, 60) or 1.0
    edge = limit + 1e-6 * width
    first = np.floor((values.min() - edge) / width)
    last = np.floor((values.max() - edge) / width)
    return edge + width * np.arange(first, last + 2)


def _draw_indices(axes: Axes, scatter: Scatter) -> None:
    """Sobol indices of each parameter as bars with their intervals."""
    rows = np.arange(len(scatter.indices))
    for order, colour, up in (("total", "#CFE6F5", 0.19), ("first", "#3498DB", -0.19)):
        sizes = np.array([getattr(one, order) for one in scatter.indices])
        bounds = np.array([getattr(one, f"{order}_interval") for one in scatter.indices])
        axes.barh(
            rows - up,
            sizes,
            xerr=np.abs(bounds.T - sizes),
            error_kw={"lw": 0.8},
            height=0.36,
            color=colour,
            label=order,
        )
    names = [symbol_of(one.parameter) for one in scatter.indices]
    axes.set(yticks=rows, yticklabels=names, xlim=(0.0, None))
    axes.set_xlabel("Sobol index")
    axes.invert_yaxis()
    axes.legend()
