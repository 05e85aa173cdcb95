"""Root loci: eigenvalues in the complex plane over mu, from the results of `studies.loci`."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.files.provenance import Provenance
from squeal.plots.style import DOUBLE, Drawing, origin, program, style

KILOHERTZ, PER_MS = 2e3 * np.pi, 1e3
"""Units of the axes in rad/s and 1/s."""


def rows(found: dict[str, Any]) -> list[list[dict[str, Any]]]:
    """The scenes of a result file in one row for each model."""
    models = dict.fromkeys(scene["model"] for scene in found["scenes"])
    return [[s for s in found["scenes"] if s["model"] == model] for model in models]


def title(scene: dict[str, Any]) -> str:
    """Model and case, the latter from the name of the scene's file."""
    return f"{scene['model']}, case ({scene['name'].rpartition('-')[2]})"


def upper_half(part: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Growth (1/ms) and frequency (kHz) of the roots with Im >= 0, and where they stood in it."""
    real, imag = np.array(part["real"]), np.array(part["imag"])
    inside = imag >= 0.0
    return real[inside] / PER_MS, imag[inside] / KILOHERTZ, np.argwhere(inside)


def scene_mark(scene: dict[str, Any]) -> str:
    """Marker of the scene's own eigenvalues: another one where they are not on the branch."""
    return "o" if scene["equilibrium"]["on_branch"] else "^"


def _panel(axes: Axes, scene: dict[str, Any]) -> None:
    axes.axvline(0.0, color="0.75", linewidth=0.5, zorder=0)
    if scene["loop"].get("rank_one"):
        growth, frequency, _ = upper_half(scene["loop"])
        axes.plot(growth, frequency, "s", color="0.82", ms=8, mew=0.0, zorder=1, gid="loop")
    branch = scene["branch"]
    if "mu" in branch:
        growth, frequency, where = upper_half(branch)
        mu = np.array(branch["mu"])[where[:, 1]]
        axes.scatter(
            growth, frequency, c=mu, s=12, cmap="viridis", vmin=0, vmax=1, lw=0, zorder=2, gid="mu"
        )
        start = mu == 0.0
        axes.plot(growth[start], frequency[start], "k_", ms=11, mew=0.8, gid="start")
    if "real" in scene["equilibrium"]:
        growth, frequency, _ = upper_half(scene["equilibrium"])
        look: dict[str, Any] = {
            "mfc": "none",
            "mec": "#C8380E",
            "ms": 6,
            "mew": 0.9,
            "gid": "scene",
        }
        axes.plot(growth, frequency, scene_mark(scene), **look)
    axes.set_title(title(scene), pad=3.0)


def loci_figure(found: dict[str, Any]) -> Figure:
    """One panel a scene; frequency upwards, growth to the right, coloured by mu."""
    grid_of = rows(found)
    with style():
        figure = Figure(figsize=(DOUBLE, 0.7 + 1.75 * len(grid_of)))
        columns = max(map(len, grid_of))
        grid = figure.subplots(len(grid_of), columns, squeeze=False, sharex=True, sharey="row")
        for scenes, line in zip(grid_of, grid, strict=True):
            for scene, axes in zip(scenes, line, strict=False):
                _panel(axes, scene)
            line[0].set_ylabel("frequency [kHz]")
            top = max(axes.dataLim.y1 for axes in line)
            line[0].set_ylim(0.0, 1.07 * top)
        reach = max(abs(axes.dataLim.intervalx).max() for axes in grid.flat)
        reach = 1.15 * reach if np.isfinite(reach) and reach > 0.0 else 1.0
        grid[0, 0].set_xlim(-reach, reach)
        for axes in grid[-1]:
            axes.set_xlabel("growth rate [1/ms]")
        drawn = [c for axes in grid.flat for c in axes.collections]
        if drawn:
            figure.colorbar(drawn[0], ax=grid, label=r"friction $\mu$", aspect=40, pad=0.015)
        figure.legend(*_legend(found), loc="outside upper center", ncols=4, columnspacing=1.4)
    return figure


def _legend(found: dict[str, Any]) -> tuple[list[Line2D], list[str]]:
    def mark(marker: str, **look: Any) -> Line2D:
        return Line2D([], [], linestyle="", marker=marker, **look)

    red: dict[str, Any] = {"mfc": "none", "mec": "#C8380E", "ms": 6}
    entries = [
        (mark("_", color="k", ms=11, mew=0.8), r"$\mu = 0$"),
        (mark("o", **red), r"the scene's $\mu$"),
    ]
    if any(not s["equilibrium"].get("on_branch", True) for s in found["scenes"]):
        entries.append((mark("^", **red), r"the scene's $\mu$, off the branch"))
    if any(s["loop"].get("rank_one") for s in found["scenes"]):
        entries.append((mark("s", color="0.82", ms=8, mew=0.0), "friction loop, equilibrium held"))
    handles, names = zip(*entries, strict=True)
    return list(handles), list(names)


def growths(found: dict[str, Any]) -> str:
    """Which scenes grow, in words."""
    growing = []
    for scene in found["scenes"]:
        rate = max(scene["equilibrium"].get("real", [0.0])) / PER_MS
        if rate > 0.0:
            growing.append(f"{title(scene)} at {rate:.3g} per ms")
    return f"a mode grows in {'; '.join(growing)}" if growing else "no mode grows"


def drawing(found: dict[str, Any]) -> Drawing:
    """The figure of `squeal.article.studies.loci` results, ready to be saved."""
    text = (
        "One panel for each model and case: eigenvalues of the upper half plane along the "
        "equilibrium branch, coloured by friction from 0 to 1; frequency in kHz upwards, growth "
        "rate in 1/ms to the right. Ticks mark zero friction, rings the scene's. Pads whose "
        "eigenvalues stay on the imaginary axis are marginal; at the scenes' friction "
        f"{growths(found)}."
    )
    made = origin("squeal.article.figures.loci", [Provenance.from_dict(found["provenance"])])
    return Drawing(loci_figure(found), text, "Root loci over the coefficient of friction", made)


def main(summary: str, draw: Callable[[dict[str, Any]], Drawing]) -> int:
    """Command line of a figure drawn from one file of `squeal.article.studies.loci`."""

    def arguments(parser: argparse.ArgumentParser) -> None:
        parser.add_argument(
            "results", type=Path, metavar="JSON", help="of squeal.article.studies.loci"
        )

    return program(summary, arguments, lambda given: draw(json.loads(given.results.read_text())))


if __name__ == "__main__":
    sys.exit(main("Draw root loci over the coefficient of friction.", drawing))
