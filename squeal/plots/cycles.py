"""Amplitude of periodic motions over a parameter, beside the sliding equilibrium."""

import itertools
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from squeal.io.writing import number, unit_word
from squeal.model.pad import PARAMETERS
from squeal.plots.coupling import NO_EQUILIBRIUM
from squeal.plots.maps import friction_symbol
from squeal.plots.style import SINGLE, Drawing, blank, literal, origin, style, write_upright
from squeal.queries.cycles import IN_DOUBT, Cycles, Orbit

LOOKS: dict[str, dict[str, Any]] = {
    "stable": {"color": "#C8380E", "lw": 1.4},
    "unstable or undecided": {"color": "#3498DB", "ls": (0, (3, 1.5))},
    "faster than the surface": {"color": "0.6", "ls": ":"},
}
SLIDING_LOOKS: dict[str, dict[str, Any]] = {
    "stable": {"color": "k"},
    "marginal": {"color": "0.6"},
    "flutter": {"color": "k", "ls": (0, (3, 1.5))},
    "divergence": {"color": "k", "ls": (0, (1, 1.5))},
    IN_DOUBT: {"color": "0.8"},
}
VISIBLE = 0.03  # of the axes: a shorter curve is hidden by its marks, and not in the legend
MARKS = {"fold": "D", "period doubling": "s", "torus": "^", "grazing": "|"}


def cycles_drawing(cycles: Cycles, name: str) -> Drawing:
    """Draw the amplitude of cycles as a curve, red where stable and blue, dashed, where not.

    Steady sliding lies on the axis, dashed where it flutters, with the values at which its verdict
    changes.
    """
    title = f"Periodic motions of {name}"
    if not cycles.orbits:
        return blank(title, f"No periodic motion: {cycles.reason}.", __name__)
    values = np.array([orbit.value for orbit in cycles.orbits])
    amplitudes = np.array([1e6 * orbit.amplitude[1] for orbit in cycles.orbits])  # of y, um
    with style():
        figure = Figure(figsize=(SINGLE, 3.2))
        axes = figure.subplots()
        _draw_cycles(axes, cycles, values, amplitudes)
        _draw_sliding(axes, cycles)
        unit = unit_word(PARAMETERS[cycles.parameter].unit)
        axes.set_xlabel(friction_symbol(cycles.parameter, unit))
        axes.set_ylabel(r"amplitude of $y$ [$\mu$m]")
        axes.set_ylim(bottom=-0.04 * amplitudes.max())
        handles, names = axes.get_legend_handles_labels()
        entries = dict(zip(names, handles, strict=True))  # each name once
        figure.legend(entries.values(), entries, loc="outside lower center", ncols=2)
        axes.set_title(literal(name), loc="left")
    at_scene = cycles.own  # the index of the cycle at the scene's own value
    text = (
        f"Amplitude of periodic motions over {cycles.parameter}, from {number(values.min())} to "
        f"{number(values.max())}; {number(amplitudes[at_scene])} micrometres at "
        f"{number(values[at_scene])}."
    )
    for value, verdict in cycles.critical:
        text += f" Sliding: {verdict or NO_EQUILIBRIUM} from {number(value)} on."
    return Drawing(figure, text, title, origin(__name__))


def _draw_cycles(axes: Axes, cycles: Cycles, values: NDArray, amplitudes: NDArray) -> None:
    """Draw the branch of cycles, each piece in the look of its kind, with marks at bifurcations.

    A piece joins two neighbouring cycles. values, amplitudes (m,): the parameter and the amplitude
    (micrometres) of each cycle.
    """
    # of each piece: the share of the horizontal axis that it covers plus that of the vertical one
    lengths = np.abs(np.diff(values)) / (np.ptp(values) or 1.0)
    lengths += np.abs(np.diff(amplitudes)) / amplitudes.max()
    kinds = [_kind(*pair) for pair in itertools.pairwise(cycles.orbits)]
    length_of_kind = dict.fromkeys(kinds, 0.0)
    for kind, length in zip(kinds, lengths, strict=True):
        length_of_kind[kind] += length
    for i, kind in enumerate(kinds):
        # a kind whose pieces are hidden by their marks has no entry in the legend
        label = f"cycle, {kind}" if length_of_kind[kind] > VISIBLE else None
        axes.plot(values[i : i + 2], amplitudes[i : i + 2], label=label, **LOOKS[kind])
    point = (values[cycles.own], amplitudes[cycles.own])
    axes.plot(*point, "o", mfc="none", mec="k", label="the scene")
    for kind, mark in MARKS.items():
        marked = [i for i, orbit in enumerate(cycles.orbits) if orbit.turn == kind]
        if marked:
            axes.plot(values[marked], amplitudes[marked], mark, color="k", ms=4, ls="", label=kind)


def _draw_sliding(axes: Axes, cycles: Cycles) -> None:
    """Draw steady sliding at amplitude zero, where it exists, and where its verdict changes."""
    # intervals of one verdict: value and verdict where each starts, and the value where it ends
    starts = [cycles.sliding[0], *cycles.critical]
    ends = [*(value for value, _ in cycles.critical), cycles.sliding[-1][0]]
    for (start, verdict), end in zip(starts, ends, strict=True):
        if verdict is not None:
            look = SLIDING_LOOKS[verdict] | {"label": f"sliding, {verdict}"}
            axes.plot([start, end], [0.0, 0.0], marker=".", ms=2, **look)
    for value, verdict in cycles.critical:
        axes.axvline(value, color="0.6", lw=0.6, zorder=0, gid="critical")
        write_upright(axes, value, f"{verdict or NO_EQUILIBRIUM} from {value:.4g}")


def _kind(orbit: Orbit, following: Orbit) -> str:
    """The kind, of `LOOKS`, of the curve between two neighbouring cycles.

    `stable` of a cycle is None where its multipliers leave it undecided: the other cycle then
    decides.
    """
    if orbit.sliding_holds is False or following.sliding_holds is False:
        return "faster than the surface"
    if orbit.stable is False or following.stable is False:
        return "unstable or undecided"
    if orbit.stable or following.stable:
        return "stable"
    return "unstable or undecided"
