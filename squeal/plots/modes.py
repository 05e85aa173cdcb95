"""Eigenvalues in the complex plane, and mode shapes: of a pad, and on the nodes of a system."""

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from numpy.typing import NDArray

from squeal.io.cells import corners_of, outer_faces
from squeal.io.coordinates import Coordinates
from squeal.io.shapes import unit_displacements
from squeal.linear import GROWING, Eigenvalue
from squeal.linear.eigen import values_of
from squeal.model.pad import Pad
from squeal.plots.style import (
    DOUBLE,
    SINGLE,
    Drawing,
    frequency_limits,
    hertz,
    literal,
    origin,
    style,
    write_beside,
)
from squeal.results.eigenvalues import ModeShape

LARGEST = 0.35  # drawn size of the largest of x, y, w theta, in half lengths
LARGEST_OF_NODES = 0.08  # of the body's size: the largest displacement of nodes as drawn
SHARP = 0.77  # cosine of the least angle between faces whose edge is drawn
RING = "#3498DB"  # of eigenvalues that decay
RED = "#C8380E"  # of what grows
NAME: Any = {"fontsize": 7, "color": RED}
NAMED = 6  # growing modes that are named in the complex plane
LISTED = 100  # eigenvalues in the alternative text
IN_PHASE = 1e-6  # of the largest part of a shape: imaginary parts below are rounding
MOST_POINTS = 15_000  # of nodes without faces: as many as show a shape
PHASES: dict[str, dict[str, Any]] = {
    "rest": {"color": "0.6"},
    "first phase": {"color": RED},
    "second phase": {"color": RING, "linestyle": (0, (3, 1.5))},
}


def exaggeration(w: float) -> str:
    """How much larger than a motion of a micrometre shapes of a pad of half length w (m) are drawn,
    in words."""
    return rf"motion of 1 $\mu$m enlarged {float(f'{LARGEST * w / 1e-6:.1e}'):.0f} times"


def is_real(shape: np.ndarray) -> bool:
    """True for a shape whose parts all move in phase; rounding leaves imaginary parts."""
    return bool(np.abs(shape.imag).max() < IN_PHASE)


def outlines(slenderness: float, rest: np.ndarray, shape: np.ndarray) -> list[np.ndarray]:
    """The pad at rest and at two phases of a mode, each as its corners (5, 2), the first one twice.

    Lengths are in half lengths w, in which w theta is theta. The displaced pad is at rest + LARGEST
    Re(phase shape). Both phases are opposite, or a quarter turn apart for a complex shape.

    slenderness: h/w; rest: (x, y, theta) of the equilibrium; shape: complex (x, y, w theta), its
    largest part 1.
    """
    corners = np.array([1, slenderness]) * [[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]
    second_phase = -1.0 if is_real(shape) else 1j
    lines = []
    for phase in (0.0, 1.0, second_phase):  # at phase 0 the pad is at rest
        x, y, theta = rest + LARGEST * (shape * phase).real
        cosine = np.cos(theta)
        sine = np.sin(theta)
        rotation = np.array([[cosine, sine], [-sine, cosine]])  # by theta, of row vectors
        lines.append(corners @ rotation + [x, y])
    return lines


def draw_pad(axes: Axes, lines: Sequence[np.ndarray]) -> None:
    """Pad at rest and at both phases."""
    for corners, (name, look) in zip(lines, PHASES.items(), strict=True):
        axes.plot(*corners.T, linewidth=0.8, gid=name, **look)
    axes.set(aspect="equal", xticks=[], yticks=[])
    axes.spines[:].set_visible(False)


def draw_surface(axes: Axes, height: float, left: float, right: float, bottom: float) -> None:
    """The sliding surface as a line, and what lies below it in grey."""
    size = (right - left, height - bottom)
    axes.add_patch(Rectangle((left, bottom), *size, facecolor="0.92", linewidth=0.0, zorder=0))
    axes.axhline(height, color="k", linewidth=0.6, zorder=0)


def legend_of_phases(shapes: Sequence[np.ndarray]) -> tuple[list[Line2D], list[str]]:
    """Handles and names for a legend of pads at rest and at two phases."""
    kinds = {is_real(shape) for shape in shapes}
    second = "a quarter period later" if kinds == {False} else "half a period later"
    if len(kinds) == 2:
        second += " (complex shapes: a quarter)"
    handles = [Line2D([], [], **look) for look in PHASES.values()]
    return handles, ["equilibrium", "displaced", second]


def draw_eigenvalues(axes: Axes, roots: Sequence[Eigenvalue]) -> None:
    """Draw eigenvalues of the upper half plane, those that grow as red squares.

    Beside the `NAMED` fastest of the growing ones that vibrate stands their frequency.
    """
    axes.axvline(0.0, color="0.7", linewidth=0.6, zorder=0)
    # real ones, too, whose imaginary part rounding may leave below 0
    shown = [root for root in roots if root.value.imag >= -root.rounding]
    upper = values_of(shown)
    grows = np.array([root.kind in GROWING for root in shown], dtype=bool)
    y = upper.imag / math.tau
    for which, marker, colour in ((~grows, "o", RING), (grows, "s", RED)):
        axes.scatter(upper.real[which], y[which], s=26, marker=marker, fc="none", ec=colour)
    reach = max(1.0, 1.2 * float(np.abs(upper.real).max(initial=0.0)))
    axes.set(
        xlim=(-reach, reach),
        ylim=frequency_limits(upper),
        xlabel="growth rate [1/s]",
        ylabel="frequency [Hz]",
    )
    flutter = upper[grows & (upper.imag > 0.0)]
    for root in sorted(flutter, key=lambda r: -r.real)[:NAMED]:
        point = (root.real, root.imag / math.tau)
        write_beside(axes, hertz(root.imag), point, (-5, 0), **NAME)


def pad_figure(
    pad: Pad, q: Sequence[float], shapes: Sequence[ModeShape], roots: Sequence[Eigenvalue] = ()
) -> Figure:
    """Shapes of modes of a pad about its equilibrium q (x, y, theta), and beside them eigenvalues,
    if any are given."""
    slenderness = pad.h / pad.w
    # position and tilt of the pad in half lengths; x is left out, which is the same for all shapes
    rest = np.array([0.0, (pad.y0 + q[1]) / pad.w, pad.theta0 + q[2]])
    scaled = [np.array([1.0, 1.0, pad.w]) * mode.shape for mode in shapes]  # x, y, w theta
    lines = [outlines(slenderness, rest, shape) for shape in scaled]  # of each mode three pads
    # a ModeShape has no verdict: its mode grows if its growth rate is that of a root that grows
    growing_rates = {root.growth_rate for root in roots if root.kind in GROWING}
    corners = np.concatenate(list(itertools.chain(*lines)))
    # limits of the axes, the same for all shapes, with margins in half lengths; the surface is at
    # height -slenderness, some of it is shown
    left, lowest = corners.min(axis=0) - 0.08
    right, top = corners.max(axis=0) + 0.08
    bottom = min(lowest, -slenderness - 0.12)
    with style():
        widths = [1.0]
        height = 2.0  # of a shape, in inches
        if roots:
            widths = [1.5, 1.0]
            height = 1.3
        figure = Figure(figsize=(DOUBLE, 0.5 + height * len(shapes)))
        grid = figure.add_gridspec(len(shapes), len(widths), width_ratios=widths)
        if roots:
            draw_eigenvalues(figure.add_subplot(grid[:, 0]), roots)
        for k, mode in enumerate(shapes):
            axes = figure.add_subplot(grid[k, -1])
            draw_surface(axes, -slenderness, left, right, bottom)
            draw_pad(axes, lines[k])
            name = f"mode {mode.number}: {hertz(math.tau * mode.frequency_hz)}"
            if mode.growth_rate:
                name += f", ${mode.growth_rate:+.4g}$ 1/s"
            axes.set_title(name, pad=2.0, color=RED if mode.growth_rate in growing_rates else "k")
            axes.set(xlim=(left, right), ylim=(bottom, top))
        handles, names = legend_of_phases(scaled)
        names[1] += f" ({exaggeration(pad.w)})"  # of "displaced"
        figure.legend(handles, names, loc="outside upper center", ncols=3, columnspacing=1.2)
    return figure


def modes_drawing(name: str, roots: Sequence[Eigenvalue], figure: Figure | None = None) -> Drawing:
    """The drawing of eigenvalues alone, or of a `figure` that shows them with mode shapes."""
    shapes = " and mode shapes"
    drawn = figure
    if drawn is None:
        shapes = ""
        with style():
            drawn = Figure(figsize=(SINGLE, 3.0))
            draw_eigenvalues(drawn.add_subplot(), roots)
    listed = ", ".join(f"{e.value.real:.4g} {e.value.imag:+.4g}i" for e in roots[:LISTED])
    if len(roots) > LISTED:
        listed += f", and {len(roots) - LISTED} more"
    text = f"Eigenvalues of {name} in the complex plane{shapes}; in rad/s: {listed}."
    return Drawing(drawn, text, f"Eigenvalues of {name}", origin(__name__))


def outline(coordinates: Coordinates, faces: Sequence[tuple[int, ...]]) -> list[NDArray]:
    """The edges of a body that show its form, each by its two ends (2, 3).

    They are all edges but those between two faces that are nearly in one plane, see `SHARP`: so
    those at the rim of one face, and where three or more faces meet, are among them. faces: the
    indices of the nodes of each, in order around it.
    """
    # by edge, as the pair of its nodes: the normals of all faces that have this edge
    normals_of: dict[frozenset[int], list[NDArray]] = {}
    for face in faces:
        a, b, c = coordinates.places[list(face[:3])]
        normal = np.cross(b - a, c - b)  # of the plane of three corners
        normal = normal / (np.linalg.norm(normal) or 1.0)  # zero of a face without area
        for edge in zip(face, (*face[1:], face[0]), strict=True):
            normals_of.setdefault(frozenset(edge), []).append(normal)
    shown = []
    for nodes, normals in normals_of.items():
        if len(normals) != 2 or abs(float(normals[0] @ normals[1])) < SHARP:
            shown.append(coordinates.places[sorted(nodes)])
    return shown


def shape_drawing(name: str, heading: str, coordinates: Coordinates, shape: NDArray) -> Drawing:
    """Draw a mode of a system at the phase of largest motion and a quarter of a period later.

    Drawn are the faces of elements over the outline at rest, or the nodes alone where there are no
    elements. name: of the system; heading: number, frequency and growth rate of the mode; shape
    (n,): complex displacements of all rows.
    """
    faces = [corners_of(face) for face in outer_faces(coordinates.cells)]
    edges = outline(coordinates, faces)
    step = 1  # each node is drawn, or of many only some
    if not faces:
        step += len(coordinates.places) // MOST_POINTS
    u = unit_displacements(coordinates, shape)[::step]
    rest = coordinates.places[::step]
    amplitude = np.linalg.norm(u, axis=1)
    box = _box(coordinates.places)
    dot = float(np.clip(6e3 / len(rest), 0.3, 12.0))  # points squared, the smaller the more
    with style():
        figure = Figure(figsize=(DOUBLE, 2.5))
        figure.set_layout_engine("none")
        # the left side of each panel, the factor of its phase, and its title
        panels = ((0.0, 1.0, "(a) largest motion"), (0.45, 1j, "(b) a quarter of a period later"))
        for left, phase, title in panels:
            axes: Any = figure.add_axes((left, 0.0, 0.45, 0.85), projection="3d")
            axes.set_box_aspect(tuple(box.half), zoom=1.5)
            axes.set_axis_off()
            moved = rest + box.largest_motion * (u * phase).real
            if faces:
                axes.add_collection3d(Line3DCollection(edges, colors="0.55", linewidths=0.4))
                drawn = _coloured_faces(faces, moved, amplitude)
                axes.add_collection3d(drawn)
            else:
                drawn = axes.scatter(*moved.T, c=amplitude, clip_on=False, s=dot, lw=0)
            drawn.set(clim=(0.0, 1.0))
            axes.set(xlim=box.limits[0], ylim=box.limits[1], zlim=box.limits[2])
            figure.text(left + 0.225, 0.82, title, ha="center")
        bar = figure.colorbar(drawn, cax=figure.add_axes((0.92, 0.15, 0.012, 0.6)))
        bar.set_label("amplitude [largest]")
        figure.text(0.5, 0.93, literal(heading), ha="center")
    text = f"Shape of a mode of {name}: {heading}."
    return Drawing(figure, text, f"Mode of {name}", origin(__name__))


class _Box(NamedTuple):
    """A box that holds the nodes at every phase: half its sides (3,), its limits (3, 2), and the
    largest displacement as drawn."""

    half: NDArray
    limits: NDArray
    largest_motion: float


def _box(places: NDArray) -> _Box:
    """The box about the places (nodes, 3), m, with room for motion; no side of it is zero."""
    ends = np.array([places.min(axis=0), places.max(axis=0)])  # two opposite corners
    sides = np.ptp(ends, axis=0)
    size = float(sides.max()) or 1.0
    largest_motion = LARGEST_OF_NODES * size
    half = np.maximum(sides, 0.08 * size) / 2 + largest_motion
    limits = np.transpose(ends.mean(axis=0) + np.array([-1.0, 1.0])[:, None] * half)
    return _Box(half, limits, largest_motion)


def _coloured_faces(
    faces: Sequence[tuple[int, ...]], places: NDArray, amplitude: NDArray
) -> Poly3DCollection:
    """Faces of nodes at places (n, 3), coloured by the mean amplitude (n,) of their nodes."""
    polygons = []
    colours = []
    for face in faces:
        nodes = list(face)
        polygons.append(places[nodes])
        colours.append(amplitude[nodes].mean())
    collection = Poly3DCollection(polygons, linewidths=0.1)
    collection.set(array=np.array(colours), edgecolor=(0.0, 0.0, 0.0, 0.25))
    return collection
