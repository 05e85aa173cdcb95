"""Amplitude of periodic motions over a parameter, beside the sliding equilibrium."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from squeal.io.writing import number
from squeal.model.pad import PARAMETERS
from squeal.plots.style import SINGLE, Drawing, blank, literal, origin, style
from squeal.queries.cycles import Cycles, Orbit

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
    value = np.array([orbit.value for orbit in found.orbits])
    size = np.array([1e6 * orbit.amplitude[1] for orbit in found.orbits])
    with style():
        figure = Figure(figsize=(SINGLE, 3.2))
        axes = figure.subplots()
        labels = {kind: f"cycle, {kind}" for kind in LOOKS}  # each once
        for i in range(len(value) - 1):
            kind = _kind(found.orbits[i], found.orbits[i + 1])
            label = labels.pop(kind, None)
            axes.plot(value[i : i + 2], size[i : i + 2], label=label, **LOOKS[kind])
        axes.plot(value[found.own], size[found.own], "o", mfc="none", mec="k", label="the scene")
        for kind, mark in MARKS.items():
            at = [i for i, one in enumerate(found.orbits) if one.turn == kind]
            if at:
                axes.plot(value[at], size[at], mark, color="k", ms=4, ls="", label=kind)
        for verdict, colour in (("stable", "k"), ("marginal", "0.6")):
            values = [at for at, _ in found.sliding]
            heights = [0.0 if word == verdict else np.nan for _, word in found.sliding]
            if np.isfinite(heights).any():
                label = f"sliding, {verdict}"
                axes.plot(values, heights, "-", marker=".", ms=2, color=colour, label=label)
        if found.parameter == "mu":
            axes.set_xlabel(r"friction coefficient $\mu$")
        else:
            axes.set_xlabel(f"{literal(found.parameter)} ({PARAMETERS[found.parameter].unit})")
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


def _kind(one: Orbit, following: Orbit) -> str:
    """The kind, of `LOOKS`, of the curve between two neighbouring cycles."""
    if one.sliding_holds is False or following.sliding_holds is False:
        return "faster than the surface"
    if one.stable is False or following.stable is False:
        return "unstable or undecided"
    return "stable" if one.stable or following.stable else "unstable or undecided"
