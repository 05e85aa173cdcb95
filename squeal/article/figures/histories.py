"""Figs. 4-7 and 9-12: time histories of the article's cases."""

from pathlib import Path

from matplotlib.figure import Figure

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.runs import read_run
from squeal.model.contact import contact_law
from squeal.plots.motion import Looks, Run, alternative_text, strip, trace
from squeal.plots.style import SINGLE, Drawing, origin, style


def draw(summary: Path, history: Path) -> Drawing:
    """From what `squeal simulate` wrote: the JSON summary and the CSV history."""
    return drawing(read_run(summary, history))


def history_figure(run: Run) -> Figure:
    """Two panels of normalised signals over a strip of the contact states."""
    looks = Looks.of(run)
    with style():
        figure = Figure(figsize=(SINGLE, 2.65))
        heights = [3.0, 3.0, 0.3 + 0.6 * len(looks.states)]  # labels of the states stand apart
        plotted = contact_law(run.model).plotted
        grid = figure.subplots(3, 1, sharex=True, height_ratios=heights)
        for axes, signal, letter in zip(grid, plotted, "ab", strict=False):
            trace(axes, run, signal, letter, looks)
        strip(grid[2], looks)
        figure.align_ylabels(grid)
    return figure


def drawing(run: Run) -> Drawing:
    """The figure of one simulated scene, ready to be saved."""
    first, second = (signal.words for signal in contact_law(run.model).plotted)
    name = f"Time histories of {first} and {second}, scene {run.name}"
    made = origin(__name__, run.provenance)
    return Drawing(history_figure(run), alternative_text(run), name, made)


_FORCES = {
    "B1": "contact force over the brake force $F_n$ at (a) the leading and (b) the trailing edge",
    "B2": "(a) normal reaction over the brake force $F_n$ and (b) its position over the half "
    "width, negative towards the leading edge",
}


def _caption(name: str) -> str:
    """The caption of a motion by the name of its scene, such as b1-a."""
    model, case = name.upper().split("-")
    return (
        f"Model {model}, case ({case.lower()}): {_FORCES[model]}. Below: the contact state over "
        "time, which colours the curves."
    )


CAPTIONS = {f"fig{number:02}": _caption(name) for name, number in HISTORY_FIGURES.items()}
