"""Root loci over friction as a loop gain, a panel per case, from the study `eigenvalues`."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.article.cases import short_title
from squeal.article.records import Missing, first_reason
from squeal.article.studies.eigenvalues import Eigenvalues, Locus, Loop
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

KHZ = 2e3 * np.pi  # in rad/s
FROZEN: dict[str, Any] = {"color": "k", "lw": 0.9}
FOLLOWED: dict[str, Any] = {"color": "#3498DB", "lw": 2.2, "alpha": 0.75, "zorder": 1}
MARKS: dict[str, dict[str, Any]] = {
    "no friction": {"marker": "x", "mec": "k", "ms": 4.5, "mew": 0.9},
    "reference friction": {"marker": "o", "mfc": "#C8380E", "mec": "k", "ms": 4.5, "mew": 0.6},
    "critical gain": {"marker": "D", "mfc": "w", "mec": "k", "ms": 4.5, "mew": 0.9},
}
LIMITS = {"b1": (-0.45, 0.05), "b2": (-2.0, 2.0)}  # of the growth rate, 1/ms
CAPTION = r"""Complex eigenvalue analysis by python-control: poles of all cases over friction. The
friction coefficient rises from 0 to \val[2]{eigenvalues.greatest}, at a modal damping of
\val[p1]{eigenvalues.ratio}. Black: root locus with friction as the loop gain, about the equilibrium
frozen at the reference friction. Blue: about the equilibrium that follows friction. Right of the
grey line a mode grows. Diamond and title: critical gain of the frozen equilibrium. Growth rate and
frequency are the real and the imaginary part; the two rows have axes of their own."""


def _curves(axes: Axes, locus: Locus, gid: str, look: dict[str, Any]) -> None:
    for real, imag in zip(locus.real, locus.imag, strict=True):
        axes.plot(np.array(real) / 1e3, np.abs(imag) / KHZ, gid=gid, **look)


def _at(locus: Locus, mu: float) -> np.ndarray:
    """The poles (6,) of a locus at a friction, by linear interpolation."""
    real = [np.interp(mu, locus.mu, row) for row in locus.real]
    imag = [np.interp(mu, locus.mu, row) for row in locus.imag]
    return np.array(real) + 1j * np.abs(imag)


def _mark(axes: Axes, poles: np.ndarray, name: str) -> None:
    axes.plot(poles.real / 1e3, poles.imag / KHZ, ls="none", gid=name, zorder=4, **MARKS[name])


def _panel(axes: Axes, loop: Loop) -> None:
    """Draw both loci of a loop, and marks at three frictions."""
    axes.axvline(0.0, color="0.6", lw=0.6, zorder=0)
    _curves(axes, loop.path, "followed", FOLLOWED)
    _curves(axes, loop.locus, "frozen", FROZEN)
    _mark(axes, _at(loop.locus, 0.0), "no friction")
    poles = np.array([complex(pole.real, pole.imag) for pole in loop.poles])
    _mark(axes, poles, "reference friction")
    if loop.frequency_hz is not None:
        _mark(axes, np.array([2j * np.pi * loop.frequency_hz]), "critical gain")


def _critical(loop: Loop) -> str:
    return "no critical gain" if loop.frozen is None else f"critical {loop.frozen:.3g}"


def control_figure(loops: dict[str, Loop]) -> Figure:
    """Root loci of all cases, B1 above B2, a column per case."""
    with style():
        figure = Figure(figsize=(DOUBLE, 3.9))
        grid = figure.subplots(2, 4, sharey=True)
        for axes, (name, loop) in zip(grid.flat, loops.items(), strict=False):
            _panel(axes, loop)
            axes.set_title(f"{short_title(name)}: {_critical(loop)}", pad=3.0)
            axes.set_xlim(*LIMITS[name[:2]])
            axes.set_ylim(0.0, 14.0)
        figure.supxlabel("growth rate [1/ms]", fontsize=8)
        figure.supylabel("frequency [kHz]", fontsize=8)
        handles = [
            Line2D([], [], label="frozen", **FROZEN),
            Line2D([], [], label="following", **FOLLOWED),
            *(Line2D([], [], ls="none", label=name, **look) for name, look in MARKS.items()),
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))
    return figure


def draw(record: Eigenvalues) -> Drawing:
    """The figure, ready to be saved."""
    title = "Root loci over friction as a loop gain"
    loops = {name: loop for name, loop in record.loops.items() if not isinstance(loop, Missing)}
    if not loops:
        return blank(title, first_reason(record.loops.values()), __name__, record.provenance)
    parts = []
    for name, loop in loops.items():
        frozen = "none" if loop.frozen is None else f"{loop.frozen:.3g}"
        followed = "none" if loop.followed is None else f"{loop.followed:.3g}"
        parts.append(f"{short_title(name)} frozen {frozen}, following {followed}")
    text = (
        "Poles of the eight cases in the complex plane, growth rate by frequency, as friction "
        f"rises from 0 to {record.greatest:g}. Critical friction up to there: {'; '.join(parts)}."
    )
    return Drawing(control_figure(loops), text, title, origin(__name__, record.provenance))
