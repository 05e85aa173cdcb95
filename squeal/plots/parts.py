"""Drawing parts from arrays alone: areas of maps, curves of modes, pads over their surface."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path

from squeal.numerics.outline import Outline
from squeal.plots.style import Unit

VERDICT_COLOURS = ("#FFFFFF", "#CFE6F5", "#C8380E", "#6A1B7B", "#8C8C8C", "#E0B040")
"""Colours of `squeal.analysis.maps.NAMES`: stable, marginal, flutter, divergence, beyond a fold,
unknown."""

QUARTERS = [0.0, 0.25, 0.5, 0.75, 1.0]

OF_PI = ["$0$", r"$\pi/4$", r"$\pi/2$", r"$3\pi/4$", r"$\pi$"]


def angle_axes_of_pi(axes: Axes) -> None:
    """Axes of the two spring angles, drawn over pi."""
    axes.set_aspect("equal")
    axes.set_xticks(QUARTERS, OF_PI)
    axes.set_yticks(QUARTERS, OF_PI)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    axes.set_xlabel(r"spring angle $\alpha_1$ [rad]")
    axes.set_ylabel(r"spring angle $\alpha_2$ [rad]")


def mark(
    axes: Axes,
    marks: Mapping[str, tuple[float, float]],
    unit: float = 1.0,
    size: float = 7,
    **ring: Any,
) -> None:
    """Names in rings at their places, coordinates over `unit`; `ring`: how it looks otherwise."""
    box = {"boxstyle": "circle,pad=0.15", "fc": "w", "ec": "k", "lw": 0.6} | ring
    for name, (x, y) in marks.items():
        look: Any = {"ha": "center", "va": "center", "clip_on": False, "zorder": 5}
        axes.text(x / unit, y / unit, name, fontsize=size, bbox=box, **look)


def draw(axes: Axes, found: Outline, colours: Sequence[str], unit: Any = 1.0) -> None:
    """Areas in the colours of their codes and the curves between them, coordinates over `unit`.

    unit: a number, or one for each axis.
    """
    unit = np.asarray(unit)
    for k in np.unique(found.codes):
        own = found.polygons[found.codes == k] / unit
        closed = np.concatenate([own, own[:, :1]], axis=1)
        ways = [Path.MOVETO, *[Path.LINETO] * (own.shape[1] - 1), Path.CLOSEPOLY]
        # one path, which is drawn faster than many; a stroke of its own colour hides the hairlines
        # that viewers leave between polygons
        area = Path(closed.reshape(-1, 2), np.tile(ways, len(own)))
        patch = PathPatch(area, color=colours[k], lw=0.4, joinstyle="round", zorder=1)
        axes.add_artist(patch)  # add_patch would look for the limits of each line
        axes.update_datalim(area.vertices)
    lines = [curve / unit for curve, _ in found.curves]
    axes.add_collection(
        LineCollection(lines, colors="black", linewidths=0.6, capstyle="round", zorder=2)
    )


COLOURS = ("#3498DB", "#6A1B7B", "#C8380E")

LOOKS: list[dict[str, Any]] = [
    {"color": colour, "linestyle": line}
    for colour, line in zip(COLOURS, ("-", (0, (4, 1.5)), (0, (5, 1.5, 1, 1.5))), strict=True)
]

FINE = 3.0  # size of the dots of many modes in a root locus

WIDTH_OF_LABEL = 0.12  # of the axis of mu


def draw_modes(
    upper: Axes,
    lower: Axes,
    mu: np.ndarray,
    values: np.ndarray,
    looks: Sequence[dict[str, Any]],
    units: tuple[Unit, Unit],
) -> None:
    """Curves of each mode over mu (k,); of its conjugate the growth rate too.

    values (k, 2n) in rad/s, columns 2j and 2j + 1 a mode and its conjugate (a real pair has two
    growth rates); looks: one for each mode; units: of frequency and growth.
    """
    for k, look in enumerate(looks):
        own = look | {"gid": f"mode {k + 1}"}
        upper.plot(mu, np.abs(values[:, 2 * k].imag) / units[0].factor, **own)
        for j in (2 * k, 2 * k + 1):
            lower.plot(mu, values[:, j].real / units[1].factor, **own)


def mark_events(
    events: Sequence[tuple[float, str, str]],
    upper: Axes,
    lower: Axes,
    low: float = 0.0,
    reach: float = 1.0,
    height: float = 0.96,
) -> None:
    """Verticals (mu, label, line style), sorted, through both panels, which may be one.

    Labels stand in the lower one below a height (share of the axis), before their line unless
    another one is there; the axis of mu begins at `low` and shows as much as `reach`.
    """
    width, free = WIDTH_OF_LABEL * reach, low
    for mu, label, line in events:
        for axes in dict.fromkeys((upper, lower)):
            axes.axvline(mu, color="k", linewidth=0.7, linestyle=line, zorder=0, gid=label)
        before = mu - free > width
        x, side = (-2.0, "right") if before else (2.0, "left")
        place: Any = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
        look: Any = {"rotation": 90, "va": "top", "bbox": {"fc": "w", "ec": "none", "pad": 0.6}}
        lower.annotate(label, (mu, height), (x, 0.0), ha=side, **place, **look)
        free = mu if before else mu + width


def draw_locus(
    axes: Axes, growth: np.ndarray, frequency: np.ndarray, mu: np.ndarray, span: Any, size: float
) -> Any:
    """Eigenvalues of the upper half plane as dots coloured by mu, ticks at the least mu.

    span: the least and largest mu of the colours. Returns the dots, for a colour bar.
    """
    axes.axvline(0.0, color="0.75", linewidth=0.5, zorder=0)
    low, high = span
    look: dict[str, Any] = {"cmap": "viridis", "vmin": low, "vmax": high, "lw": 0, "zorder": 2}
    dots = axes.scatter(growth, frequency, c=mu, s=size, gid="mu", **look)
    start = mu == low
    axes.plot(
        growth[start], frequency[start], "k_", ms=11 if size > FINE else 5, mew=0.8, gid="start"
    )
    return dots


LARGEST = 0.35  # drawn size of the largest of x, y, w theta, in half lengths

SEEN = 1e-6  # m: a motion of this size is what the exaggeration is told for

REAL = 1e-6  # a shape whose imaginary parts are smaller is real: rounding leaves less

PHASES: dict[str, dict[str, Any]] = {
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
    for corners, (name, look) in zip(lines, PHASES.items(), strict=True):
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
    handles = [Line2D([], [], **look) for look in PHASES.values()]
    return handles, ["equilibrium", "displaced", second]
