"""Time histories coloured by contact state, as in Figs. 4-7 (B1) and 9-12 (B2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from squeal.model.contact import Signal, contact_law
from squeal.model.states import LEAD, TRAIL
from squeal.plots.runs import Interval, Run, Summary
from squeal.plots.style import STATE_COLOURS, colours, sided, state_label

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


@dataclass(frozen=True)
class Looks:
    """How the states of a run are drawn: stretches of time, and of each state met its look.

    Where one state stands for partial contact at either edge, its stretches are told apart by the
    side on which the reaction acts.
    """

    timeline: list[Interval]
    states: dict[str, tuple[str, str, str]]
    """Short label, meaning and colour by name."""

    @staticmethod
    def of(run: Run) -> Looks:
        """The looks of a run."""
        model, partial = run.summary.model, sided(run.summary.model)
        law, palette = contact_law(model), colours(model)
        looks: dict[str, tuple[str, str, str]] = {}
        for state in run.summary.states_met:
            label, meaning = state_label(state), law.meanings[state]
            if state == partial:
                for edge, of in (("leading", LEAD), ("trailing", TRAIL)):
                    look = rf"{label}$_{edge[0]}$", f"{meaning}, {edge} edge", STATE_COLOURS[of]
                    looks[f"{state} {edge}"] = look
            else:
                looks[state] = (label, meaning, palette[state])
        timeline = [
            i._replace(state=f"{i.state} {_side(run, i)}") if i.state == partial else i
            for i in run.summary.timeline
        ]
        met = {i.state for i in timeline if i.stop > i.start}
        return Looks(timeline, {name: look for name, look in looks.items() if name in met})


def _side(run: Run, interval: Interval) -> str:
    place = run.history["delta"]
    known = np.isfinite(place)
    middle = 0.5 * (interval.start + interval.stop)
    return "leading" if np.interp(middle, run.history["t"][known], place[known]) < 0 else "trailing"


def trace(axes: Axes, run: Run, signal: Signal, letter: str, looks: Looks) -> None:
    """A signal over time, coloured by contact state."""
    curves = pieces(run.history["t"], run.history[signal.name], looks.timeline)
    for state, (_, _, colour) in looks.states.items():
        t, values = curves[state]
        axes.plot(1e3 * t, values, color=colour, label=state, gid=state)
    axes.set_title(f"({letter}) {signal.title}", loc="left", pad=3.0)
    axes.set_ylabel(f"${signal.symbol}/{signal.over}$")
    axes.set_xlim(0.0, 1e3 * run.summary.stop)
    axes.axhline(0.0, color="0.6", linewidth=0.5, zorder=0)
    if signal.is_force:
        axes.set_ylim(bottom=-0.04 * axes.get_ylim()[1])
    else:
        axes.set_ylim(-1.15, 1.15)


def strip(axes: Axes, looks: Looks) -> None:
    """The second cue: each state has a row of its own, so position tells it without colour."""
    rows = list(reversed(looks.states.items()))
    for row, (state, (_, _, colour)) in enumerate(rows):
        spans = [
            (1e3 * i.start, 1e3 * (i.stop - i.start)) for i in looks.timeline if i.state == state
        ]
        axes.broken_barh(spans, (row - 0.4, 0.8), facecolor=colour, linewidth=0.0, gid=state)
    axes.set_yticks(range(len(rows)), [label for _, (label, _, _) in rows])
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.set_ylabel("state")
    axes.set_xlabel(r"time $t$ [ms]")
    axes.tick_params(axis="y", length=0.0)


def alternative_text(run: Summary) -> str:
    """What the figure shows, in words and with its ranges."""
    texts = []
    law = contact_law(run.model)
    for signal in law.plotted:
        limits = run.extrema[signal.name]
        span = "is nowhere defined"
        if limits is not None:
            span = f"lies between {limits[0]:.3g} and {limits[1]:.3g}"
        texts.append(f"the {signal.words} over the {_SCALES[signal.over]} {span}")
    shares = ", ".join(f"{law.meanings[s]} {100 * run.shares[s]:.1f} %" for s in run.states_met)
    changes = len(run.timeline) - 1
    return (
        f"Two panels over {1e3 * run.stop:g} ms for the scene {run.name} of model {run.model}: "
        f"(a) {texts[0]}; (b) {texts[1]}. The curves are coloured by contact state and a strip "
        f"below repeats the states, which change {changes} times; shares of time: {shares}."
    )
