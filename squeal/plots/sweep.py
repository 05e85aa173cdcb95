"""Figures that the stability queries draw on request: eigenvalues, and their way over mu."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from squeal.plots.areas import VERDICT_COLOURS
from squeal.plots.style import DOUBLE, SINGLE, Drawing, origin, save, style
from squeal.stability import VERDICTS

_MODULE = "squeal.plots.sweep"


def eigenvalue_figure(values: np.ndarray, beside: np.ndarray | None = None) -> Figure:
    """Eigenvalues (rad/s) in the complex plane; `beside`: those about the origin, as crosses."""
    figure = Figure(figsize=(SINGLE, 2.9))
    axes = figure.add_subplot()
    axes.axvline(0.0, color="0.7", linewidth=0.6, zorder=0)
    axes.axhline(0.0, color="0.7", linewidth=0.6, zorder=0)
    sets = [(values, "o", "equilibrium"), (beside, "x", "origin, full contact")]
    for points, marker, label in sets:
        if points is not None:
            imag = points.imag / (2e3 * np.pi)
            face = "none" if marker == "o" else "#C8380E"
            edge = "#3498DB" if marker == "o" else None
            axes.scatter(points.real, imag, marker=marker, fc=face, ec=edge, s=26, label=label)
    reach = max(1.0, 1.2 * float(np.abs(values.real).max()))
    axes.set_xlim(-reach, reach)
    axes.set_xlabel("real part [1/s]")
    axes.set_ylabel(r"imaginary part / $2\pi$ [kHz]")
    if beside is not None:
        axes.legend(loc="center right", borderaxespad=0.4)
    return figure


def sweep_figure(
    mus: np.ndarray,
    values: np.ndarray,
    verdicts: Sequence[str | None],
    thresholds: Sequence[float] = (),
) -> Figure:
    """Frequencies and growth rates over mu, the verdict as background.

    values (n, m) in rad/s, each row sorted by frequency; NaN and None where there is no
    equilibrium; thresholds are drawn as dashed lines.
    """
    figure = Figure(figsize=(DOUBLE, 3.4))
    upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1.6, 1.0]})
    upper.plot(mus, np.abs(values.imag[:, ::2]) / (2e3 * np.pi), color="k")
    lower.plot(mus, values.real, color="k")
    edges = np.concatenate([mus[:1], 0.5 * (mus[1:] + mus[:-1]), mus[-1:]])
    for axes in (upper, lower):
        for low, high, verdict in zip(edges, edges[1:], verdicts, strict=False):
            if verdict is not None:
                colour = VERDICT_COLOURS[VERDICTS.index(verdict)]
                axes.axvspan(low, high, color=colour, alpha=0.25, linewidth=0)
        for mu in thresholds:
            axes.axvline(mu, color="k", linewidth=0.7, linestyle="--")
    upper.set_ylabel("frequency [kHz]")
    upper.set_ylim(bottom=0.0)
    lower.set_ylabel("real part [1/s]")
    lower.set_xlabel(r"$\mu$")
    lower.set_xlim(mus[0], mus[-1])
    seen = [v for v in VERDICTS if v in verdicts]
    patches = [
        Patch(facecolor=VERDICT_COLOURS[VERDICTS.index(v)], alpha=0.25, ec="0.6", lw=0.4, label=v)
        for v in seen
    ]
    figure.legend(handles=patches, loc="outside upper center", ncols=len(patches))
    return figure


def draw_eigenvalues(
    path: Path, name: str, values: np.ndarray, beside: np.ndarray | None = None
) -> None:
    """Save the eigenvalues as PDF, SVG or PNG."""
    listed = ", ".join(f"{v.real:.4g} {v.imag:+.4g}i" for v in values)
    text = f"Eigenvalues of {name} in the complex plane, in rad/s: {listed}."
    with style():
        figure = eigenvalue_figure(values, beside)
    save(Drawing(figure, text, f"Eigenvalues of {name}", origin(_MODULE)), path, text=False)


def draw_sweep(
    path: Path,
    name: str,
    mus: np.ndarray,
    values: np.ndarray,
    verdicts: Sequence[str | None],
    thresholds: Sequence[float] = (),
) -> None:
    """Save a sweep as PDF, SVG or PNG."""
    told = ", ".join(dict.fromkeys(v or "no equilibrium" for v in verdicts))
    text = (
        f"Frequencies and real parts of the eigenvalues of {name} over mu from "
        f"{mus[0]:g} to {mus[-1]:g}; verdicts in this order: {told}."
    )
    if thresholds:
        text += f" Changes at {', '.join(f'{mu:.6g}' for mu in thresholds)}."
    with style():
        figure = sweep_figure(mus, values, verdicts, thresholds)
    save(Drawing(figure, text, f"Sweep of {name}", origin(_MODULE)), path, text=False)
