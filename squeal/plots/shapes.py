"""Mode shapes of systems from matrices on the places of their nodes, still and moving."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from squeal.io.system import Coordinates
from squeal.io.writing import write_whole
from squeal.plots.style import DOUBLE, SINGLE, Drawing, literal, origin, style

LARGEST = 0.08  # of the body's size: the largest displacement as drawn
FRAMES = 24  # of a period


def displacements(where: Coordinates, shape: NDArray) -> NDArray[np.complex128]:
    """Displacements (nodes, 3) of the nodes that move, turned so that the real parts are largest,
    and scaled to a largest length of one."""
    u = where.displacements(np.asarray(shape, dtype=complex))
    u = u * np.exp(-0.5j * np.angle(np.sum(u * u)))
    largest = float(np.sqrt(np.max(np.sum(np.abs(u) ** 2, axis=1))))
    return np.asarray(u / largest if largest > 0 else u)


class _Box:
    def __init__(self, where: Coordinates, u: NDArray[np.complex128]) -> None:
        kept = slice(None, None, 1 + len(where.places) // 15_000)  # points that show a shape
        self.rest, self.u = where.places[kept], u[kept]
        sides = np.ptp(where.places, axis=0)
        self.size = float(sides.max()) or 1.0
        self.middle = (where.places.max(axis=0) + where.places.min(axis=0)) / 2
        self.sides = np.maximum(sides, 0.08 * self.size) + 2 * LARGEST * self.size
        self.amplitude = np.sqrt(np.sum(np.abs(self.u) ** 2, axis=1))
        self.point = float(np.clip(6e3 / len(self.rest), 0.3, 12.0))

    def axes(self, figure: Figure, place: tuple[float, float, float, float]) -> Any:
        axes: Any = figure.add_axes(place, projection="3d")
        axes.set_box_aspect(tuple(self.sides), zoom=1.5)
        axes.set_axis_off()
        return axes

    def draw(self, axes: Any, turn: complex) -> Any:
        moved = self.rest + LARGEST * self.size * (self.u * turn).real
        drawn = axes.scatter(
            *moved.T, c=self.amplitude, s=self.point, vmin=0.0, vmax=1.0, lw=0, clip_on=False
        )
        for name, middle, side in zip("xyz", self.middle, self.sides, strict=True):
            getattr(axes, f"set_{name}lim")(middle - side / 2, middle + side / 2)
        return drawn


def shape_figure(words: str, where: Coordinates, shape: NDArray) -> Figure:
    """The nodes at the phase of largest motion and a quarter of a period later."""
    with style():
        figure = Figure(figsize=(DOUBLE, 2.5))
        figure.set_layout_engine("none")
        box = _Box(where, displacements(where, shape))
        panels = ((0.0, 1.0, "(a) largest motion"), (0.45, 1j, "(b) a quarter of a period later"))
        for left, turn, title in panels:
            axes = box.axes(figure, (left, 0.0, 0.45, 0.85))
            drawn = box.draw(axes, turn)
            figure.text(left + 0.225, 0.82, title, ha="center")
        bar = figure.colorbar(drawn, cax=figure.add_axes((0.92, 0.15, 0.012, 0.6)))
        bar.set_label("amplitude [largest]")
        figure.text(0.5, 0.93, literal(words), ha="center")
    return figure


def shape_drawing(name: str, words: str, where: Coordinates, shape: NDArray) -> Drawing:
    """The shape of a mode, ready to be saved; `words` tell frequency and growth."""
    figure = shape_figure(words, where, shape)
    text = f"Shape of a mode of {name}: {words}."
    return Drawing(figure, text, f"Mode of {name}", origin(__name__))


def animate_shape(path: Path, words: str, where: Coordinates, shape: NDArray) -> None:
    """Save one period of a mode as a GIF that repeats; growth is left out."""
    from PIL import Image

    with style():
        figure = Figure(figsize=(SINGLE, 2.2), dpi=150)
        figure.set_layout_engine("none")
        canvas: Any = FigureCanvasAgg(figure)
        box = _Box(where, displacements(where, shape))
        axes = box.axes(figure, (0.0, 0.0, 1.0, 0.9))
        figure.text(0.5, 0.92, literal(words), ha="center")
        frames = []
        for k in range(FRAMES):
            drawn = box.draw(axes, np.exp(2j * np.pi * k / FRAMES))
            canvas.draw()
            frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("P"))
            drawn.remove()
    first, *rest = frames
    options = {"save_all": True, "duration": round(1200 / FRAMES), "loop": 0}
    write_whole(path, lambda to: first.save(to, "GIF", append_images=rest, **options), binary=True)
