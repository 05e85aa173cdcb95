"""The figure of each answer: which one is drawn, and how it is saved."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from inspect import signature
from operator import attrgetter
from pathlib import Path
from typing import Any

from matplotlib import pyplot
from matplotlib.axes import Axes

from squeal.errors import InputError
from squeal.io.provenance import InputFile, provenance
from squeal.io.scene import Scene
from squeal.io.writing import Answer, copied_attributes, number
from squeal.plots import campbell, coupling, cycles, maps, modes, motion
from squeal.plots.conditions import conditions_drawing
from squeal.plots.damping import damping_drawing
from squeal.plots.energy import energy_sweep_drawing
from squeal.plots.panels import draw_panel, panel_drawing
from squeal.plots.scatter import scatter_drawing
from squeal.plots.style import Drawing, save
from squeal.queries.critical_speeds import CriticalSpeeds
from squeal.queries.cycles import Cycles
from squeal.queries.energy_sweep import EnergySweep
from squeal.queries.sweep import eigenvalue_paths
from squeal.queries.thresholds import critical_friction
from squeal.results.conditions import Conditions
from squeal.results.eigenvalues import Eigenvalues, mode_shape, mode_shapes
from squeal.results.map import Map
from squeal.results.scatter import Scatter
from squeal.results.sources import PadSource, SystemSource, refuse_other_subject
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds
from squeal.simulation.run import Simulation


def draw(answer: Answer, path: Path, name: str = "", **options: Any) -> None:
    """Save the figure of an answer; for name and options see `drawing`."""
    save(drawing(answer, name, **options), path, text=False)


def drawing(answer: Answer, name: str = "", **options: Any) -> Drawing:
    """The whole figure of an answer.

    name: the subject, such as the file that was read; options: those of the function in `DRAWN`.
    """
    shown_name = name or getattr(answer, "name", "") or "the scene"
    return _function_of(answer)(answer, shown_name, **options)


def _function_of(answer: Answer) -> Callable[..., Drawing]:
    """The function that draws the whole figure of an answer: its panel, if `DRAWN` has none."""
    return DRAWN.get(type(answer), panel_drawing)


def plot(answer: Answer, axes: Axes | None = None, **look: Any) -> Axes:
    """Plot an answer; returns the Axes, of a whole figure its first one.

    Without `axes`, and if all options in `look` are those of the figure's function in `DRAWN`,
    pyplot gets the whole figure. Otherwise the panel is drawn into `axes`, or into new ones, and
    `look` goes to Matplotlib's artists.
    """
    options = signature(_function_of(answer)).parameters
    if axes is None and look.keys() <= options.keys():
        figure = drawing(answer, **look).figure
        # pyplot shows the figure that it gets from FigureClass: here one that is drawn already
        pyplot.figure(FigureClass=lambda **_: figure)  # type: ignore[arg-type]
        return figure.axes[0]
    if axes is None:
        _, axes = pyplot.subplots()
    draw_panel(answer, axes, **look)
    return axes


def _eigenvalues(answer: Eigenvalues, name: str, shape: int | None = None) -> Drawing:
    """Eigenvalues in the complex plane, of a pad with mode shapes; or the `shape` of one mode."""
    source = answer.source
    if shape is not None:
        return _mode_shape(answer, name, shape)
    if not isinstance(source, PadSource):
        return modes.modes_drawing(name, answer.eigenvalues)
    pad = source.scene.pad
    assert source.analysis is not None
    # largest where x, y or, of the angle, the edge of the pad moves most
    shapes = mode_shapes(source.analysis.spectrum, levers=(1.0, 1.0, pad.w))
    figure = modes.pad_figure(pad, source.analysis.q, shapes, answer.eigenvalues)
    return modes.modes_drawing(name, answer.eigenvalues, figure)


def _mode_shape(answer: Eigenvalues, name: str, shape: int) -> Drawing:
    """The shape of the mode with the number `shape`: of a pad, or on the nodes of a system.

    Raises InputError for a system without coordinates, and for a number that no mode has.
    """
    source = answer.source
    coordinates = None  # of a pad
    if isinstance(source, SystemSource):
        coordinates = source.file.coordinates
        if coordinates is None:
            raise InputError(
                "shape: needs a system with `coordinates: {file: nodes.csv}` in its file"
            )
    numbers = answer.modes.tolist()
    if shape not in numbers:
        allowed = "left out without a root"
        if numbers:
            allowed = f"a whole number from 1 to {max(numbers)}"
        raise InputError(f"shape: {shape} is not allowed; it must be {allowed}")
    root = answer.eigenvalues[numbers.index(shape)]
    if coordinates is None:
        assert isinstance(source, PadSource)
        assert source.analysis is not None
        pad = source.scene.pad
        mode = mode_shape(shape, root, levers=(1.0, 1.0, pad.w))
        figure = modes.pad_figure(pad, source.analysis.q, [mode])
        return modes.modes_drawing(name, [root], figure)
    frequency = number(root.frequency_hz)
    heading = f"mode {shape}, {frequency} Hz, growth rate {number(root.growth_rate)} 1/s"
    return modes.shape_drawing(name, heading, coordinates, root.right)


def _thresholds_of_pad(
    scene: Scene, thresholds: Thresholds, name: str, low: float, high: float
) -> Drawing:
    """Modes of a pad over friction from low to high, its thresholds, and its own friction."""
    paths = eigenvalue_paths(thresholds, low, high)
    return coupling.sweep_drawing(name, paths, thresholds, (low, high), scene.pad.mu)


def _sweep(
    answer: Sweep,
    name: str,
    damping: bool = False,
    thresholds: Thresholds | None = None,
    width: str = "page",
) -> Drawing:
    """Modes over the parameter, or with `damping` their damping ratios over frequency.

    thresholds, width: of the chart of damping alone, see `damping_drawing`. Raises InputError for
    thresholds of another subject, and for either option without `damping`.
    """
    steps = sorted(answer.steps, key=attrgetter("value"))  # the sweep may have any order
    rising = replace(answer, steps=tuple(steps))
    if damping:
        if thresholds is not None and answer.source is not None:
            refuse_other_subject("thresholds", thresholds.source, answer.source.subject)
        return damping_drawing(name, rising, thresholds, width)
    if thresholds is not None:
        raise InputError("thresholds: are of the figure with damping=True alone")
    if width != "page":
        raise InputError("width: is of the figure with damping=True alone")
    low = steps[0].value
    high = steps[-1].value
    # one value is no path, and no path begins where there is no equilibrium
    has_path = low < high and steps[0].roots is not None
    if not isinstance(answer.source, PadSource) or not has_path:
        return coupling.sweep_drawing(name, rising)
    # of a pad the thresholds are computed, too, and the paths anew: both are fast
    scene = answer.source.scene
    return _thresholds_of_pad(scene, critical_friction(scene, high), name, low, high)


def _thresholds(answer: Thresholds, name: str, high: float | None = None) -> Drawing:
    """Modes and thresholds over the range searched; of a pad up to `high`, if that is given."""
    if isinstance(answer.source, PadSource):
        scene = answer.source.scene
        return _thresholds_of_pad(scene, answer, name, answer.low, high or answer.high)
    return coupling.sweep_drawing(name, eigenvalue_paths(answer, answer.low, answer.high), answer)


def _map(answer: Map, name: str) -> Drawing:
    """The map of a system, or that of a pad with the pad marked."""
    if not isinstance(answer.source, PadSource):
        return maps.map_drawing(name, answer)
    scene = answer.source.scene
    first, second = answer.axes
    own = (getattr(scene.pad, first.name), getattr(scene.pad, second.name))
    level = None  # of the quantity: its curve is drawn
    if answer.quantity is not None and answer.quantity[0] == "critical-friction":
        level = scene.pad.mu
    return maps.map_drawing(name, answer, own, level)


def _motion(
    answer: Simulation,
    name: str,
    scene: Scene | None = None,
    inputs: Iterable[Path | InputFile] = (),
) -> Drawing:
    """The motion of a scene with its spectrum; without the scene the panel of the answer.

    inputs: the files behind it, for the metadata. Raises InputError for an answer that lacks one of
    the outputs of a scene.
    """
    if scene is None:
        return panel_drawing(answer, name)
    outputs = copied_attributes(answer, "events shares extrema history response")
    if None in outputs.values():
        raise InputError("plot: the figure of a motion needs all outputs of the scene")
    response = outputs.pop("response")
    run = motion.Run(
        name=name,
        model=answer.model,
        stop=answer.final[0],  # the time of the final state
        provenance=provenance(inputs, "squeal.cli.simulate"),
        **outputs,
    )
    return motion.motion_drawing(run, scene.pad_model, response.frequency_hz or 0.0)


DRAWN: dict[type[Answer], Callable[..., Drawing]] = {
    Eigenvalues: _eigenvalues,
    Sweep: _sweep,
    Thresholds: _thresholds,
    Map: _map,
    Conditions: conditions_drawing,
    EnergySweep: energy_sweep_drawing,
    CriticalSpeeds: campbell.campbell_drawing,
    Scatter: scatter_drawing,
    Simulation: _motion,
    Cycles: cycles.cycles_drawing,
}
