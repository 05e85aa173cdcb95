"""Work-precision diagrams: error of the final place against run time, one panel a case."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.figures.style import DOUBLE, Drawing, origin, program, style

LOOKS = {
    "squeal": ("#C8380E", "o", "-"),
    "squeal, batch": ("#C8380E", "s", "--"),
    "SciPy DOP853": ("#3498DB", "^", "-"),
    "SciPy RK45": ("#6A1B7B", "v", "-"),
    "SciPy Radau": ("#000000", "D", ":"),
    "SciPy LSODA": ("#7A7A7A", "<", "-."),
    "CVODE Adams": ("#2E7D32", ">", "--"),
    "diffrax Dopri8": ("#B8860B", "p", "--"),
}


def _panel(axes: Axes, points: list[dict[str, Any]], title: str) -> None:
    for path, (colour, marker, line) in LOOKS.items():
        own = [p for p in points if p["path"] == path and p["error"]]
        if not own:
            continue
        x = [p["error"] for p in own]
        y = [1e3 * p["seconds"] for p in own]
        axes.plot(x, y, line, color=colour, linewidth=0.7, zorder=1)
        for p, a, b in zip(own, x, y, strict=True):
            whole = p["missed"] == p["extra"] == 0
            face = colour if whole else "white"
            axes.plot(a, b, marker, color=colour, mfc=face, ms=3.2, mew=0.7, zorder=2)
        axes.plot([], [], line, marker=marker, color=colour, ms=3.2, linewidth=0.7, label=path)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.invert_xaxis()
    axes.set_title(title)


def precision(found: dict[str, Any]) -> Figure:
    """One panel for each case."""
    cases = list(dict.fromkeys(p["case"] for p in found["points"]))
    figure = Figure(figsize=(DOUBLE, 4.6))
    grid = figure.subplots(2, 2, sharex=True, sharey=True)
    for axes, case in zip(grid.flat, cases, strict=True):
        _panel(axes, [p for p in found["points"] if p["case"] == case], case)
    for axes in grid[1]:
        axes.set_xlabel("relative error of the final place")
    for axes in grid[:, 0]:
        axes.set_ylabel("run time [ms]")
    handles, names = grid.flat[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=4)
    return figure


def alternative(found: dict[str, Any]) -> str:
    """The picture in words."""
    points = found["points"]
    parts = []
    for path in dict.fromkeys(p["path"] for p in points):
        own = [p for p in points if p["path"] == path and p["error"]]
        low, high = (f(1e3 * p["seconds"] for p in own) for f in (min, max))
        best, lost = min(p["error"] for p in own), sum(p["missed"] > 0 for p in own)
        parts.append(
            f"{path}: {low:.2g} to {high:.2g} ms, least error {best:.1e}, contact changes missed "
            f"in {lost} of {len(own)} runs"
        )
    return "Work-precision diagrams of four cases. " + "; ".join(parts) + "."


def _draw(given: argparse.Namespace) -> Drawing:
    found = json.loads(given.results.read_text(encoding="utf-8"))
    with style():
        figure = precision(found)
    made = origin("squeal.figures.precision", [found])
    return Drawing(figure, alternative(found), "Work-precision diagrams", made)


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("results", type=Path, metavar="JSON", help="of squeal.precision")


if __name__ == "__main__":
    sys.exit(program("Draw the work-precision diagrams.", _arguments, _draw))
