"""Amplitude of periodic motions over a parameter, beside the sliding equilibrium."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from squeal.analysis.cycles import Cycles
from squeal.io.answer import number
from squeal.plots.style import SINGLE, Drawing, blank, literal, origin, style

STABLE, UNSTABLE = "#C8380E", "#3498DB"
MARKS = {"fold": "D", "period doubling": "s", "torus": "^", "grazing": "|"}


def cycles_drawing(found: Cycles, name: str) -> Drawing:
    """Cycles as a curve, red where stable and blue, dashed, where not; sliding on the axis."""
    title = f"Periodic motions of {name}"
    if not found.orbits:
        return blank(title, f"No periodic motion: {found.reason}.", __name__)
    value, size = np.array([(o.value, 1e6 * o.amplitude[1]) for o in found.orbits]).T
    with style():
        figure = Figure(figsize=(SINGLE, 3.2))
        axes = figure.subplots()
        labels = {"stable": False, "unstable or undecided": False}
        for i in range(len(value) - 1):
            stable = bool(found.orbits[i].stable or found.orbits[i + 1].stable)
            words = "stable" if stable else "unstable or undecided"
            look: Any = {"color": STABLE} if stable else {"color": UNSTABLE, "ls": (0, (3, 1.5))}
            label = None if labels[words] else f"cycle, {words}"
            labels[words] = True
            axes.plot(value[i : i + 2], size[i : i + 2], label=label, **look)
        axes.plot(value[found.own], size[found.own], "o", mfc="none", mec="k", label="the scene")
        for kind, mark in MARKS.items():
            at = [turn.value for turn in found.turns if turn.kind == kind]
            rows = [int(np.argmin(np.abs(value - v))) for v in at]
            if at:
                axes.plot(at, size[rows], mark, color="k", ms=4, ls="", label=kind)
        for verdict, colour in (("stable", "k"), ("marginal", "0.6")):
            sliding = [(v, 0.0 if verdict == word else np.nan) for v, word in found.sliding]
            if np.isfinite([y for _, y in sliding]).any():
                axes.plot(*zip(*sliding, strict=True), "-", marker=".", ms=2, color=colour,
                          label=f"sliding, {verdict}")  # fmt: skip
        unit = "" if found.parameter == "mu" else " (SI units)"
        axes.set_xlabel(
            r"friction coefficient $\mu$" if not unit else literal(found.parameter) + unit
        )
        axes.set_ylabel(r"amplitude of $y$ ($\mu$m)")
        axes.set_ylim(bottom=-0.04 * size.max())
        figure.legend(loc="outside lower center", ncols=2)
        axes.set_title(literal(name), loc="left")
    own = found.orbits[found.own]
    text = (
        f"Amplitude of periodic motions over {found.parameter}, from {number(value.min())} to "
        f"{number(value.max())}; {number(size[found.own])} micrometres at {number(own.value)}."
    )
    return Drawing(figure, text, title, origin(__name__))
