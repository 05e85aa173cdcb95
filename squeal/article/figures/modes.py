"""Mode shapes of model B2 as motions of the pad, from the results of `studies.stability`."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.article.cases import title
from squeal.article.records import first_reason
from squeal.article.studies.stability import Modes, ModeShape, SceneStability, Stability
from squeal.plots.modes import draw_pad, draw_surface, exaggeration, legend_of_phases, outlines
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

MODEL = "B2"
CAPTION = r"""Mode shapes about the sliding equilibria of model B2: the pad at rest (grey) and at
two phases of each mode, exaggerated."""


def shape_of(mode: ModeShape) -> np.ndarray:
    """The complex shape (x, y, w theta) of a mode."""
    return np.array(mode.real) + 1j * np.array(mode.imag)


def pads_of(scene: SceneStability, equilibrium: Modes, mode: ModeShape) -> list[np.ndarray]:
    """The pad at rest and at the mode's two phases, in half lengths; its middle rests at x = 0."""
    _, y, theta = equilibrium.pose
    rest = np.array([0.0, y / scene.w, theta])
    return outlines(scene.h / scene.w, rest, shape_of(mode))


def _panel(axes: Axes, lines: list[np.ndarray], mode: ModeShape) -> None:
    """Draw the outlines of the pad in a mode, with its frequency and its growth rate."""
    draw_pad(axes, lines)
    growth = mode.growth_rate / 1e3
    rate = f", ${growth:+.2g}$/ms" if growth else ""
    axes.set_title(f"{mode.frequency_hz / 1e3:#.3g} kHz{rate}", pad=2.0)


def scenes_of(record: Stability) -> list[SceneStability]:
    """The scenes of the model shown."""
    return [scene for scene in record.scenes if scene.model == MODEL]


def modes_figure(record: Stability) -> Figure:
    """One column per case, three modes below each other by rising frequency.

    Some case must have a sliding equilibrium.
    """
    scenes = scenes_of(record)
    shown = []  # of each panel its column and row, the mode, and the outlines of the pad
    all_outlines = []
    shapes = []
    for column, scene in enumerate(scenes):
        if isinstance(scene.equilibrium, Modes):
            for row, mode in enumerate(scene.equilibrium.modes):
                lines = pads_of(scene, scene.equilibrium, mode)
                shown.append((column, row, mode, lines))
                all_outlines += lines
                shapes.append(shape_of(mode))
    corners = np.concatenate(all_outlines)
    surface = [-s.h / s.w for s in scenes]  # its height below the centre, in half lengths
    # limits of the axes with margins; some of the surface is shown
    left, lowest = corners.min(axis=0) - 0.08
    right, top = corners.max(axis=0) + 0.08
    bottom = min(lowest, min(surface) - 0.12)
    width = DOUBLE / len(scenes)
    height = width * (top - bottom) / (right - left)
    with style():
        figure = Figure(figsize=(DOUBLE, 0.55 + 3 * (height + 0.2)))
        grid = figure.subplots(3, len(scenes), squeeze=False, sharex=True, sharey=True)
        for axes in grid.flat:
            axes.axis("off")
        for column, row, mode, lines in shown:
            axes = grid[row, column]
            axes.axis("on")
            draw_surface(axes, surface[column], left, right, bottom)
            _panel(axes, lines, mode)
        for scene, axes in zip(scenes, grid[0], strict=True):
            axes.set_title(f"{title(scene.name)}\n{axes.get_title()}", pad=2.0)
        grid[0, 0].set_xlim(left, right)
        grid[0, 0].set_ylim(bottom, top)
        handles, names = legend_of_phases(shapes)
        factors = dict.fromkeys(exaggeration(scene.w) for scene in scenes)
        names[1] += f" ({'; '.join(factors)})"  # of "displaced"
        figure.legend(handles, names, loc="outside upper center", ncols=3)
    return figure


def alternative_text(record: Stability) -> str:
    """What the figure shows: per case the frequency and the leading motion of each mode."""
    texts = []
    for scene in scenes_of(record):
        parts = []
        equilibrium = scene.equilibrium
        modes = equilibrium.modes if isinstance(equilibrium, Modes) else ()
        for mode in modes:
            size = np.hypot(mode.real, mode.imag)  # of x, y and w theta
            motion = ("sliding", "lifting", "pitching")[int(np.argmax(size))]
            parts.append(f"{mode.frequency_hz / 1e3:#.3g} kHz mostly {motion}")
        texts.append(f"{title(scene.name)}: {', '.join(parts) or 'no sliding equilibrium'}")
    return (
        "The pad over the sliding surface at its equilibrium and displaced at two phases, "
        f"exaggerated, for the three modes of each case of model {MODEL}. {'; '.join(texts)}."
    )


def draw(record: Stability) -> Drawing:
    """The figure of `squeal.article.studies.stability` results, ready to be saved."""
    name = f"Mode shapes of model {MODEL}"
    equilibria = [scene.equilibrium for scene in scenes_of(record)]
    if not any(isinstance(equilibrium, Modes) for equilibrium in equilibria):
        return blank(name, first_reason(equilibria), __name__, record.provenance)
    made = origin(__name__, record.provenance)
    return Drawing(modes_figure(record), alternative_text(record), name, made)
