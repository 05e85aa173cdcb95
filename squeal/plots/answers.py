"""The figure of each answer: which one is drawn, and how it is saved."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from squeal.analysis import of_systems
from squeal.analysis.answers import Eigenvalues, Map, Sweep, Thresholds
from squeal.analysis.modes import shapes_of_pad, sweep_modes
from squeal.analysis.variations import Scatter
from squeal.errors import InputError
from squeal.io.answer import Answer, number
from squeal.io.provenance import provenance
from squeal.io.scene import Scene
from squeal.plots import coupling, maps, modes, motion, scatter, shapes
from squeal.plots.runs import Event, Run, Summary
from squeal.plots.style import Drawing, save
from squeal.simulation.run import Simulation


def draw(answer: Answer, path: Path | None = None, name: str = "", **more: Any) -> Figure:
    """The figure of an answer, also saved if a path is given; `name` says what of.

    Raises InputError for an answer that has none.
    """
    for kind, drawn in DRAWN.items():
        if isinstance(answer, kind):
            found = drawn(answer, name or getattr(answer, "name", "") or "the scene", path, **more)
            if isinstance(found, Drawing):
                if path is not None:
                    save(found, path, text=False)
                return found.figure
            return found
    raise InputError(f"plot: {type(answer).__name__} has no figure")


def _eigenvalues(
    found: Eigenvalues, name: str, path: Path | None, shape: int | None = None
) -> Drawing | Figure:
    subject, analysis = found.source
    if shape is not None:
        root, where = found.eigenvalues[shape - 1], subject.coordinates
        words = f"mode {shape}, {number(root.frequency_hz)} Hz, growth rate "
        words += f"{number(root.growth_rate)} 1/s"
        if path is not None and path.suffix == ".gif":
            shapes.animate_shape(path, words, where, root.right)
            return Figure()
        return shapes.shape_drawing(name, words, where, root.right)
    if isinstance(subject, Scene):
        pad, own = subject.pad, shapes_of_pad(analysis, subject.pad.w)
        origin = found.details.get("origin", {}).get("eigenvalues", [])
        beside = np.array([complex(row["real"], row["imag"]) for row in origin])
        figure = modes.pad_figure(pad, analysis.q, own, found.values, beside if origin else None)
        return modes.modes_drawing(name, figure, found.values)
    return modes.roots_drawing(name, found.values)


def _sweep(found: Sweep, name: str, path: Path | None) -> Drawing:
    if isinstance(found.source, Scene):
        low, high = found.steps[0].value, found.steps[-1].value
        return coupling.coupling_drawing(
            name, sweep_modes(found.source, low, high), found.source.pad.mu
        )
    return coupling.sweep_drawing(name, found.parameter, found.steps)


def _thresholds(
    found: Thresholds, name: str, path: Path | None, high: float | None = None
) -> Drawing:
    scene = found.source[0]
    if isinstance(scene, Scene):
        way = sweep_modes(scene, found.low, high or found.high)
        return coupling.coupling_drawing(name, way, scene.pad.mu)
    return _sweep(of_systems.along(found), name, path)


def _map(found: Map, name: str, path: Path | None) -> Drawing:
    if not isinstance(found.source[0], Scene):
        first, second = found.axes
        names, values = (first.name, second.name), (first.values, second.values)
        return maps.chart_drawing(name, names, values, found.codes)
    scene, stability, shown, curves = found.source
    own = tuple(getattr(scene.pad, axis.name) for axis in stability.axes)
    if shown is None:
        return maps.stability_drawing(maps.traced(scene, stability), own, curves or ())
    level = scene.pad.mu if shown.quantity == "critical-friction" else None
    return maps.contours_drawing(shown, own, level, curves or ())


def _scatter(found: Scatter, name: str, path: Path | None) -> Drawing:
    return scatter.scatter_drawing(name, found, found.name)


def _motion(
    found: Simulation, name: str, path: Path | None, scene: Scene | None = None, inputs: Any = ()
) -> Drawing:
    if scene is None or found.history is None or found.events is None or found.response is None:
        raise InputError(
            "plot: a motion needs its scene, plot(scene=scene), and all outputs of the scene"
        )
    assert found.shares is not None
    assert found.extrema is not None
    summary = Summary(
        name=name,
        model=found.model,
        stop=found.final[0],
        events=tuple(Event(e.t, e.source, e.target) for e in found.events),
        shares=found.shares,
        extrema=found.extrema,
        method=found.method,
        tolerance=found.tolerance,
        steps=found.steps,
        provenance=provenance(inputs, "squeal.cli.simulate"),
    )
    run = Run(summary, dict(found.history))
    return motion.drawing(run, scene.pad_model, found.response.frequency_hz)


DRAWN: dict[type[Answer], Callable[..., Drawing | Figure]] = {
    Eigenvalues: _eigenvalues,
    Sweep: _sweep,
    Thresholds: _thresholds,
    Map: _map,
    Scatter: _scatter,
    Simulation: _motion,
}
