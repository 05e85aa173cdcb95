"""Figs. 1 and 2: the pad with its springs, drawn from the vectors of Eqs. (1)-(2) of a scene."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Polygon

from squeal.io.provenance import provenance
from squeal.io.scene import Scene, read_scene
from squeal.model.contact import LineContact
from squeal.model.pad import Coefficients
from squeal.plots.style import SINGLE, Drawing, origin, style

SPRING = 1.15  # drawn length of springs 1 and 2 in half lengths of the pad
FOOT = 0.42  # drawn length of the contact springs
_GREY = "0.55"
Vector = Any  # (2,) array or tuple of numbers; rows of (2,) for a line


def corners(c: Coefficients) -> dict[str, Vector]:
    """Corners of the pad from its centre over the half length: upper 1, 2 and lower l, t."""
    return {
        "1": np.array([c.r1x, c.r1y]) / c.w,
        "2": np.array([c.r2x, c.r2y]) / c.w,
        "l": np.array([c.rlx, c.rly]) / c.w,
        "t": np.array([c.rtx, c.rty]) / c.w,
    }


def towards_ground(c: Coefficients) -> dict[str, Vector]:
    """Unit vectors from the pad's corners along springs 1 and 2 to their fixed ends."""
    return {"1": -np.array([c.D1x, c.D1y]) / c.L1, "2": -np.array([c.D2x, c.D2y]) / c.L2}


def _coil(start: Vector, stop: Vector, turns: int = 7, width: float = 0.055) -> Vector:
    """Points (n, 2) of a zigzag line from start to stop with straight ends."""
    along = np.subtract(stop, start)
    side = np.array([-along[1], along[0]]) / np.hypot(*along) * width
    shares = [0.0, 0.18, *np.linspace(0.22, 0.78, 2 * turns), 0.82, 1.0]
    offsets = [0.0, 0.0, *np.resize([1.0, -1.0], 2 * turns), 0.0, 0.0]
    return np.array([start + s * along + o * side for s, o in zip(shares, offsets, strict=True)])


def _line(axes: Axes, points: Vector, **more: Any) -> None:
    given: dict[str, Any] = {"color": "black", "linewidth": 0.8} | more
    axes.plot(*np.transpose(points), **given)


def _text(axes: Axes, position: Vector, text: str, **more: Any) -> None:
    axes.text(float(position[0]), float(position[1]), text, ha="center", va="center", **more)


def _arrow(
    axes: Axes, tail: Vector, head: Vector, text: str, text_position: Vector, **more: Any
) -> None:
    arrow = {"arrowstyle": "-|>", "linewidth": 0.9, "shrinkA": 0.0, "shrinkB": 0.0} | more
    axes.annotate("", head, tail, arrowprops=arrow)
    _text(axes, text_position, text)


def _size(axes: Axes, a: Vector, b: Vector, text: str, shift: Vector) -> None:
    """Draw a dimension line from a to b with its text, moved by `shift` from the middle."""
    line = {"arrowstyle": "<->", "linewidth": 0.6, "color": _GREY, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", a, b, arrowprops=line)
    _text(axes, np.add(a, b) / 2 + shift, text)


def _ground(axes: Axes, middle: Vector, normal: Vector, half: float) -> None:
    """Fixed ground: a line across `normal` with hatching behind it."""
    side = np.array([-normal[1], normal[0]])
    _line(axes, (middle - half * side, middle + half * side), linewidth=1.2)
    for s in np.linspace(-half, half, 6):
        foot = middle + s * side
        _line(axes, (foot, foot + 0.07 * (normal + 0.6 * side)), linewidth=0.5)


def _inclined(axes: Axes, number: str, corner: Vector, direction: Vector, angle: float) -> None:
    """Draw a support spring from a corner in a direction, with its angle (rad).

    alpha1 counts from +x, alpha2 from -x the other way round. number: "1" or "2".
    """
    end = corner + SPRING * direction
    _line(axes, _coil(corner, end))
    _ground(axes, end, direction, 0.16)
    degrees = math.degrees(angle)
    # begin and end of the arc, counted from +x; side: 1 where the angle counts from +x, else -1
    if number == "1":
        side = 1.0
        begin = 0.0
        stop = degrees
    else:
        side = -1.0
        begin = 180.0 - degrees
        stop = 180.0
    outwards = np.array([-direction[1], direction[0]]) * side
    _text(axes, corner + 0.5 * SPRING * direction + 0.27 * outwards, f"$k_{number},\\ L_{number}$")
    reference = np.array([side * 0.36, 0.0])
    _line(axes, (corner, corner + 1.25 * reference), linewidth=0.5, linestyle=(0, (3, 2)))
    axes.add_patch(Arc(tuple(corner), 0.56, 0.56, theta1=begin, theta2=stop, linewidth=0.6))
    # 18 degrees below the middle of the arc, clear of the spring
    middle = math.radians((begin + stop) / 2 - side * 18)
    label = corner + 0.43 * np.array([math.cos(middle), math.sin(middle)])
    _text(axes, label, f"$\\alpha_{number}$")


def _body(axes: Axes, c: Coefficients, corner_of: dict[str, Vector]) -> None:
    """Draw the pad with its coordinates, d and beta of a corner, and its height.

    corner_of: its corners by the names of `corners`, in half lengths from its centre.
    """
    outline = [corner_of["1"], corner_of["2"], corner_of["t"], corner_of["l"]]
    axes.add_patch(Polygon(outline, facecolor="#EAF3FA", edgecolor="black", linewidth=1.1))
    centre = np.zeros(2)
    corner = corner_of["1"]
    axes.plot(0.0, 0.0, "o", color="black", markersize=2.5)
    _line(axes, (centre, corner), color=_GREY, linewidth=0.7)
    _line(axes, (centre, (-0.62, 0.0)), color=_GREY, linewidth=0.5, linestyle=(0, (3, 2)))
    _text(axes, 0.62 * corner + (0.05, 0.07), "$d$")
    beta = math.degrees(math.asin(c.h / math.hypot(c.w, c.h)))
    axes.add_patch(Arc((0, 0), 0.8, 0.8, theta1=180.0 - beta, theta2=180.0, linewidth=0.6))
    half = math.radians(180.0 - beta / 2)
    _text(axes, (0.49 * math.cos(half), 0.49 * math.sin(half)), r"$\beta$")
    _arrow(axes, centre, (0.3, 0.0), "$x$", (0.36, 0.0))
    _arrow(axes, centre, (0.0, 0.24), "$y$", (0.06, 0.24))
    turn = {"arrowstyle": "-|>", "linewidth": 0.9, "connectionstyle": "arc3,rad=0.5"}
    axes.annotate("", (0.53, 0.17), (0.53, -0.17), arrowprops=turn)
    _text(axes, (0.7, 0.0), r"$\theta$")
    far = 1.3
    _size(axes, (far, corner_of["t"][1]), (far, corner_of["2"][1]), "$2h$", (0.12, 0.0))
    for y in (corner_of["t"][1], corner_of["2"][1]):
        _line(axes, [(1.04, y), (far + 0.04, y)], color=_GREY, linewidth=0.4)


def _surroundings(axes: Axes, level: float, corner_of: dict[str, Vector]) -> None:
    """Draw the surface at a height, its speed, the brake force, the fixed frame and the length.

    level: the height in half lengths; corner_of: the corners of the pad, upper 1 and 2, lower l and
    t, from its centre in half lengths.
    """
    axes.fill_between([-2.0, 2.0], level, level - 0.1, color="0.85", linewidth=0.0)
    _line(axes, [(-2.0, level), (2.0, level)], linewidth=1.2)
    _arrow(axes, (1.45, level - 0.2), (1.9, level - 0.2), "$V$", (1.98, level - 0.2))
    top = corner_of["1"][1]
    _arrow(axes, (0.0, top + 0.48), (0.0, top), "$F_n$", (0.12, top + 0.4))
    base = np.array([-1.95, level + 0.16])
    _arrow(axes, base, base + (0.3, 0.0), r"$\vec{e}_x$", base + (0.4, 0.0))
    _arrow(axes, base, base + (0.0, 0.3), r"$\vec{e}_y$", base + (0.0, 0.39))
    y = level - 0.2
    _size(axes, (-1.0, y), (1.0, y), "$2w$", (0.0, -0.09))
    for x in (-1.0, 1.0):
        _line(axes, [(x, corner_of["l"][1]), (x, y - 0.05)], color=_GREY, linewidth=0.4)
    _text(axes, (-1.0, level - 0.32), "leading edge", color="0.3")
    _text(axes, (1.0, level - 0.32), "trailing edge", color="0.3")


def _point_contacts(axes: Axes, corner_of: dict[str, Vector], level: float) -> None:
    """Draw the springs under both edges, down to the surface at the height `level`."""
    for corner, number, side in (("l", "3", -0.26), ("t", "4", 0.33)):
        foot = np.array([corner_of[corner][0], level])
        _line(axes, _coil(corner_of[corner], foot, turns=4))
        _text(axes, (corner_of[corner] + foot) / 2 + (side, 0.0), f"$k_{number},\\ L_{number}$")


def _line_contact(axes: Axes, corner_of: dict[str, Vector], level: float) -> None:
    """Draw the springs along the lower face, and their resultant at the distance delta."""
    for x in np.linspace(-0.94, 0.94, 17):
        points = _coil((x, corner_of["l"][1]), (x, level), turns=2, width=0.02)
        _line(axes, points, color=_GREY, linewidth=0.5)
    _text(axes, (-1.13, (corner_of["l"][1] + level) / 2), "$k_c$")
    foot = np.array([0.36, corner_of["l"][1]])
    _line(axes, [(0.0, 0.0), (0.0, foot[1] - 0.12)], color=_GREY, linewidth=0.5)
    red = {"color": "#C8380E", "linewidth": 1.2}
    _arrow(axes, foot - (0.0, 0.4), foot, "$R_n$", foot + (0.17, -0.27), **red)
    _arrow(axes, foot, foot + (0.38, 0.0), "$R_f$", foot + (0.3, 0.11), **red)
    _size(axes, (0.0, foot[1] - 0.07), foot - (0.0, 0.07), r"$\delta$", (0.0, -0.12))
    for text in axes.texts[-4:]:  # R_f and delta, which stand on the springs, and their arrows
        text.set_bbox({"facecolor": "white", "linewidth": 0.0, "pad": 0.5})


def _is_line(scene: Scene) -> bool:
    return isinstance(scene.pad_model.law, LineContact)


def sketch(scene: Scene) -> Figure:
    """The pad of a B1 scene (Fig. 1) or B2 scene (Fig. 2).

    The pad, its corners and the directions of springs 1 and 2 are to scale; the springs are drawn
    shorter than they are, and the tilt theta0 is as in the scene.
    """
    line = _is_line(scene)
    c = scene.pad_model.c
    corner_of = corners(c)
    directions = towards_ground(c)
    level = -c.h / c.w - FOOT  # of the surface, in half lengths above the mass centre
    with style():
        figure = Figure(figsize=(SINGLE, 2.75))
        axes = figure.add_subplot()
        axes.set_axis_off()
        axes.set_aspect("equal")
        _surroundings(axes, level, corner_of)
        if not line:
            _point_contacts(axes, corner_of, level)
        _body(axes, c, corner_of)
        if line:
            _line_contact(axes, corner_of, level)
        for number, angle in (("1", scene.pad.alpha1), ("2", scene.pad.alpha2)):
            _inclined(axes, number, corner_of[number], directions[number], angle)
        axes.set_xlim(-2.1, 2.1)
        axes.set_ylim(level - 0.42, corner_of["1"][1] + 1.08)
    return figure


def alternative_text(scene: Scene) -> str:
    """The sketch in words."""
    contact = (
        "Below, springs of stiffness kc are spread along the lower face; the reaction Rn and "
        "the friction force Rf act on it at the distance delta from the centre."
        if _is_line(scene)
        else "Below, spring k3 stands under the leading edge and spring k4 under the trailing edge."
    )
    return (
        f"Sketch of model {scene.model}: a rectangular pad of size 2w by 2h with centre "
        "coordinates x, y and theta, pressed by the force Fn onto a surface that moves at speed V. "
        "Spring k1 runs from the upper leading corner at the angle alpha1 to the ground, spring k2 "
        "from the upper trailing corner at alpha2; d and beta place the corners from the centre. "
        + contact
    )


def draw(file: Path) -> Drawing:
    """The sketch of a scene file."""
    scene = read_scene(file)
    made = provenance([file], "squeal.model.pad")
    title = f"Model {scene.model}"
    return Drawing(sketch(scene), alternative_text(scene), title, origin(__name__, made))


CAPTIONS = {
    "fig01": r"Model B1: point contacts at the two edges. Pad and directions of springs "
    r"\name{1} and \name{2} to scale, springs shortened.",
    "fig02": r"Model B2: line contact of stiffness $k_c$, with the reaction $R_n$ and friction "
    r"force $R_f$ at the distance $\delta$ from the centre.",
}
