"""Error against run time of a map and of a threshold by eigenvalue programs, two panels."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from squeal.files.provenance import Provenance
from squeal.plots.style import DOUBLE, Drawing, origin, program, style

LOOKS = {
    "squeal": ("#C8380E", "o", "-"),
    "numpy.linalg.eigvals": ("#3498DB", "^", "--"),
    "control.ss().poles()": ("#6A1B7B", "v", ":"),
}
PANELS = {
    "map": ("(a) map of B3", "greatest error of a share of the area"),
    "threshold": ("(b) threshold of flutter", r"error of the critical $\mu$"),
}
LEAST = 1e-16  # errors below are drawn here


def linear(timings: list[dict[str, Any]]) -> Figure:
    """Map and threshold."""
    figure = Figure(figsize=(DOUBLE, 2.3))
    grid = figure.subplots(1, len(PANELS))
    for axes, (task, (title, label)) in zip(grid, PANELS.items(), strict=True):
        for name, (colour, marker, line) in LOOKS.items():
            own = [t for t in timings if (t["task"], t["program"]) == (task, name)]
            x, y = [max(t["error"], LEAST) for t in own], [1e3 * t["seconds"] for t in own]
            axes.plot(x, y, line, marker=marker, ms=3.2, linewidth=0.7, color=colour, label=name)
        axes.set(xscale="log", yscale="log", title=title, xlabel=label, ylabel="run time [ms]")
        axes.invert_xaxis()
        axes.tick_params(which="minor", length=0)
    figure.legend(*grid[1].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def alternative(timings: list[dict[str, Any]]) -> str:
    """The picture in words."""
    parts = []
    for task in PANELS:
        for name in LOOKS:
            own = [t for t in timings if (t["task"], t["program"]) == (task, name)]
            if own:
                least = min(own, key=lambda t: t["error"])
                parts.append(
                    f"{task} by {name}: least error {least['error']:.1e} in "
                    f"{1e3 * least['seconds']:.2g} ms"
                )
    return "Error against run time of eigenvalue programs. " + "; ".join(parts) + "."


def _draw(given: argparse.Namespace) -> Drawing:
    found = json.loads(given.results.read_text(encoding="utf-8"))
    with style():
        figure = linear(found["linear"])
    made = origin("squeal.article.figures.linear", [Provenance.from_dict(found["provenance"])])
    title = "Error against run time of eigenvalue programs"
    return Drawing(figure, alternative(found["linear"]), title, made)


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("results", type=Path, metavar="JSON", help="of squeal.article.precision")


if __name__ == "__main__":
    sys.exit(program("Draw error against run time of eigenvalues.", _arguments, _draw))
