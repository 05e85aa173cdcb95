"""A pad over the sliding surface: at rest, and moved by a mode shape at two phases."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

LARGEST = 0.35  # drawn size of the largest of x, y, w theta, in half lengths
SEEN = 1e-6  # m: a motion of this size is what the exaggeration is told for
REAL = 1e-6  # a shape whose imaginary parts are smaller is real: rounding leaves less
LOOKS: dict[str, dict[str, Any]] = {
    "rest": {"color": "0.6"},
    "first phase": {"color": "#C8380E"},
    "second phase": {"color": "#3498DB", "linestyle": (0, (3, 1.5))},
}


def exaggeration(w: float) -> str:
    """How much larger than a motion of a micrometre shapes of a pad of half length w (m) are drawn,
    in words."""
    factor = LARGEST * w / SEEN
    digits = 10 ** int(np.floor(np.log10(factor)) - 1)
    return rf"motion of 1 $\mu$m enlarged {round(factor / digits) * digits} times"


def is_real(shape: np.ndarray) -> bool:
    """True for a shape whose parts all move in phase."""
    return bool(np.abs(shape.imag).max() < REAL)


def phases(shape: np.ndarray) -> tuple[float, float]:
    """Two phases that show a mode: opposite ones, or a quarter turn apart for a complex shape."""
    return (0.0, np.pi) if is_real(shape) else (0.0, np.pi / 2)


def outline(w: float, h: float, pose: np.ndarray) -> np.ndarray:
    """Corners (5, 2) of a pad at pose (x, y, theta), the first corner repeated."""
    corners = np.array([[-w, -h], [w, -h], [w, h], [-w, h], [-w, -h]])
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.asarray(corners @ np.array([[c, s], [-s, c]]) + pose[:2])


def outlines(slenderness: float, rest: np.ndarray, shape: np.ndarray) -> list[np.ndarray]:
    """The pad at rest and at the mode's two phases, in half lengths.

    slenderness: h/w; rest: (x/w, y/w, theta); shape: complex (x, y, w theta), its largest part 1.
    """
    # in half lengths w theta is the angle itself
    moved = [rest + LARGEST * (shape * np.exp(1j * phase)).real for phase in phases(shape)]
    return [outline(1.0, slenderness, pose) for pose in (rest, *moved)]


def draw_pad(axes: Axes, lines: Sequence[np.ndarray]) -> None:
    """Pad at rest and at both phases."""
    for corners, (name, look) in zip(lines, LOOKS.items(), strict=True):
        axes.plot(*corners.T, linewidth=0.8, gid=name, **look)
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_visible(False)


def draw_surface(axes: Axes, height: float, left: float, right: float, bottom: float) -> None:
    """The sliding surface as a line, and what lies below it in grey."""
    ground = (left, bottom), right - left, height - bottom
    axes.add_patch(Rectangle(*ground, facecolor="0.92", linewidth=0.0, zorder=0))
    axes.axhline(height, color="k", linewidth=0.6, zorder=0)


def legend_of_phases(shapes: Sequence[np.ndarray]) -> tuple[list[Line2D], list[str]]:
    """Handles and names for a legend of pads at rest and at two phases."""
    complex_too = any(not is_real(shape) for shape in shapes)
    second = "a quarter period later" if complex_too else "half a period later"
    if complex_too and any(map(is_real, shapes)):
        second = "half a period later (complex shapes: a quarter)"
    handles = [Line2D([], [], **look) for look in LOOKS.values()]
    return handles, ["equilibrium", "displaced", second]
