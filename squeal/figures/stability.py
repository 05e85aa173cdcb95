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
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from squeal.angle_map import NAMES
from squeal.figures.style import DOUBLE, Drawing, origin, program, style

CASES = "abcd"
MODELS = ("b1", "b2")
MODE_COLOURS = ("#3498DB", "#6A1B7B", "#C8380E")
MODE_LINES: tuple[Any, ...] = ("-", "--", "-.")
VERDICT_COLOURS = ("#FFFFFF", "#CFE6F5", "#C8380E", "#6A1B7B", "#8C8C8C")
ANGLE_TICKS = ([0, np.pi / 2, np.pi], ["$0$", r"$\pi/2$", r"$\pi$"])
MARKS = {
    "a": (0.5, 1.0),
    "b": (1.0, 0.5),
    "c": (0.75, 0.75),
    "d": (0.83, 0.83),
}


def _grid(height: float, rows: int = 2, **more: Any) -> tuple[Figure, np.ndarray]:
    figure = Figure(figsize=(DOUBLE, height))
    return figure, figure.subplots(rows, 4, squeeze=False, **more)


def loci(found: dict[str, Any]) -> Figure:
    """Eigenvalues in the upper half plane over mu, one panel a scene."""
    figure, grid = _grid(4.1, sharey=True)
    image = None
    for row, model in enumerate(MODELS):
        for column, case in enumerate(CASES):
            axes, scene = grid[row, column], found["cases"][f"{model}-{case}"]
            s = scene["sweep"]
            real, imag = np.array(s["all_real"]), np.array(s["all_imag"]) / (2e3 * np.pi)
            upper = imag >= 0
            mu = np.broadcast_to(np.array(s["mu"])[:, None], real.shape)
            image = axes.scatter(
                real[upper] / 1e3, imag[upper], c=mu[upper], s=4, cmap="viridis", vmin=0, vmax=1
            )
            now = int(np.argmin(np.abs(np.array(s["mu"]) - scene["mu"])))
            here = upper[now]
            axes.plot(real[now][here] / 1e3, imag[now][here], "o", mfc="none", mec="k", ms=5)
            reach = max(0.1, 1.15 * np.abs(real).max() / 1e3)
            axes.set_xlim(-reach, reach)
            axes.axvline(0.0, color="0.7", linewidth=0.5, zorder=0)
            axes.set_title(f"{model.upper()}, case ({case})")
            axes.set_ylim(bottom=0.0)
            if row:
                axes.set_xlabel("growth rate [1/ms]")
            if not column:
                axes.set_ylabel("frequency [kHz]")
    assert image is not None
    figure.colorbar(image, ax=grid, label=r"friction $\mu$", shrink=0.7, pad=0.01)
    return figure


def coupling(found: dict[str, Any]) -> Figure:
    """Frequencies and growth rates of the tracked modes over mu."""
    figure, grid = _grid(
        5.6, rows=4, sharex=True, gridspec_kw={"height_ratios": [2.0, 1.0, 2.0, 1.0]}
    )
    for i, model in enumerate(MODELS):
        for column, case in enumerate(CASES):
            scene = found["cases"][f"{model}-{case}"]
            s, upper, lower = scene["sweep"], grid[2 * i, column], grid[2 * i + 1, column]
            curves = zip(s["frequency_hz"], s["growth_rate"], strict=True)
            for k, (frequency, rate) in enumerate(curves):
                look: dict[str, Any] = {"color": MODE_COLOURS[k], "linestyle": MODE_LINES[k]}
                upper.plot(s["mu"], np.array(frequency) / 1e3, **look)
                lower.plot(s["mu"], np.array(rate) / 1e3, **look)
            for axes in (upper, lower):
                axes.axvline(scene["mu"], color="0.55", linewidth=0.6, zorder=0)
                for change in s["contact_changes"]:
                    axes.axvline(change, color="k", linewidth=0.7, linestyle=":")
                for point in scene["thresholds"]:
                    if point["mu"] <= 1.0:
                        axes.axvline(point["mu"], color="#C8380E", linewidth=0.7)
            upper.set_title(f"{model.upper()}, case ({case})")
            upper.set_ylim(bottom=0.0)
            largest = np.abs(s["growth_rate"]).max() / 1e3
            if largest < 1e-6:
                lower.set_ylim(-1.0, 1.0)
            if not column:
                upper.set_ylabel("frequency\n[kHz]")
                lower.set_ylabel("growth rate\n[1/ms]")
            if i:
                lower.set_xlabel(r"friction $\mu$")
            lower.set_xlim(0.0, 1.0)
    handles = [
        Line2D([], [], color=c, linestyle=s) for c, s in zip(MODE_COLOURS, MODE_LINES, strict=True)
    ]
    handles += [
        Line2D([], [], color="0.55", linewidth=0.6),
        Line2D([], [], color="k", linewidth=0.7, linestyle=":"),
        Line2D([], [], color="#C8380E", linewidth=0.7),
    ]
    names = ["mode 1", "mode 2", "mode 3", r"the scene's $\mu$", "contact change", "threshold"]
    figure.legend(handles, names, loc="outside upper center", ncols=6)
    return figure


def _outline(w: float, h: float, x: float, y: float, turn: float) -> np.ndarray:
    corners = np.array([[-w, -h], [w, -h], [w, h], [-w, h], [-w, -h]])
    c, s = np.cos(turn), np.sin(turn)
    return np.asarray(corners @ np.array([[c, s], [-s, c]]) + [x, y])


def modes(found: dict[str, Any]) -> Figure:
    """Mode shapes of model B2 as motions of the pad, at two phases."""
    figure, grid = _grid(3.6, rows=3, sharex=True, sharey=True)
    h = found["pad"]["h"] / found["pad"]["w"]
    for column, case in enumerate(CASES):
        for row, mode in enumerate(found["cases"][f"b2-{case}"]["modes"]):
            axes = grid[row, column]
            axes.plot(*_outline(1.0, h, 0, 0, 0).T, color="0.7", linewidth=0.7)
            shape = np.array(mode["real"]) + 1j * np.array(mode["imag"])
            for phase, look in ((0.0, "-"), (np.pi, "--")):
                x, y, turn = 0.35 * (shape * np.exp(1j * phase)).real
                axes.plot(*_outline(1.0, h, x, y, turn).T, color="#3498DB", linestyle=look)
            axes.set_aspect("equal")
            axes.set_xlim(-1.6, 1.6)
            axes.set_ylim(-h - 0.75, h + 0.75)
            axes.set_xticks([])
            axes.set_yticks([])
            axes.set_title(
                (f"case ({case})\n" if not row else "") + f"{mode['frequency_hz']:.0f} Hz", pad=2.0
            )
    return figure


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
    figure, grid = _grid(2.75, rows=1, sharey=True)
    fine, coarse = np.array(m["fine"]), np.array(m["coarse"])
    two = ["#FFFFFF", "#404040"]
    panels: list[tuple[str, np.ndarray, list[str], str]] = [
        ("as_printed", fine, two, "(a) (23) as printed"),
        ("sign_aware", fine, two, "(b) signs followed"),
        ("b3", fine, list(VERDICT_COLOURS), "(c) B3, origin"),
        ("b2", coarse, list(VERDICT_COLOURS), "(d) B2, equilibrium"),
    ]
    for axes, (key, axis, colours, title) in zip(grid[0], panels, strict=True):
        _map(axes, np.array(m[key]), axis, colours, title)
    grid[0, 0].set_ylabel(r"$\alpha_2$ [rad]")
    names = ["(23a, b) hold", *NAMES[1:]]
    shown = ["#404040", *VERDICT_COLOURS[1:]]
    handles = [Patch(facecolor=c, edgecolor="k", linewidth=0.5) for c in shown]
    figure.legend(handles, names, loc="outside lower center", ncols=5)
    return figure


def growth(found: dict[str, Any]) -> Figure:
    """Growth rates and frequencies: predicted by the linearisation, fitted to simulations."""
    figure = Figure(figsize=(DOUBLE, 2.5))
    left, right = figure.subplots(1, 2)
    looks = zip(found["growth"], MODE_COLOURS, ("o", "s", "^"), strict=True)
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
    "loci": (
        loci,
        "Root loci over the coefficient of friction",
        "Eight panels, one for each model and case, with the eigenvalues of the upper half plane "
        "coloured by friction from 0 to 1; a ring marks the scene's. Marginal pads stay on "
        "the imaginary axis, fluttering ones leave it to both sides.",
    ),
    "coupling": (
        coupling,
        "Mode coupling over the coefficient of friction",
        "Frequencies and growth rates of the three modes over friction for each model and case. "
        "Where two frequencies meet, growth sets in; vertical lines mark the scene's friction, "
        "contact changes and thresholds.",
    ),
    "modes": (
        modes,
        "Mode shapes of model B2",
        "The pad at rest and displaced in opposite phases for the three modes of each case, with "
        "the frequency over each drawing.",
    ),
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
