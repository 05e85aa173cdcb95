"""Figs. 4-7 (model B1) and 9-12 (model B2): time histories coloured by contact state."""

from __future__ import annotations

import argparse
import sys
from typing import Any, Literal, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.files.results import Interval, Run, read_run
from squeal.model.pad import Model
from squeal.model.states import MEANINGS
from squeal.plots.style import DOUBLE, Drawing, colours, origin, program, style

# signal: panel title, axis label, what it is in words
_SIGNALS: dict[str, tuple[str, str, str]] = {
    "F3": ("leading edge", r"$F_{s,3}/F_n$", "leading-edge force over the brake force"),
    "F4": ("trailing edge", r"$F_{s,4}/F_n$", "trailing-edge force over the brake force"),
    "Rn": ("normal reaction", r"$R_n/F_n$", "normal reaction over the brake force"),
    "delta": (
        "place of the reaction",
        r"$\delta/w$",
        "place of the reaction over the half length",
    ),
}
PANELS: dict[str, tuple[str, str]] = {"B1": ("F3", "F4"), "B2": ("Rn", "delta")}


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


def _trace(axes: Axes, run: Run, signal: str, letter: str) -> None:
    palette = colours(cast(Model, run.model))
    curves = pieces(run.history["t"], run.history[signal], run.timeline)
    for state in run.states_met:
        t, values = curves[state]
        axes.plot(1e3 * t, values, color=palette[state], label=state, gid=state)
    title, label, _ = _SIGNALS[signal]
    axes.set_title(f"({letter}) {title}", loc="left", pad=3.0)
    axes.set_ylabel(label)
    axes.set_xlim(0.0, 1e3 * run.stop)
    if signal == "delta":
        axes.set_ylim(-1.08, 1.08)
        axes.axhline(0.0, color="0.6", linewidth=0.5, zorder=0)
    else:
        axes.set_ylim(bottom=-0.04 * axes.get_ylim()[1])
        axes.axhline(0.0, color="0.6", linewidth=0.5, zorder=0)


def _strip(axes: Axes, run: Run) -> None:
    """The second cue: each state has a row of its own, so position tells it without colour."""
    palette = colours(cast(Model, run.model))
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
    first, second = PANELS[run.model]
    with style():
        figure = Figure(figsize=(DOUBLE, 3.6))
        grid = figure.subplots(
            3,
            1,
            sharex=True,
            gridspec_kw={"height_ratios": [3.0, 3.0, 0.3 + 0.36 * len(run.states_met)]},
        )
        _trace(grid[0], run, first, "a")
        _trace(grid[1], run, second, "b")
        _strip(grid[2], run)
        figure.align_ylabels(grid)
        meanings = MEANINGS[run.model]
        handles = grid[0].get_lines()[: len(run.states_met)]
        names = [f"{_label(run.model, s)}: {meanings[s]}" for s in run.states_met]
        figure.legend(handles, names, loc="outside upper center", ncols=4)
    return figure


def _label(model: str, state: str) -> str:
    return f"state {state}" if model == "B1" else state


def alternative_text(run: Run) -> str:
    """What the figure shows, in words and with its ranges."""
    texts = []
    for signal in PANELS[run.model]:
        limits: Any = run.summary["extrema"][signal]
        span = (
            "is nowhere defined"
            if limits is None
            else f"lies between {limits[0]:.3g} and {limits[1]:.3g}"
        )
        texts.append(f"the {_SIGNALS[signal][2]} {span}")
    shares = ", ".join(
        f"{MEANINGS[run.model][s]} {100 * run.summary['shares'][s]:.1f} %" for s in run.states_met
    )
    changes = len(run.timeline) - 1
    return (
        f"Two panels over {1e3 * run.stop:g} ms for the scene {run.name} of model {run.model}: "
        f"(a) {texts[0]}; (b) {texts[1]}. The curves are coloured by contact state and a strip "
        f"below repeats the states, which change {changes} times; shares of time: {shares}."
    )


def drawing(run: Run) -> Drawing:
    """The figure of one simulated scene, ready to be saved."""
    what: Literal["edge contact forces", "contact reaction and its place"] = (
        "edge contact forces" if run.model == "B1" else "contact reaction and its place"
    )
    return Drawing(
        history_figure(run),
        alternative_text(run),
        f"Time histories of the {what}, scene {run.name}",
        origin("squeal.plots.histories", [run.provenance]),
    )


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "stem", metavar="STEM", help="results STEM.json and STEM.csv of squeal simulate"
    )


if __name__ == "__main__":
    sys.exit(
        program(
            "Draw the time histories of one simulated scene.",
            _arguments,
            lambda given: drawing(read_run(given.stem)),
        )
    )
