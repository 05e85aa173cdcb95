"""A motion at a glance: forces, position of the reaction, contact states, and the forces' spectrum.

Time histories are coloured by contact state, as in Figs. 4-7 (B1) and 9-12 (B2).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from squeal.io.provenance import Provenance
from squeal.model.contact import LEAD, NORMAL_REACTION, TRAIL, Signal, contact_law
from squeal.model.equations import PadModel
from squeal.model.pad import pose_of
from squeal.numerics.oscillation import spectrum
from squeal.plots.style import DOUBLE, STATE_COLOURS, Drawing, colours, origin, state_label, style
from squeal.simulation.observers import LAST, Event

POSITION = NORMAL_REACTION[1]  # the signal delta / w: where the resultant of the contact acts
SHOWN = 1e-4  # of the largest amplitude: the foot of a spectrum
STRONG = 0.01  # of the largest amplitude: lines above it set the range of frequencies
_SCALES = {"F_n": "brake force", "w": "half length"}  # by what signals are divided, in words


class Interval(NamedTuple):
    """A time (s) spent in one contact state."""

    start: float
    stop: float
    state: str


@dataclass(frozen=True)
class Run:
    """What figures and tables take from one simulated scene.

    Attributes
    ----------
    name, model
        Of the scene file without its suffix; of contact.
    stop
        End of the run, s.
    events
        The located contact changes.
    shares
        Share of time by contact state.
    extrema
        (min, max) by signal: forces over F_n, delta over w; None without contact.
    history
        Arrays of equal length by signal, in SI units but forces and delta as in `extrema`. `state`
        holds names of states.
    """

    name: str
    model: str
    stop: float
    events: tuple[Event, ...]
    shares: dict[str, float]
    extrema: dict[str, tuple[float, float] | None]
    provenance: Provenance
    history: dict[str, np.ndarray] = field(repr=False)

    @cached_property
    def timeline(self) -> list[Interval]:
        """Contact states in order, with the located times of their changes."""
        if self.events:
            state = self.events[0].source
        else:
            state = max(self.shares, key=self.shares.__getitem__)
        start = 0.0
        intervals = []
        for event in self.events:
            intervals.append(Interval(start, event.t, state))
            start = event.t
            state = event.target
        return [*intervals, Interval(start, self.stop, state)]

    @cached_property
    def states_met(self) -> list[str]:
        """Names of the states in which any time was spent, in the article's order."""
        met = {i.state for i in self.timeline if i.stop > i.start}
        return [name for name in self.shares if name in met]


def pieces(
    t: np.ndarray, values: np.ndarray, timeline: list[Interval]
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Cut a signal into one curve (time, value) a contact state, to be drawn in its colour.

    t, values (m,): samples; timeline: intervals, each of one contact state. The intervals of a
    state are joined to one curve, with NaN between them. Each begins and ends at a located contact
    change, where the value is interpolated, and holds every sample in between.
    """
    curves: dict[str, list[np.ndarray]] = {}
    for start, stop, state in timeline:
        is_inside = (t > start) & (t < stop)
        first, last = np.interp([start, stop], t, values)
        times = [start, *t[is_inside], stop, np.nan]
        piece = [times, [first, *values[is_inside], last, np.nan]]
        curves.setdefault(state, []).append(np.array(piece))
    return {state: tuple(np.concatenate(parts, axis=1)) for state, parts in curves.items()}


class StateLook(NamedTuple):
    """How one state is drawn."""

    label: str
    meaning: str
    colour: str


class Looks(NamedTuple):
    """How the states of a run are drawn: intervals of time, and the look of each state.

    Where one state stands for partial contact at either edge, the side on which the reaction acts
    is part of its name.
    """

    timeline: list[Interval]
    states: dict[str, StateLook]

    @staticmethod
    def of(run: Run) -> Looks:
        """The looks of a run, those of the states in which any time was spent.

        Where one state, such as PC, stands for both edges, `_with_edge` renames its intervals to
        "PC leading" or "PC trailing", and each of these that occurs is a state here.
        """
        law = contact_law(run.model)
        palette = colours(run.model)
        timeline = run.timeline
        partial = law.state_name(LEAD)
        if partial == law.state_name(TRAIL):  # one state for both edges
            timeline = [_with_edge(interval, partial, run.history) for interval in timeline]
        shown = {interval.state for interval in timeline if interval.stop > interval.start}
        states: dict[str, StateLook] = {}
        for state in run.states_met:  # in the article's order
            label = state_label(state)
            meaning = law.meanings[state]
            if state in shown:  # it has not been renamed
                states[state] = StateLook(label, meaning, palette[state])
            for edge, edge_state in (("leading", LEAD), ("trailing", TRAIL)):
                state_at_edge = f"{state} {edge}"
                if state_at_edge in shown:
                    states[state_at_edge] = StateLook(
                        label=rf"{label}$_{edge[0]}$",
                        meaning=f"{meaning}, {edge} edge",
                        colour=STATE_COLOURS[edge_state],
                    )
        return Looks(timeline, states)


def _with_edge(interval: Interval, partial: str, history: dict[str, np.ndarray]) -> Interval:
    """An interval of partial contact, named by the edge that touches in its middle.

    That is the edge to which the pad is turned, also in a contact between two samples. partial: the
    name of that state; an interval of another state is returned as it is.
    """
    if interval.state != partial:
        return interval
    middle = 0.5 * (interval.start + interval.stop)
    theta = np.interp(middle, history["t"], history["theta"])
    edge = "leading" if theta > 0.0 else "trailing"
    return interval._replace(state=f"{partial} {edge}")


def trace(axes: Axes, run: Run, signal: Signal, letter: str, looks: Looks) -> None:
    """Draw a signal over time, coloured by contact state."""
    curves = pieces(run.history["t"], run.history[signal.name], looks.timeline)
    for state, look in looks.states.items():
        t, values = curves[state]
        axes.plot(1e3 * t, values, color=look.colour, label=state, gid=state)
    axes.set_title(f"({letter}) {signal.title}", loc="left", pad=3.0)
    axes.set_ylabel(f"${signal.symbol}/{signal.over}$")
    axes.set_xlim(0.0, 1e3 * run.stop)
    axes.axhline(0.0, color="0.6", linewidth=0.5, zorder=0)
    if signal.is_force:
        axes.set_ylim(bottom=-0.04 * axes.get_ylim()[1])
    else:
        axes.set_ylim(-1.15, 1.15)


def strip(axes: Axes, looks: Looks) -> None:
    """Draw the contact states over time as bars, a row for each state, to be read without colour.

    The first state stands on top.
    """
    labels = []  # of the rows, from below
    for row, (state, look) in enumerate(reversed(looks.states.items())):
        labels.append(look.label)
        bars = []  # begin and length, ms
        for start, stop, state_then in looks.timeline:
            if state_then == state:
                bars.append((1e3 * start, 1e3 * (stop - start)))
        axes.broken_barh(bars, (row - 0.4, 0.8), facecolor=look.colour, linewidth=0.0, gid=state)
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylim(-0.6, len(labels) - 0.4)
    axes.set_ylabel("state")
    axes.set_xlabel(r"time $t$ [ms]")
    axes.tick_params(axis="y", length=0.0)


def alternative_text(run: Run) -> str:
    """What the figure shows, in words and with its ranges."""
    law = contact_law(run.model)
    texts = []
    for letter, signal in zip("ab", law.plotted, strict=True):
        ends = run.extrema[signal.name]
        span = "is nowhere defined"
        if ends:
            span = f"lies between {ends[0]:.3g} and {ends[1]:.3g}"
        texts.append(f"({letter}) the {signal.words} over the {_SCALES[signal.over]} {span}")
    shares = ", ".join(f"{law.meanings[s]} {100 * run.shares[s]:.1f} %" for s in run.states_met)
    return (
        f"Two panels over {1e3 * run.stop:g} ms for the scene {run.name} of model {run.model}: "
        f"{'; '.join(texts)}. The curves are coloured by contact state and a strip below repeats "
        f"the states, which change {len(run.timeline) - 1} times; shares of time: {shares}."
    )


def _spectrum(axes: Axes, run: Run, forces: list[Signal], letter: str, frequency: float) -> None:
    """Draw the spectrum of forces over F_n in the run's last part.

    frequency: of the strongest line in the motion's kinetic energy, Hz, which is marked; 0 where
    there is none.
    """
    t = run.history["t"]
    count = max(2, int(LAST * len(t)))  # samples of the last part; one has no spectrum
    # a column for each force
    values = np.array([run.history[signal.name][-count:] for signal in forces]).T
    # at 8 times as many frequencies as samples give, so that the curves are smooth
    frequencies, amplitudes = spectrum(values, float(t[1] - t[0]), finer=8)
    kilohertz = frequencies[1:] / 1e3  # without the mean, at 0
    amplitudes = amplitudes[1:]
    top = max(float(amplitudes.max()), 1e-12)  # above 0, for the logarithmic axis
    for signal, column, colour in zip(forces, amplitudes.T, ("black", "0.55"), strict=False):
        axes.plot(
            kilohertz,
            np.maximum(column, 1e-3 * SHOWN * top),  # zeros have no logarithm: below the axis
            color=colour,
            label=f"${signal.symbol}$",
            gid=f"spectrum {signal.name}",
        )
    is_strong = (amplitudes >= STRONG * top).any(axis=1)
    last = float(kilohertz[-1])
    highest = float(kilohertz[is_strong].max(initial=0.0)) or last  # constant forces show no line
    axes.set_xlim(0.0, min(1.5 * highest, last))
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(numticks=9))
    axes.set(ylim=(SHOWN * top, 3.0 * top), xlabel="frequency [kHz]", ylabel="amplitude$/F_n$")
    title = f"({letter}) spectrum of the last quarter"
    if frequency:
        title += f"; strongest line of the motion at {frequency:.0f} Hz"
        axes.axvline(frequency / 1e3, color="0.6", linewidth=0.5, zorder=0)
    axes.set_title(title, loc="left", pad=3.0)
    if len(forces) > 1:
        axes.legend(loc="upper right")


def motion_drawing(run: Run, model: PadModel, frequency: float) -> Drawing:
    """Draw forces and the position of the reaction over time, the states, and the spectrum.

    `frequency` (Hz) is marked in the spectrum if it is not 0.
    """
    law = contact_law(run.model)
    looks = Looks.of(run)
    text = alternative_text(run)
    shown = run
    if POSITION not in law.plotted:
        shown = _with_position(run, model)
        text += f" A third panel shows the {POSITION.words} over the half length."
    forces = [signal for signal in law.plotted if signal.is_force]
    panels = [*forces, POSITION]
    heights = [1.0] * len(panels) + [0.2 + 0.14 * len(looks.states), 1.1]
    with style():
        figure = Figure(figsize=(DOUBLE, 0.8 + 1.05 * sum(heights)))
        grid = figure.add_gridspec(len(heights), 1, height_ratios=heights)
        first = figure.add_subplot(grid[0])
        axes = [first]
        for k in range(1, len(panels)):
            axes.append(figure.add_subplot(grid[k], sharex=first))
        axes_of_states = figure.add_subplot(grid[-2], sharex=first)
        for panel, signal, letter in zip(axes, panels, "abc", strict=False):
            trace(panel, shown, signal, letter, looks)
            panel.tick_params(labelbottom=False)
        strip(axes_of_states, looks)
        axes_of_spectrum = figure.add_subplot(grid[-1])
        letter = "abcd"[len(panels)]  # the next one
        _spectrum(axes_of_spectrum, shown, forces, letter, frequency)
        figure.align_ylabels([*axes, axes_of_states, axes_of_spectrum])
        handles = first.get_lines()[: len(looks.states)]  # `trace` draws a line for each state
        names = [f"{look.label}: {look.meaning}" for look in looks.states.values()]
        figure.legend(handles, names, loc="outside upper center", ncols=4)
    line = "no line stands out"
    if frequency:
        line = f"its strongest line is at {frequency:.0f} Hz"
    text += f" A last panel shows the spectrum of the forces in the last quarter; {line}."
    title = f"Motion of the scene {run.name}: forces, contact and spectrum"
    return Drawing(figure, text, title, origin(__name__, run.provenance))


def _with_position(run: Run, model: PadModel) -> Run:
    """A run with the position of the normal reaction over w added to its history."""
    history = run.history
    state_of_name = {model.state_name(state): state for state in model.states}
    # of each contact point a row: whether it is closed at each time
    contact = np.array([state_of_name[name] for name in history["state"]], dtype=float).T
    at = pose_of(np, (history["x"], history["y"], history["theta"]))
    with np.errstate(divide="ignore", invalid="ignore"):  # without contact there is no reaction
        _, position = contact_law(run.model).resultant(model.c, at, contact)
    return replace(run, history=history | {POSITION.name: position / model.pad.w})
