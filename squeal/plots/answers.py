"""The figure of each answer: which one is drawn, and how it is saved."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from squeal.analysis import of_systems
from squeal.analysis.answers import Eigenvalues, Map, Sweep, Thresholds
from squeal.analysis.cycles import Cycles
from squeal.analysis.maps import traced_map
from squeal.analysis.modes import shapes_of_pad, sweep_modes
from squeal.analysis.variations import Scatter
from squeal.errors import InputError
from squeal.io.answer import Answer, number
from squeal.io.provenance import provenance
from squeal.io.scene import Scene
from squeal.plots import coupling, cycles, maps, modes, motion, scatter, shapes
from squeal.plots.style import Drawing, save
from squeal.simulation.run import Simulation


def draw(answer: Answer, path: Path | None = None, name: str = "", **more: Any) -> Figure:
    """The figure of an answer, also saved if a path is given; `name` says what of.

    Raises InputError for an answer that has none.
    """
    for kind, drawn in DRAWN.items():
        if isinstance(answer, kind):
            name = name or getattr(answer, "name", "") or "the scene"
            if path is not None and path.suffix == ".gif":
                shapes.animate_shape(path, *_shape(answer, **more))
                return Figure()
            found: Drawing = drawn(answer, name, **more)
            if path is not None:
                save(found, path, text=False)
            return found.figure
    raise InputError(f"plot: {type(answer).__name__} has no figure")


def _shape(found: Any, shape: int = 1) -> tuple[str, Any, Any]:
    """Words, places of the nodes and shape of one mode of a system."""
    root, where = found.eigenvalues[shape - 1], found.source[0].coordinates
    words = f"mode {shape}, {number(root.frequency_hz)} Hz, growth rate "
    return words + f"{number(root.growth_rate)} 1/s", where, root.right


def _eigenvalues(found: Eigenvalues, name: str, shape: int | None = None) -> Drawing:
    subject, analysis = found.source
    if shape is not None:
        return shapes.shape_drawing(name, *_shape(found, shape))
    if not isinstance(subject, Scene):
        return modes.modes_drawing(name, found.values)
    own = shapes_of_pad(analysis, subject.pad.w)
    origin = found.details.get("origin", {}).get("eigenvalues", [])
    beside = np.array([complex(row["real"], row["imag"]) for row in origin]) if origin else None
    figure = modes.pad_figure(subject.pad, analysis.q, own, found.values, beside)
    return modes.modes_drawing(name, found.values, figure)


def _way(scene: Scene, name: str, low: float, high: float) -> Drawing:
    return coupling.coupling_drawing(name, sweep_modes(scene, low, high), scene.pad.mu)


def _sweep(found: Sweep, name: str) -> Drawing:
    if isinstance(found.source, Scene):
        return _way(found.source, name, found.steps[0].value, found.steps[-1].value)
    return coupling.sweep_drawing(name, found.parameter, found.steps)


def _thresholds(found: Thresholds, name: str, high: float | None = None) -> Drawing:
    scene = found.source[0]
    if isinstance(scene, Scene):
        return _way(scene, name, found.low, high or found.high)
    return _sweep(of_systems.along(found), name)


def _map(found: Map, name: str) -> Drawing:
    if not isinstance(found.source[0], Scene):
        return maps.map_drawing(name, found, maps.map_figure(found))
    scene, stability, shown, curves = found.source
    own = tuple(getattr(scene.pad, axis.name) for axis in found.axes)
    if shown is not None:
        level = scene.pad.mu if shown.quantity == "critical-friction" else None
        figure = maps.contour_figure(found, own, level, curves or ())
    else:
        areas = stability.outline or traced_map(scene, found.axes, found.codes)
        figure = maps.map_figure(found, own, areas, curves or ())
    return maps.map_drawing(name, found, figure, shown is not None)


def _scatter(found: Scatter, name: str) -> Drawing:
    return scatter.scatter_drawing(name, found, found.name)


def _motion(found: Simulation, name: str, scene: Scene | None = None, inputs: Any = ()) -> Drawing:
    if scene is None or found.history is None or found.events is None or found.response is None:
        raise InputError(
            "plot: a motion needs its scene, plot(scene=scene), and all outputs of the scene"
        )
    summary = motion.Summary(
        name=name,
        model=found.model,
        stop=found.final[0],
        events=found.events,
        shares=found.shares or {},
        extrema=found.extrema or {},
        provenance=provenance(inputs, "squeal.cli.simulate"),
    )
    run = motion.Run(summary, dict(found.history))
    return motion.motion_drawing(run, scene.pad_model, found.response.frequency_hz)


DRAWN: dict[type[Answer], Callable[..., Drawing]] = {
    Eigenvalues: _eigenvalues,
    Sweep: _sweep,
    Thresholds: _thresholds,
    Map: _map,
    Scatter: _scatter,
    Simulation: _motion,
    Cycles: cycles.cycles_drawing,
}
