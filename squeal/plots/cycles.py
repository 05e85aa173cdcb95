"""Amplitude of periodic motions over a parameter, beside the sliding equilibrium."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from squeal.analysis.cycles import Cycles
from squeal.io.writing import number
from squeal.model.pad import PARAMETERS
from squeal.plots.style import SINGLE, Drawing, blank, literal, origin, style

LOOKS: dict[str, dict[str, Any]] = {
    "stable": {"color": "#C8380E", "lw": 1.4},
    "unstable or undecided": {"color": "#3498DB", "ls": (0, (3, 1.5))},
    "faster than the surface": {"color": "0.6", "ls": ":"},
}
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
        labels = {kind: f"cycle, {kind}" for kind in LOOKS}  # each once
        for i in range(len(value) - 1):
            kind, two = "unstable or undecided", found.orbits[i : i + 2]
            if any(one.sliding_holds is False for one in two):
                kind = "faster than the surface"
            elif {True} <= {one.stable for one in two} <= {True, None}:
                kind = "stable"
            label = labels.pop(kind, None)
            axes.plot(value[i : i + 2], size[i : i + 2], label=label, **LOOKS[kind])
        axes.plot(value[found.own], size[found.own], "o", mfc="none", mec="k", label="the scene")
        for kind, mark in MARKS.items():
            at = [i for i, one in enumerate(found.orbits) if one.turn == kind]
            if at:
                axes.plot(value[at], size[at], mark, color="k", ms=4, ls="", label=kind)
        for verdict, colour in (("stable", "k"), ("marginal", "0.6")):
            sliding = [(v, 0.0 if verdict == word else np.nan) for v, word in found.sliding]
            if np.isfinite([y for _, y in sliding]).any():
                axes.plot(*zip(*sliding, strict=True), "-", marker=".", ms=2, color=colour,
                          label=f"sliding, {verdict}")  # fmt: skip
        unit = "" if found.parameter == "mu" else f" ({PARAMETERS[found.parameter].unit})"
        axes.set_xlabel(literal(found.parameter) + unit if unit else r"friction coefficient $\mu$")
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
