"""Figs. 4-7 (model B1) and 9-12 (model B2): time histories coloured by contact state."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.files.results import Interval, Run, Summary
from squeal.model.contact import contact_law
from squeal.model.law import Signal
from squeal.plots.states import colours, state_label
from squeal.plots.style import DOUBLE, Drawing, origin, style

_SCALES = {"F_n": "brake force", "w": "half length"}


def pieces(
    t: np.ndarray, values: np.ndarray, timeline: list[Interval]
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Per state one curve of (time, value), its separate stretches divided by NaN.

    A stretch begins and ends at the located contact changes, where the value is interpolated
    between the samples; between them every sample is kept.
    """
    found: dict[str, tuple[list[np.ndarray], list[np.ndarray]]] = {}
    for start, stop, state in timeline:
        inside = (t > start) & (t < stop)
        ends = np.interp([start, stop], t, values)
        times, heights = found.setdefault(state, ([], []))
        times += [np.array([start]), t[inside], np.array([stop, np.nan])]
        heights += [ends[:1], values[inside], np.array([ends[1], np.nan])]
    return {
        state: (np.concatenate(times), np.concatenate(heights))
        for state, (times, heights) in found.items()
    }


def _trace(axes: Axes, run: Run, signal: Signal, letter: str) -> None:
    told = run.summary
    palette = colours(told.model)
    curves = pieces(run.history["t"], run.history[signal.name], told.timeline)
    for state in told.states_met:
        t, values = curves[state]
        axes.plot(1e3 * t, values, color=palette[state], label=state, gid=state)
    axes.set_title(f"({letter}) {signal.title}", loc="left", pad=3.0)
    axes.set_ylabel(f"${signal.symbol}/{signal.over}$")
    axes.set_xlim(0.0, 1e3 * told.stop)
    axes.axhline(0.0, color="0.6", linewidth=0.5, zorder=0)
    if signal.is_force:
        axes.set_ylim(bottom=-0.04 * axes.get_ylim()[1])
    else:
        axes.set_ylim(-1.08, 1.08)


def _strip(axes: Axes, run: Summary) -> None:
    """The second cue: each state has a row of its own, so position tells it without colour."""
    palette = colours(run.model)
    rows = list(reversed(run.states_met))
    for row, state in enumerate(rows):
        spans = [
            (1e3 * i.start, 1e3 * (i.stop - i.start)) for i in run.timeline if i.state == state
        ]
        axes.broken_barh(
            spans, (row - 0.4, 0.8), facecolor=palette[state], linewidth=0.0, gid=state
        )
    axes.set_yticks(range(len(rows)), rows)
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.set_ylabel("state")
    axes.set_xlabel(r"time $t$ [ms]")
    axes.tick_params(axis="y", length=0.0)


def history_figure(run: Run) -> Figure:
    """Two panels of normalised signals over a strip of the contact states."""
    law, states = contact_law(run.summary.model), run.summary.states_met
    with style():
        figure = Figure(figsize=(DOUBLE, 3.6))
        grid = figure.subplots(
            3, 1, sharex=True, gridspec_kw={"height_ratios": [3.0, 3.0, 0.3 + 0.36 * len(states)]}
        )
        for axes, signal, letter in zip(grid, law.plotted, "ab", strict=False):
            _trace(axes, run, signal, letter)
        _strip(grid[2], run.summary)
        figure.align_ylabels(grid)
        handles = grid[0].get_lines()[: len(states)]
        names = [f"{state_label(s)}: {law.meanings[s]}" for s in states]
        figure.legend(handles, names, loc="outside upper center", ncols=4)
    return figure


def alternative_text(run: Summary) -> str:
    """What the figure shows, in words and with its ranges."""
    texts = []
    law = contact_law(run.model)
    for signal in law.plotted:
        limits = run.extrema[signal.name]
        span = (
            "is nowhere defined"
            if limits is None
            else f"lies between {limits[0]:.3g} and {limits[1]:.3g}"
        )
        texts.append(f"the {signal.words} over the {_SCALES[signal.over]} {span}")
    shares = ", ".join(f"{law.meanings[s]} {100 * run.shares[s]:.1f} %" for s in run.states_met)
    changes = len(run.timeline) - 1
    return (
        f"Two panels over {1e3 * run.stop:g} ms for the scene {run.name} of model {run.model}: "
        f"(a) {texts[0]}; (b) {texts[1]}. The curves are coloured by contact state and a strip "
        f"below repeats the states, which change {changes} times; shares of time: {shares}."
    )


def drawing(run: Run) -> Drawing:
    """The figure of one simulated scene, ready to be saved."""
    first, second = (signal.words for signal in contact_law(run.summary.model).plotted)
    return Drawing(
        history_figure(run),
        alternative_text(run.summary),
        f"Time histories of {first} and {second}, scene {run.summary.name}",
        origin(__name__, run.summary.provenance),
    )
