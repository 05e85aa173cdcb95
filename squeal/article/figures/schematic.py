"""The results in one picture: the four arrangements, and four answers under each."""

import math

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from squeal.article.cases import CASES
from squeal.article.figures.sketch import _coil, _ground
from squeal.article.studies.hammering import Hammering
from squeal.article.studies.onset import RATIO, Onset
from squeal.article.studies.sets import REFERENCE, Sets
from squeal.plots.style import DOUBLE, Drawing, origin, style

ON, OFF = "#C8380E", "white"
HALF, HIGH = 0.55, 0.32  # half width and half height of the drawn pad
CAPTION = r"""The result for the reference set: the four arrangements of the springs and what
happens in each. Filled: yes. Line 1 and 2: undamped, from the reference initial conditions. Line
3: without damping. Line 4: from some initial conditions, at $\zeta = {}$\val[p1]{onset.ratio}."""


def _pad(axes: Axes, alpha1: float, alpha2: float) -> None:
    corners = [(-HALF, HIGH), (HALF, HIGH), (HALF, -HIGH), (-HALF, -HIGH)]
    axes.add_patch(Polygon(corners, facecolor="#EAF3FA", edgecolor="k", linewidth=0.9))
    for corner, way in (
        (corners[0], (math.cos(alpha1), math.sin(alpha1))),
        (corners[1], (-math.cos(alpha2), math.sin(alpha2))),
    ):
        end = (corner[0] + 0.7 * way[0], corner[1] + 0.7 * way[1])
        axes.plot(*_coil(corner, end, turns=5, width=0.05).T, color="k", lw=0.7)
        _ground(axes, end, way, 0.13)
    axes.plot([-1.35, 1.35], [-HIGH, -HIGH], color="k", lw=1.1)
    axes.annotate("", (1.3, -HIGH - 0.14), (0.9, -HIGH - 0.14), arrowprops={"arrowstyle": "-|>"})
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-1.45, 1.45)
    axes.set_ylim(-0.6, 1.2)


def lamps(hammering: Hammering, sets: Sets, onset: Onset) -> dict[str, dict[str, bool]]:
    """The answers by question and case."""
    first = {name: one["1"] for name, one in hammering.motions.items()}
    flutters = sets.sets[REFERENCE].flutters
    answers: dict[str, dict[str, bool]] = {
        "points: an edge separates": {c: first[f"b1-{c}"].apart > 0.0 for c in CASES},
        "line: the surfaces separate": {c: first[f"b2-{c}"].separated > 0.0 for c in CASES},
        "line: sliding flutters": {c: c in flutters["B2"] for c in CASES},
    }
    if onset.after:
        at = onset.ratios.index(RATIO)
        answers["line: loss survives damping"] = {
            c: bool(onset.after[f"b2-{c}-integral"][at].lasting) for c in CASES
        }
    return answers


def draw(hammering: Hammering, sets: Sets, onset: Onset) -> Drawing:
    """The figure, ready to be saved."""
    answers = lamps(hammering, sets, onset)
    with style():
        figure = Figure(figsize=(DOUBLE, 2.1))
        grid = figure.subplots(
            2, 5, height_ratios=[1.5, 1.0], width_ratios=[1.25, 1, 1, 1, 1], squeeze=False
        )
        grid[0, 0].set_axis_off()
        for axes, (case, angles) in zip(grid[0, 1:], CASES.items(), strict=True):
            _pad(axes, *angles)
            axes.set_title(f"({case})", pad=2.0)
        for column, axes in enumerate(grid[1]):
            axes.set_axis_off()
            axes.set_xlim(-1.0, 1.0)
            axes.set_ylim(-len(answers) + 0.4, 0.6)
            for row, (question, of) in enumerate(answers.items()):
                if column == 0:
                    axes.text(1.0, -row, question, ha="right", va="center")
                else:
                    on = of["abcd"[column - 1]]
                    axes.plot(0.0, -row, "o", ms=9, mfc=ON if on else OFF, mec="k", mew=0.7)
    text = "; ".join(
        f"{question}: {', '.join(c for c, yes in of.items() if yes) or 'no case'}"
        for question, of in answers.items()
    )
    made = origin(__name__, hammering.provenance, sets.provenance, onset.provenance)
    title = "The result in one picture"
    return Drawing(figure, f"Four arrangements of the springs, (a) to (d). {text}.", title, made)
