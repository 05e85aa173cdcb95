"""The figure of each answer: which one is drawn, and how it is saved."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from matplotlib import pyplot
from matplotlib.axes import Axes

from squeal.analysis import of_systems, pads
from squeal.analysis.answers import Eigenvalues, Sweep, Thresholds
from squeal.analysis.critical_speeds import CriticalSpeeds
from squeal.analysis.cycles import Cycles
from squeal.analysis.maps import Map
from squeal.analysis.scatter import Scatter
from squeal.errors import InputError
from squeal.io.provenance import provenance
from squeal.io.scene import Scene
from squeal.io.writing import Answer, number
from squeal.plots import campbell, coupling, cycles, maps, modes, motion
from squeal.plots.damping import damping_drawing
from squeal.plots.panels import draw_panel, panel_drawing
from squeal.plots.scatter import scatter_drawing
from squeal.plots.style import Drawing, save
from squeal.simulation.run import Simulation


def draw(answer: Answer, path: Path, name: str = "", **more: Any) -> None:
    """Save the figure of an answer; `name` says what of."""
    save(drawing(answer, name, **more), path, text=False)


def drawing(answer: Answer, name: str = "", **more: Any) -> Drawing:
    """The whole figure of an answer, that of its panel where there is no other."""
    function = DRAWN.get(type(answer), panel_drawing)
    return function(answer, name or getattr(answer, "name", "") or "the scene", **more)


def plot(answer: Answer, axes: Axes | None = None, **look: Any) -> Axes:
    """The whole figure, shown by pyplot, or one panel in the Axes or in the look that are given."""
    if axes is None and look.keys() <= OF_WHOLE_FIGURES:
        figure = drawing(answer, **look).figure
        # it is made already: pyplot takes it as the current one
        pyplot.figure(FigureClass=lambda **_: figure)  # type: ignore[arg-type]
        return figure.axes[0]
    if axes is None:
        _, axes = pyplot.subplots()
    draw_panel(answer, axes, **look)
    return axes


def _eigenvalues(answer: Eigenvalues, name: str, shape: int | None = None) -> Drawing:
    subject, analysis = answer.source
    if shape is not None:  # one of these modes on the nodes of a system
        if getattr(subject, "coordinates", None) is None:
            words = "shape: needs a system with `coordinates: {file: nodes.csv}` in its file"
            raise InputError(words)
        numbers = answer.modes.tolist()
        count = max(numbers, default=0)
        if not 1 <= shape <= count:
            allowed = f"a whole number from 1 to {count}" if count else "left out without a root"
            raise InputError(f"shape: {shape} is not allowed; it must be {allowed}")
        root = answer.eigenvalues[numbers.index(shape)]
        growth = f"growth rate {number(root.growth_rate)} 1/s"
        words = f"mode {shape}, {number(root.frequency_hz)} Hz, {growth}"
        return modes.shape_drawing(name, words, subject.coordinates, root.right)
    if not isinstance(subject, Scene):
        return modes.modes_drawing(name, answer.eigenvalues)
    shapes = pads.mode_shapes(analysis.spectrum, (1.0, 1.0, subject.pad.w))
    figure = modes.pad_figure(subject.pad, analysis.q, shapes, answer.eigenvalues)
    return modes.modes_drawing(name, answer.eigenvalues, figure)


def _of_pad(found: Thresholds, name: str, low: float, high: float) -> Drawing:
    swept, own = pads.along(found, low, high), found.source[0].pad.mu
    return coupling.sweep_drawing(name, swept, found, (low, high), own)


def _sweep(answer: Sweep, name: str, damping: bool = False) -> Drawing:
    """Modes over the parameter, or with `damping` their damping ratios over frequency."""
    if damping:
        return damping_drawing(name, answer)
    if not isinstance(answer.source, Scene):
        return coupling.sweep_drawing(name, answer)
    low, high = answer.steps[0].value, answer.steps[-1].value
    return _of_pad(pads.critical_friction(answer.source, high), name, low, high)


def _thresholds(answer: Thresholds, name: str, high: float | None = None) -> Drawing:
    if isinstance(answer.source[0], Scene):
        return _of_pad(answer, name, answer.low, high or answer.high)
    return coupling.sweep_drawing(name, of_systems.along(answer), answer)


def _map(answer: Map, name: str) -> Drawing:
    if not isinstance(answer.source[0], Scene):
        return maps.map_drawing(name, answer)
    scene = answer.source[0]
    own = getattr(scene.pad, answer.axes[0].name), getattr(scene.pad, answer.axes[1].name)
    critical = answer.quantity is not None and answer.quantity[0] == "critical-friction"
    return maps.map_drawing(name, answer, own, scene.pad.mu if critical else None)


def _motion(answer: Simulation, name: str, scene: Scene | None = None, inputs: Any = ()) -> Drawing:
    if scene is None:
        return panel_drawing(answer, name)
    history, response = answer.history, answer.response
    if history is None or answer.events is None or response is None:
        raise InputError("plot: the figure of a motion needs all outputs of the scene")
    made, shares = provenance(inputs, "squeal.cli.simulate"), answer.shares or {}
    seen = answer.events, shares, answer.extrema or {}, made, history
    run = motion.Run(name, answer.model, answer.final[0], *seen)
    return motion.motion_drawing(run, scene.pad_model, response.frequency_hz or 0.0)


OF_WHOLE_FIGURES = {"name", "shape", "damping", "high", "scene", "inputs"}
DRAWN: dict[type[Answer], Callable[..., Drawing]] = {
    Eigenvalues: _eigenvalues,
    Sweep: _sweep,
    Thresholds: _thresholds,
    Map: _map,
    CriticalSpeeds: campbell.campbell_drawing,
    Scatter: scatter_drawing,
    Simulation: _motion,
    Cycles: cycles.cycles_drawing,
}
