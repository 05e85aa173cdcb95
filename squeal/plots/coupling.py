"""Modes over a parameter: frequencies, growth rates, and the root locus beside them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from squeal.linear import GROWING
from squeal.plots.maps import COLOUR_OF, friction_symbol, symbol_of
from squeal.plots.modes import NAME, RED
from squeal.plots.style import (
    DOUBLE,
    Drawing,
    frequency_limits,
    hertz,
    origin,
    state_label,
    style,
    write_beside,
)
from squeal.results.columns import onset_column
from squeal.results.sources import unit_of
from squeal.results.sweep import Step, Sweep
from squeal.results.thresholds import Thresholds

NO_EQUILIBRIUM = "no equilibrium"
FREQUENCY = "frequency [Hz]"
GROWTH = "growth rate [1/s]"
LABEL = 0.12  # width of an upright label, of the length of the axis
NAMED = 6  # growing modes that are named
ALIKE = 0.04  # of the frequency: a mode so near to a named one is not named
PALE = "0.65"  # of modes that grow nowhere
REAL = 1e-9  # of |lambda|: an imaginary part below is rounding


def mark_events(
    events: Sequence[tuple[float, str, str]],
    upper: Axes,
    lower: Axes,
    low: float = 0.0,
    reach: float = 1.0,
) -> None:
    """Draw verticals through both panels, with upright labels in the lower one.

    A label ends at its line, on the left. Where the start of the axis or the label before it leaves
    no room there, it begins at its line, on the right, or where the label before it ends.

    Parameters
    ----------
    events : sequence of (float, str, str)
        Value of mu, label and line style of each vertical, by rising mu.
    low, reach : float
        Where the axis of mu begins, and its length.
    """
    width = LABEL * reach  # of a label, in units of mu
    labelled_up_to = low  # the right end of the last label
    for mu, label, line in events:
        # gid: the name of the line in an SVG file
        for axes in (upper, lower):
            axes.axvline(mu, color="k", linewidth=0.7, linestyle=line, zorder=0, gid=label)
        if mu - labelled_up_to > width:  # the label ends at the line
            offset = -2.0
            alignment = "right"
            position = mu
            labelled_up_to = mu
        else:  # it begins there, or further to the right
            offset = 2.0
            alignment = "left"
            position = max(mu, labelled_up_to)
            labelled_up_to = position + width
        lower.annotate(
            label,
            (position, 0.96),
            (offset, 0.0),
            ha=alignment,
            rotation=90,
            va="top",
            bbox={"fc": "w", "ec": "none", "pad": 0.6},
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
        )


class _Panels(NamedTuple):
    """Frequency over growth rate along the parameter, and beside both the root locus."""

    figure: Figure
    upper: Axes
    lower: Axes
    locus: Axes


class _Roots(NamedTuple):
    """Roots (m,) of all steps of a sweep."""

    parameter: np.ndarray  # its value at each root
    values: np.ndarray  # rad/s, both of a conjugate pair
    grows: np.ndarray  # whether the verdict on each root is growth
    numbers: np.ndarray  # of the modes, 0 where not known

    @staticmethod
    def of(sweep: Sweep) -> _Roots:
        """All roots of a sweep."""
        rows = []
        for step in sweep.steps:
            for root, number in zip(step.eigenvalues, step.mode_numbers, strict=True):
                rows.append((step.value, root.value, root.kind in GROWING, number or 0))
        table = np.array(rows, dtype=object).reshape(-1, 4)  # also of no rows
        parameter, values, grows, numbers = table.T
        return _Roots(
            parameter.astype(float), values.astype(complex), grows.astype(bool), numbers.astype(int)
        )

    def select(self, mask: np.ndarray) -> _Roots:
        """The roots where a mask (m,) is true."""
        return _Roots(*map(itemgetter(mask), self))


def _panels(parameter_label: str, roots: _Roots, interval: tuple[float, float]) -> _Panels:
    """Make the figure: its root locus, drawn, and two empty panels over the parameter.

    The axes of growth are symmetric about 0 and show all roots that grow; roots that decay faster
    than the fastest grows lie outside. Where nothing grows all roots are shown.

    interval: the first and the last value of the parameter on its axis.
    """
    values = roots.values
    rates = values.real
    if roots.grows.any():
        rates = rates[roots.grows]
    reach = 1.1 * np.abs(rates).max(initial=0.0) or 1.0  # no axis has length 0
    figure = Figure(figsize=(DOUBLE, 3.9))
    grid = figure.add_gridspec(2, 2, width_ratios=[1.55, 1.0], height_ratios=[1.6, 1.0])
    upper = figure.add_subplot(grid[0, 0])
    locus = figure.add_subplot(grid[:, 1])
    lower = figure.add_subplot(grid[1, 0], sharex=upper)
    limits = frequency_limits(values)
    upper.set(ylim=limits, ylabel=FREQUENCY)
    first, last = interval
    if first < last:  # of one value Matplotlib chooses limits about it
        upper.set_xlim(first, last)
    upper.tick_params(labelbottom=False)
    lower.set(ylim=(-reach, reach), xlabel=parameter_label, ylabel=GROWTH)
    locus.set(xlim=(-reach, reach), ylim=limits, xlabel=GROWTH, ylabel=FREQUENCY)
    is_sparse = len(values) <= 6 * len(np.unique(roots.parameter))  # as of a pad, with six roots
    dots = _draw_locus(locus, roots.select(_is_upper(values)), interval, is_sparse)
    figure.colorbar(dots, ax=locus, label=parameter_label, aspect=35, pad=0.02)
    figure.align_ylabels([upper, lower])
    return _Panels(figure, upper, lower, locus)


def _draw_locus(
    axes: Axes, roots: _Roots, interval: tuple[float, float], is_sparse: bool
) -> PathCollection:
    """Draw roots as dots coloured by the parameter, those at its lowest value with a dash.

    interval: the values of the parameter at both ends of the colours; is_sparse: there are few
    roots, whose dots are large.
    """
    lowest, highest = interval
    growth = roots.values.real
    hertz = roots.values.imag / math.tau
    axes.axvline(0.0, color="0.75", linewidth=0.5, zorder=0)
    dots = axes.scatter(
        growth,
        hertz,
        9.0 if is_sparse else 3.0,
        roots.parameter,
        cmap="viridis",
        vmin=lowest,
        vmax=highest,
        lw=0,
        zorder=2,
    )
    is_start = roots.parameter == roots.parameter.min(initial=np.inf)
    axes.plot(growth[is_start], hertz[is_start], "k_", ms=11 if is_sparse else 5, mew=0.8)
    return dots


def _is_upper(values: np.ndarray) -> np.ndarray:
    """Which roots are real or have a positive imaginary part."""
    return values.imag >= -REAL * np.abs(values)


class Span(NamedTuple):
    """A range of the parameter with one verdict."""

    low: float
    high: float
    verdict: str


def _shade(panels: _Panels, spans: Sequence[Span]) -> dict[str, Artist]:
    """Colour the ranges where something grows by their verdict. Returns entries of a legend."""
    looks: dict[str, Any] = {NO_EQUILIBRIUM: {"fc": "none", "ec": "0.7", "hatch": "////", "lw": 0}}
    for verdict in GROWING:
        looks[verdict] = {"fc": COLOUR_OF[verdict], "alpha": 0.13, "lw": 0}
    entries: dict[str, Artist] = {}
    for low, high, verdict in spans:
        if verdict in looks and high > low:
            for axes in (panels.upper, panels.lower):
                axes.axvspan(low, high, zorder=0, gid=verdict, **looks[verdict])
            entries[verdict] = Patch(**looks[verdict])
    return entries


def _spans(
    sweep: Sweep, thresholds: Thresholds | None, interval: tuple[float, float]
) -> list[Span]:
    """Ranges of one verdict within the `interval` of the axis, neighbours of the same verdict
    joined.

    Thresholds bound them exactly; without these the steps of the sweep do.
    """
    axis_begin, axis_end = interval
    if thresholds is None:
        unclipped_spans = _spans_of_steps(sweep)
    else:
        unclipped_spans = _spans_of_thresholds(thresholds, axis_end)
    spans: list[Span] = []
    for low, high, verdict in unclipped_spans:
        begin = max(low, axis_begin)
        end = min(high, axis_end)
        if spans and spans[-1].high == begin and spans[-1].verdict == verdict:
            begin = spans.pop().low  # one span in place of the last one and this one
        if end > begin:
            spans.append(Span(begin, end, verdict))
    return spans


def _spans_of_steps(sweep: Sweep) -> list[Span]:
    """Ranges between neighbouring values of the same verdict: none is claimed where it changes."""
    spans = []
    for step, following in itertools.pairwise(sweep.steps):
        verdict = _verdict(step)
        if verdict == _verdict(following):
            spans.append(Span(step.value, following.value, verdict))
    return spans


def _spans_of_thresholds(thresholds: Thresholds, axis_end: float) -> list[Span]:
    """Ranges between thresholds; beyond the last value that was searched is "no equilibrium"."""
    spans = []
    low = thresholds.low
    verdict = thresholds.verdict or "-"
    for point in thresholds.points:
        spans.append(Span(low, point.mu, verdict))
        low = point.mu
        verdict = point.kind  # of a threshold: the verdict from there up to the next one
    spans.append(Span(low, thresholds.high, verdict))
    spans.append(Span(thresholds.high, axis_end, NO_EQUILIBRIUM))
    return spans


def _verdict(step: Step) -> str:
    """The verdict of a step; "-" where it is open."""
    if step.verdict:
        return step.verdict
    return NO_EQUILIBRIUM if step.roots is None else "-"


def sweep_drawing(
    name: str,
    sweep: Sweep,
    thresholds: Thresholds | None = None,
    interval: tuple[float, float] | None = None,
    own_value: float | None = None,
) -> Drawing:
    """Draw frequencies and growth rates along a parameter, and beside them the root locus.

    Each mode is a line, pale if it grows nowhere. Modes that grow are red, and named in the locus;
    the legend says from where on they grow. The background changes colour where the verdict does.

    Parameters
    ----------
    name : str
        The subject, for the alternative text.
    sweep : Sweep
        What is drawn.
    thresholds : Thresholds, optional
        Of the same subject: they tell ranges and onsets more exactly than the sweep.
    interval : (float, float), optional
        Of the parameter on its axis; left out, the first and the last value of the sweep.
    own_value : float, optional
        The subject's own value of the parameter, which is marked.
    """
    parameter = sweep.parameter
    low, high = interval or (sweep.steps[0].value, sweep.steps[-1].value)
    spans = _spans(sweep, thresholds, (low, high))
    roots = _Roots.of(sweep)
    with style():
        label = friction_symbol(parameter, unit_of(sweep.source))
        panels = _panels(label, roots, (low, high))
        upper_roots = roots.select(_is_upper(roots.values))
        _draw_modes(panels, upper_roots)
        entries: dict[str, Artist] = {}
        if upper_roots.grows.any():
            entries["unstable"] = Line2D([], [], color=RED, marker=".", lw=0)
        entries |= _shade(panels, spans)
        if own_value is not None and low <= own_value <= high:
            look: Any = {"color": "0.5", "linewidth": 0.8, "linestyle": "-."}
            for axes in (panels.upper, panels.lower):
                axes.axvline(own_value, zorder=0, **look)
            entries[f"present {symbol_of(parameter)} = {own_value:.4g}"] = Line2D([], [], **look)
        entries |= _onsets(sweep, thresholds)
        mark_events(_contact_changes(sweep), panels.upper, panels.lower, low, high - low)
        if entries:
            panels.figure.legend(
                entries.values(), entries, loc="outside upper center", ncols=3, columnspacing=1.4
            )
        growing = upper_roots.select(upper_roots.grows)
        _name_growing(panels.locus, growing, numbered=thresholds is None)
    ranges = [f"{span.verdict} from {span.low:.6g} to {span.high:.6g}" for span in spans]
    text = (
        f"Frequencies, growth rates and root locus of {name} over {parameter} from {low:g} to "
        f"{high:g}: {', '.join(ranges)}."
    )
    if thresholds is not None:
        crossings = []
        for crossing in thresholds.crossings:
            frequency = f"{crossing.frequency_hz:.4g} Hz"
            crossings.append(f"{crossing.kind} at {crossing.mu:.6g} ({frequency})")
        text += f" Crossings of the imaginary axis: {', '.join(crossings) or 'none'}."
    return Drawing(panels.figure, text, f"Modes of {name} over {parameter}", origin(__name__))


def _draw_modes(panels: _Panels, roots: _Roots) -> None:
    """Draw lines of the numbered modes, and all roots as dots, red where they grow.

    A mode is a line, two where it has two real roots. One that grows nowhere is pale, and so are
    its roots; its lines are drawn below the others.
    """
    is_numbered = roots.numbers > 0
    growing_modes = np.unique(roots.numbers[roots.grows & is_numbered])  # at some value
    is_pale = ~np.isin(roots.numbers, growing_modes) & ~roots.grows
    # each panel with what it shows of all roots: Hz, and 1/s
    curves = ((panels.upper, roots.values.imag / math.tau), (panels.lower, roots.values.real))
    # indices of all roots by rising parameter, at one value by falling growth
    order = np.lexsort((-roots.values.real, roots.parameter))
    for mode in np.unique(roots.numbers[is_numbered]).tolist():
        grows = mode in growing_modes
        of_mode = order[roots.numbers[order] == mode]
        # of two real roots at one value the second, which grows more slowly
        is_slower = np.diff(roots.parameter[of_mode], prepend=math.nan) == 0.0
        lines = [of_mode[~is_slower]]
        if is_slower.any():
            lines.append(of_mode[is_slower])
        for line, (axes, y) in itertools.product(lines, curves):
            axes.plot(
                roots.parameter[line],
                y[line],
                lw=0.7,
                color="0.25" if grows else PALE,
                zorder=2 if grows else 1.5,
                gid=f"mode {mode}",
            )
    dots = (  # which roots, their colour and their size
        (is_pale, PALE, 1.5),
        (~is_pale & ~roots.grows, "0.25", 1.5),
        (roots.grows, RED, 4.0),
    )
    for selected, colour, size in dots:
        for axes, y in curves:
            x = roots.parameter[selected]
            axes.scatter(x, y[selected], s=size, color=colour, linewidth=0, zorder=3)
    panels.lower.axhline(0.0, color="0.5", linewidth=0.6)


def _contact_changes(sweep: Sweep) -> list[tuple[float, str, str]]:
    """Verticals, see `mark_events`, midway between two values with different contact states."""
    steps = [step for step in sweep.steps if step.roots is not None]
    changes = []
    for step, following in itertools.pairwise(steps):
        if following.contact is not None and step.contact != following.contact:
            middle = 0.5 * (step.value + following.value)
            changes.append((middle, state_label(following.contact), ":"))
    return changes


def _onsets(sweep: Sweep, thresholds: Thresholds | None) -> dict[str, Artist]:
    """Entries of a legend: from which value on the first `NAMED` modes grow.

    They are read off the crossings of `thresholds`, else off the modes of the sweep.
    """
    symbol = symbol_of(sweep.parameter)
    texts = []
    if thresholds is None:
        format_onset = onset_column(sweep.parameter).cell
        for mode in sweep.modes:
            if mode.onset is not None:
                texts.append(f"mode {mode.mode}: growth begins at {symbol} = {format_onset(mode)}")
    else:
        for crossing in thresholds.crossings:
            if crossing.direction == "up":
                hertz_text = ""
                if crossing.frequency_hz:
                    hertz_text = f", {crossing.frequency_hz:.4g} Hz"
                texts.append(f"{crossing.kind} from {symbol} = {crossing.mu:.4g}{hertz_text}")
    # the entries are texts alone: their line has no width
    return dict.fromkeys(texts[:NAMED], Line2D([], [], lw=0))


def _name_growing(axes: Axes, roots: _Roots, numbered: bool) -> None:
    """Write the frequency of growing modes beside their roots of the fastest growth.

    The fastest come first, `NAMED` of them; one as near in frequency as `ALIKE` to a named one has
    no name.

    roots: those that grow; numbered: whether the number of the mode is written too, since the
    legend names modes by their numbers.
    """
    _, right = axes.get_xlim()
    _, top = axes.get_ylim()
    named_frequencies: list[float] = []  # rad/s
    named_modes: list[int] = []
    for k in np.argsort(-roots.values.real):
        growth = roots.values[k].real
        omega = float(roots.values[k].imag)
        mode = int(roots.numbers[k])  # 0 of a root without a number
        if len(named_frequencies) == NAMED or mode in named_modes:
            continue
        if any(abs(omega - other) <= ALIKE * max(omega, other) for other in named_frequencies):
            continue
        named_frequencies.append(omega)
        text = hertz(omega)
        if mode:
            named_modes.append(mode)
            if numbered:
                text = f"mode {mode}, {text}"
        y = omega / math.tau
        up = 4 if y <= 0.95 * top else -4
        if growth < 0.2 * right:  # there is room to the right of the root
            write_beside(axes, text, (growth, y), (2, up), **NAME)
        else:  # the text ends at the right edge
            write_beside(axes, text, (right, y), (-2, up), **NAME)
