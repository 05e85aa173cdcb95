"""Figs. 3 and 8: flow charts of the contact states, from the table that the integrator uses."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.article.transitions import EDGE_NAMES, conditions
from squeal.errors import InputError
from squeal.model.contact import FULL, LEAD, NONE, STATES, TRAIL, contact_law
from squeal.model.pad import Model
from squeal.plots.style import SINGLE, Drawing, colours, origin, state_label, style

_PLACES = {FULL: (0.0, 1.0), NONE: (0.0, -1.0), LEAD: (-1.35, 0.0), TRAIL: (1.35, 0.0)}
_SIZE = (0.62, 0.24)  # half width and half height of a box
_BOW = 0.16  # how far an arrow is bowed to the left of its direction, in chart units


def places(model: Model) -> dict[str, tuple[float, float]]:
    """Where each state's box stands; states that share a name stand at the first one's place."""
    law = contact_law(model)
    wide = 1.0 if len(law.meanings) == len(STATES) else 1.35  # one box stands for both sides
    centres: dict[str, tuple[float, float]] = {}
    for state in STATES:
        x, y = _PLACES[state]
        centres.setdefault(law.state_name(state), (wide * x, y))
    return centres


def links(model: Model) -> dict[tuple[str, str], int]:
    """Changes of state (from, to) by name, with the number of gaps that must vanish together."""
    name = contact_law(model).state_name
    counts: dict[tuple[str, str], int] = {}
    for condition in conditions():
        ends = (name(condition.source), name(condition.target))
        counts[ends] = min(condition.codimension, counts.get(ends, 2))
    return counts


def _box(axes: Axes, model: Model, label: str, at: tuple[float, float]) -> None:
    """Draw a state, by its label, and its meaning in a box with the centre `at`."""
    meaning = contact_law(model).meanings[label].replace(" in contact", "").replace("surface ", "")
    head = state_label(label)
    box = {"boxstyle": "round,pad=0.35", "fc": "white", "ec": colours(model)[label], "lw": 1.6}
    look: Any = {"ha": "center", "va": "center", "linespacing": 1.15, "zorder": 3}
    axes.annotate(f"{head}\n{meaning}", at, bbox=box, **look)


def _arrow(
    axes: Axes,
    start: tuple[float, float],
    stop: tuple[float, float],
    text: str,
    together: bool,
) -> None:
    """A bowed arrow from box to box with its label on the bow; dashed where two gaps must vanish
    `together`.

    The bow is to the left of the direction, so that the arrows of a change and of its reverse do
    not cover each other. start, stop: centres of the boxes.
    """
    difference = np.subtract(stop, start)
    direction = difference / np.hypot(*difference)
    left = np.array([-direction[1], direction[0]])
    # distances from the centre at which the straight line passes the sides and the top of a box
    crossings = [_SIZE[i] / abs(direction[i]) for i in (0, 1) if abs(direction[i]) > 1e-9]
    inside = min(crossings) + 0.12  # the arrow begins and ends a little outside of the box
    tail = start + direction * inside + 0.5 * _BOW * left
    head = stop - direction * inside + 0.5 * _BOW * left
    look: dict[str, Any] = {
        "arrowstyle": "-|>",
        # rad is the bow over the distance of the ends, to the right if above 0
        "connectionstyle": f"arc3,rad={-_BOW / np.hypot(*(head - tail)):.3f}",
        "shrinkA": 0.0,
        "shrinkB": 0.0,
        "linewidth": 0.8,
        "linestyle": (0, (3, 2)) if together else "-",
        "color": "0.45" if together else "black",
    }
    axes.annotate("", head, tail, arrowprops=look)
    middle = (tail + head) / 2.0 + left * (0.5 * _BOW + 0.14)
    middle[0] += 0.05 * (len(text) - 3) * left[0]  # longer text needs more room
    axes.text(float(middle[0]), float(middle[1]), text, ha="center", va="center")


def chart(model: Model) -> Figure:
    """State flow chart of model B1 (Fig. 3) or B2 (Fig. 8)."""
    where = places(model)
    with style():
        figure = Figure(figsize=(SINGLE, 2.5))
        axes = figure.add_subplot()
        axes.set_axis_off()
        axes.set_xlim(-2.15, max(x for x, _ in where.values()) + 0.8)
        axes.set_ylim(-1.4, 1.4)
        for label, at in where.items():
            _box(axes, model, label, at)
        for (start, stop), gaps in links(model).items():
            _arrow(axes, where[start], where[stop], f"{start}–{stop}", gaps == 2)
    return figure


def alternative_text(model: Model) -> str:
    """The chart in words."""
    changes: dict[int, list[str]] = {1: [], 2: []}  # by the number of gaps that vanish together
    for (source, target), gaps in links(model).items():
        changes[gaps].append(f"{source} to {target}")
    boxes = "; ".join(
        f"{label}: {meaning}" for label, meaning in contact_law(model).meanings.items()
    )
    return (
        f"State flow chart of model {model}. Boxes: {boxes}. Solid arrows, one edge changes: "
        f"{', '.join(changes[1])}. Dashed arrows, both edges change in the same instant: "
        f"{', '.join(changes[2])}."
    )


def draw(model: str) -> Drawing:
    """The chart of model B1 or B2, ready to be saved."""
    if contact_law(model).points != len(EDGE_NAMES):
        raise InputError(f"{model}: is not allowed; it must be B1 or B2")
    title = f"State flow chart of model {model}"
    return Drawing(chart(model), alternative_text(model), title, origin(__name__))


CAPTIONS = {
    "fig03": "Model B1: contact states and their transitions. Dashed: two conditions at once.",
    "fig08": r"Model B2: contact states. FC, full contact; PC, partial contact, of the leading "
    r"(PC$_l$) or the trailing edge (PC$_t$); SS, separation.",
}
