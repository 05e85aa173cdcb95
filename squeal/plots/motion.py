"""A motion at a glance: forces, place of the reaction, contact states, and the forces' spectrum."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from squeal.model.contact import NORMAL_REACTION, Signal, contact_law
from squeal.model.equations import PadModel
from squeal.model.mechanics import pose
from squeal.numerics.oscillation import spectrum
from squeal.plots.histories import Looks, alternative_text, strip, trace
from squeal.plots.runs import Event, Run
from squeal.plots.style import (
    DOUBLE,
    Drawing,
    origin,
    style,
)
from squeal.simulation.response import LAST

PLACE = NORMAL_REACTION[1]
DECADES = 4.0  # of amplitude that the spectrum shows
FINER = 8  # values of it between two frequencies that the run tells apart
_LINES = (("black", "-"), ("0.55", "-"))


def with_place(run: Run, model: PadModel) -> Run:
    """The run with the place of the reaction over w in its history, if its law does not plot it.

    The place jumps nowhere but is steep at a change of contact, so the history gets the located
    changes as times of their own, with what touches before or after.
    """
    if PLACE.name in run.history:
        return run
    known = {model.state_name(state): state for state in model.states}
    changes = run.summary.events
    both = [np.logical_or(known[e.source], known[e.target]) for e in changes]
    touching = np.array([known[name] for name in run.history["state"].tolist()] + both, dtype=float)
    history = _with_times(run.history, changes)
    order = np.argsort(history["t"], kind="stable")
    history = {name: values[order] for name, values in history.items()}
    at = pose(np, (history["x"], history["y"], history["theta"]))
    with np.errstate(divide="ignore", invalid="ignore"):
        _, place = model.law.resultant(model.c, at, touching[order].T)
    return Run(run.summary, history | {PLACE.name: place / model.pad.w})


def _with_times(
    history: dict[str, np.ndarray], changes: tuple[Event, ...]
) -> dict[str, np.ndarray]:
    """The columns with the values at the changes of contact at their ends."""
    from scipy.interpolate import CubicHermiteSpline

    t, times = history["t"], np.array([change.t for change in changes])
    found = {}
    for name, values in history.items():
        if name == "state":
            more = np.array([change.target for change in changes], dtype=values.dtype)
        elif f"{name}_dot" in history:
            more = CubicHermiteSpline(t, values, history[f"{name}_dot"])(times)
        else:
            more = np.interp(times, t, values)
        found[name] = np.concatenate([values, more])
    return found


def _spectrum(axes: Axes, run: Run, forces: list[Signal], letter: str, frequency: float) -> None:
    """Amplitudes over frequency of the run's last part; `frequency` (Hz, or 0) is marked."""
    t = run.history["t"]
    late = slice(-int(LAST * len(t)), None)
    values = np.array([run.history[signal.name][late] for signal in forces]).T
    frequencies, amplitudes = spectrum(values, float(t[1] - t[0]), FINER)
    frequencies, amplitudes = frequencies[1:], amplitudes[1:]
    top = max(float(amplitudes.max()), 1e-12)
    for signal, column, (colour, dashes) in zip(forces, amplitudes.T, _LINES, strict=False):
        seen = np.maximum(column, 1e-3 * 10**-DECADES * top)
        named: Any = {"label": f"${signal.symbol}$", "gid": f"spectrum {signal.name}"}
        axes.plot(frequencies / 1e3, seen, color=colour, linestyle=dashes, **named)
    strong = frequencies[(amplitudes >= 0.01 * top).any(axis=1)]
    axes.set_xlim(0.0, min(1.5 * float(strong[-1]), float(frequencies[-1])) / 1e3)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(numticks=9))
    axes.set_ylim(10**-DECADES * top, 3.0 * top)
    known = f"; strongest line of the motion at {frequency:.0f} Hz" if frequency else ""
    axes.set_title(f"({letter}) spectrum of the last quarter{known}", loc="left", pad=3.0)
    axes.set_xlabel("frequency [kHz]")
    axes.set_ylabel("amplitude$/F_n$")
    if frequency:
        axes.axvline(frequency / 1e3, color="0.6", linewidth=0.5, zorder=0)
    if len(forces) > 1:
        axes.legend(loc="upper right")


def motion_figure(run: Run, model: PadModel, frequency: float = 0.0) -> Figure:
    """Panels of forces and of the place of the reaction, a strip of states, and the spectrum.

    `frequency` (Hz) is marked in it if it is known.
    """
    law, looks, placed = contact_law(run.summary.model), Looks.of(run), with_place(run, model)
    states = looks.states
    forces = [signal for signal in law.plotted if signal.is_force]
    panels = [*forces, PLACE]
    heights = [1.0] * len(panels) + [0.2 + 0.14 * len(states), 1.1]
    with style():
        figure = Figure(figsize=(DOUBLE, 0.8 + 1.05 * sum(heights)))
        grid = figure.add_gridspec(len(heights), 1, height_ratios=heights)
        first = figure.add_subplot(grid[0])
        axes = [first, *(figure.add_subplot(grid[i], sharex=first) for i in range(1, len(panels)))]
        below = figure.add_subplot(grid[len(panels)], sharex=first)
        for one, signal, letter in zip(axes, panels, "abc", strict=False):
            trace(one, placed, signal, letter, looks)
            one.tick_params(labelbottom=False)
        strip(below, looks)
        last = figure.add_subplot(grid[-1])
        _spectrum(last, run, forces, "abcd"[len(panels)], frequency)
        figure.align_ylabels([*axes, below, last])
        handles = first.get_lines()[: len(states)]
        names = [f"{label}: {meaning}" for label, meaning, _ in states.values()]
        figure.legend(handles, names, loc="outside upper center", ncols=4)
    return figure


def drawing(run: Run, model: PadModel, frequency: float | None) -> Drawing:
    """The figure of a simulated scene, ready to be saved."""
    known = f"its strongest line is at {frequency:.0f} Hz" if frequency else "no line stands out"
    told = PLACE in contact_law(run.summary.model).plotted
    place = "" if told else f" A third panel shows the {PLACE.words} over the half length."
    return Drawing(
        motion_figure(run, model, frequency or 0.0),
        f"{alternative_text(run.summary)}{place} A last panel shows the spectrum of the "
        f"forces in the last quarter of the run; {known}.",
        f"Motion of the scene {run.summary.name}: forces, contact and spectrum",
        origin(__name__, run.summary.provenance),
    )
