"""The distribution of critical frictions or growth rates: histogram, cumulative share, indices."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.plots.maps import friction_symbol, symbol_of
from squeal.plots.style import SINGLE, Drawing, origin, style
from squeal.results.scatter import CONFIDENCE, Scatter


def scatter_drawing(scatter: Scatter, name: str) -> Drawing:
    """Draw a histogram of the samples, and below it their cumulative share with its quantiles.

    Samples without a threshold in the range are missing from the histogram, and keep the share
    below 1. Sobol indices, where they were computed, stand below both.
    """
    of_growth = scatter.of == "growth"  # otherwise samples are of the critical friction
    if of_growth:
        limit = 0.0
        limit_name = "stability limit"
        quantity = "growth rate, 1/s"
        share_name = "share below"
        kind = "growth rates"
        where = ""
    else:
        limit = scatter.mu
        limit_name = f"present {symbol_of(scatter.name)} = {limit:.4g}"
        quantity = f"critical {friction_symbol(scatter.name)}"
        share_name = "share unstable"
        kind = f"critical {scatter.name}"
        where = f" up to {limit:.4g}"
    heights = [1.0, 1.3]  # of the panels
    if scatter.indices:
        heights.append(0.25 + 0.16 * len(scatter.indices))
    with style():
        figure = Figure(figsize=(SINGLE, 1.6 * sum(heights)))
        upper, lower, *for_indices = figure.subplots(len(heights), 1, height_ratios=heights)
        upper.sharex(lower)
        upper.tick_params(labelbottom=False)
        _draw_samples(upper, lower, scatter, limit)
        _draw_quantiles(lower, scatter)
        if of_growth or limit > 0.0:  # a friction of 0 would be marked on the border
            _mark_limit(upper, lower, limit, limit_name)
        upper.set_ylabel("samples")
        lower.set(ylim=(0.0, 1.0), xlabel=quantity, ylabel=share_name)
        for axes in for_indices:  # one panel, or none
            _draw_indices(axes, scatter)
        figure.align_ylabels([upper, lower])
        figure.legend(*lower.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    levels = []
    for quantile in scatter.quantiles:
        if quantile.value is not None:
            levels.append(f"{100 * quantile.level:g} % at {quantile.value:.4g}")
    text = (
        f"Histogram and cumulative share of the {quantity} of {len(scatter.values)} samples of "
        f"{name}: {', '.join(levels)}. Stable{where}: {100 * scatter.stable:.1f} %."
    )
    return Drawing(figure, text, f"Scatter of the {kind} of {name}", origin(__name__))


def _draw_samples(upper: Axes, lower: Axes, scatter: Scatter, limit: float) -> None:
    """Draw the histogram of the samples that have a value, and their share of all samples."""
    rising = scatter.values[np.isfinite(scatter.values)]
    if not len(rising):
        return
    edges: Any = _bin_edges(rising, limit)
    upper.hist(rising, edges, color="#CFE6F5", edgecolor="k", linewidth=0.4)
    share = np.arange(1, len(rising) + 1) / len(scatter.values)
    lower.step(rising, share, where="post", color="k", label="share of samples")


def _draw_quantiles(axes: Axes, scatter: Scatter) -> None:
    """Draw the confidence interval of each quantile as a bar at its level, if it has both ends."""
    label = f"quantiles, {100 * CONFIDENCE:g} %"
    for quantile in scatter.quantiles:
        ends: Any = [quantile.low, quantile.high]
        if quantile.value is not None and None not in ends:
            axes.plot(ends, [quantile.level] * 2, color="#3498DB", lw=2.2, label=label)
            label = ""  # the legend names the first bar alone


def _mark_limit(upper: Axes, lower: Axes, limit: float, words: str) -> None:
    """Draw the limit of stability in both panels, whose axis then reaches a little beyond it."""
    low, high = lower.get_xlim()
    margin = 0.05 * (high - low)
    look: Any = {"color": "#C8380E", "linestyle": "--", "linewidth": 0.8, "gid": "own"}
    upper.axvline(limit, **look)
    lower.axvline(limit, label=words, **look)
    lower.set_xlim(min(low, limit - margin), max(high, limit + margin))


def _bin_edges(values: np.ndarray, limit: float) -> np.ndarray:
    """Edges of a histogram, one of them just above a limit: what lies at it is counted below.

    There are as many bins as the root of the number of values, 8 to 60.
    """
    bins = np.clip(np.round(np.sqrt(len(values))), 8, 60)
    width = np.ptp(values) / bins or 1.0
    edge = limit + 1e-6 * width
    first = np.floor((values.min() - edge) / width)
    last = np.floor((values.max() - edge) / width)
    return edge + width * np.arange(first, last + 2)


def _draw_indices(axes: Axes, scatter: Scatter) -> None:
    """Draw Sobol indices of each parameter as two bars with intervals, the total one on top.

    Each parameter has the attributes `total`, `first` and their intervals (low, high).
    """
    rows = np.arange(len(scatter.indices))  # heights on an axis that points down
    for order, colour, shift in (("total", "#CFE6F5", -0.19), ("first", "#3498DB", 0.19)):
        sizes = np.array([getattr(index, order) for index in scatter.indices])
        intervals = np.array([getattr(index, f"{order}_interval") for index in scatter.indices])
        axes.barh(
            rows + shift,
            sizes,
            xerr=np.abs(intervals.T - sizes),  # lengths below and above
            error_kw={"lw": 0.8},
            height=0.36,
            color=colour,
            label=order,
        )
    names = [symbol_of(index.parameter) for index in scatter.indices]
    axes.set(yticks=rows, yticklabels=names, xlim=(0.0, None), xlabel="Sobol index")
    axes.invert_yaxis()
    axes.legend()
