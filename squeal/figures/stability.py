"""Figures of the stability chapter, from the results of `squeal.stability_study`."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from squeal.angle_map import NAMES
from squeal.figures.style import DOUBLE, Drawing, origin, program, style

COLOURS = ("#3498DB", "#6A1B7B", "#C8380E")
VERDICT_COLOURS = ("#FFFFFF", "#CFE6F5", "#C8380E", "#6A1B7B", "#8C8C8C")
ANGLE_TICKS = ([0, np.pi / 2, np.pi], ["$0$", r"$\pi/2$", r"$\pi$"])
MARKS = {
    "a": (0.5, 1.0),
    "b": (1.0, 0.5),
    "c": (0.75, 0.75),
    "d": (0.83, 0.83),
}


def _map(axes: Axes, values: np.ndarray, axis: np.ndarray, colours: list[str], title: str) -> None:
    """Areas with smoothed outlines between them, and the four cases."""
    cells = np.concatenate([[0.0], axis, [np.pi]])
    padded = np.pad(values, 1, mode="edge")
    axes.pcolormesh(
        axis,
        axis,
        values.T,
        cmap=ListedColormap(colours),
        vmin=-0.5,
        vmax=len(colours) - 0.5,
        shading="nearest",
        rasterized=True,
    )
    for code in np.unique(values):
        inside = (padded == code).astype(float).T
        if inside.min() < 1.0:
            axes.contour(cells, cells, inside, levels=[0.5], colors="k", linewidths=0.5)
    for case, (a, b) in MARKS.items():
        axes.text(
            a * np.pi,
            b * np.pi,
            case,
            ha="center",
            va="center",
            fontsize=7,
            bbox={"boxstyle": "circle,pad=0.15", "fc": "w", "ec": "k", "lw": 0.6},
            clip_on=False,
        )
    axes.set_aspect("equal")
    axes.set_xlim(0, np.pi)
    axes.set_ylim(0, np.pi)
    axes.set_xticks(*ANGLE_TICKS)
    axes.set_yticks(*ANGLE_TICKS)
    axes.set_title(title, pad=8.0)
    axes.set_xlabel(r"$\alpha_1$ [rad]")


def maps(found: dict[str, Any]) -> Figure:
    """Conditions (23a, b) as printed and with signs followed, beside the verdicts."""
    m = found["maps"]
    figure = Figure(figsize=(DOUBLE, 2.75))
    grid = figure.subplots(1, 4, sharey=True)
    fine, coarse = np.array(m["fine"]), np.array(m["coarse"])
    two = ["#FFFFFF", "#404040"]
    panels: list[tuple[str, np.ndarray, list[str], str]] = [
        ("as_printed", fine, two, "(a) (23) as printed"),
        ("sign_aware", fine, two, "(b) signs followed"),
        ("b3", fine, list(VERDICT_COLOURS), "(c) B3, origin"),
        ("b2", coarse, list(VERDICT_COLOURS), "(d) B2, equilibrium"),
    ]
    for axes, (key, axis, colours, title) in zip(grid, panels, strict=True):
        _map(axes, np.array(m[key]), axis, colours, title)
    grid[0].set_ylabel(r"$\alpha_2$ [rad]")
    names = ["(23a, b) hold", *NAMES[1:]]
    shown = ["#404040", *VERDICT_COLOURS[1:]]
    handles = [Patch(facecolor=c, edgecolor="k", linewidth=0.5) for c in shown]
    figure.legend(handles, names, loc="outside lower center", ncols=5)
    return figure


def growth(found: dict[str, Any]) -> Figure:
    """Growth rates and frequencies: predicted by the linearisation, fitted to simulations."""
    figure = Figure(figsize=(DOUBLE, 2.5))
    left, right = figure.subplots(1, 2)
    looks = zip(found["growth"], COLOURS, ("o", "s", "^"), strict=True)
    for one, colour, marker in looks:
        mu = np.array(one["mu"])
        for axes, part, unit in ((left, 0, 1e3), (right, 1, 2e3 * np.pi)):
            predicted = np.array(one["predicted"])[:, part] / unit
            fitted = np.array(one["fitted"])[:, part] / unit
            axes.plot(mu, fitted, marker, mfc="none", mec=colour, ms=5, label=one["name"])
            axes.plot(mu, predicted, "+", color=colour, ms=4)
    left.set_ylabel("growth rate [1/ms]")
    right.set_ylabel("frequency [kHz]")
    right.set_ylim(bottom=0.0)
    for axes in (left, right):
        axes.set_xlabel(r"friction $\mu$")
    handles, names = left.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=3)
    return figure


FIGURES: dict[str, tuple[Callable[[dict[str, Any]], Figure], str, str]] = {
    "maps": (
        maps,
        "Maps over the spring angles",
        "Four maps over the two spring angles: where conditions (23a, b) hold as printed, where "
        "they hold with signs followed, the verdict on model B3, and the verdict on the "
        "equilibria of model B2.",
    ),
    "growth": (
        growth,
        "Growth rates fitted to simulations",
        "Growth rate and frequency over friction: crosses are predicted, open marks fitted "
        "to the start of simulations; each cross lies within its mark.",
    ),
}


def drawing(name: str, found: dict[str, Any]) -> Drawing:
    """One of the chapter's figures, ready to be saved."""
    draw, title, alternative = FIGURES[name]
    with style():
        figure = draw(found)
    return Drawing(figure, alternative, title, origin("squeal.figures.stability", [found]))


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("results", type=Path, metavar="JSON", help="of squeal.stability_study")
    parser.add_argument("figure", choices=sorted(FIGURES))


if __name__ == "__main__":
    sys.exit(
        program(
            "Draw one figure of the stability chapter.",
            _arguments,
            lambda given: drawing(
                given.figure, json.loads(given.results.read_text(encoding="utf-8"))
            ),
        )
    )
