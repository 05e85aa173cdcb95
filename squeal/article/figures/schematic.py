"""The results in one picture: the four arrangements, and five answers for each model under each."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from squeal.article.cases import CASES, stem
from squeal.article.figures.sketch import _coil, _ground
from squeal.article.studies._scenes import REFERENCE
from squeal.article.studies.hammering import Hammering
from squeal.article.studies.sets import Sets
from squeal.plots.style import DOUBLE, Drawing, origin, style

ON = "#C8380E"
OFF = "white"
# half width and half height of the drawn pad
HALF = 0.55
HIGH = 0.32
CAPTION = r"""Both models of contact, and the result for the reference set, one of four fitted sets,
in the four cases of spring directions. Filled: yes. Only edges count that touch in steady sliding.
Rows 1 to 4: undamped, the first three from the reference initial conditions; flutters: a mode about
steady sliding grows. Row 5: modal damping of \val[p1]{onset.ratio}, some initial conditions, the
line with the energy-consistent law."""


def _pad(axes: Axes, alpha1: float, alpha2: float) -> None:
    """Draw a pad on the moving surface, with its two inclined springs, at angles in rad.

    alpha1 counts from +x, alpha2 from -x the other way round.
    """
    corners = [(-HALF, HIGH), (HALF, HIGH), (HALF, -HIGH), (-HALF, -HIGH)]
    axes.add_patch(Polygon(corners, facecolor="#EAF3FA", edgecolor="k", linewidth=0.9))
    for corner, direction in (
        (corners[0], (math.cos(alpha1), math.sin(alpha1))),
        (corners[1], (-math.cos(alpha2), math.sin(alpha2))),
    ):
        end = (corner[0] + 0.7 * direction[0], corner[1] + 0.7 * direction[1])
        axes.plot(*_coil(corner, end, turns=5, width=0.05).T, color="k", lw=0.7)
        _ground(axes, end, direction, 0.13)
    axes.plot([-1.35, 1.35], [-HIGH, -HIGH], color="k", lw=1.1)
    axes.annotate("", (1.3, -HIGH - 0.14), (0.9, -HIGH - 0.14), arrowprops={"arrowstyle": "-|>"})
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-1.45, 1.45)
    axes.set_ylim(-0.6, 1.2)


def _model(axes: Axes, middle: float, springs: int, name: str) -> None:
    """Draw a small pad with its name on a number of springs between its lower face and the surface.

    middle: its centre on the horizontal axis.
    """
    half = 0.58
    # heights
    top = 0.5
    face = -0.02
    surface = -0.42
    corners = [
        (middle - half, top),
        (middle + half, top),
        (middle + half, face),
        (middle - half, face),
    ]
    axes.add_patch(Polygon(corners, facecolor="#EAF3FA", edgecolor="k", linewidth=0.9))
    turns = 3
    for x in np.linspace(middle - half, middle + half, springs):
        axes.plot(*_coil((x, face), (x, surface), turns, width=0.04).T, color="k", lw=0.6)
    axes.plot([middle - 0.68, middle + 0.68], [surface, surface], color="k", lw=1.1)
    axes.text(middle, 0.5 * (top + face), name, ha="center", va="center")
    axes.annotate("", (middle, top), (middle, top + 0.5), arrowprops={"arrowstyle": "-|>"})
    axes.text(middle + 0.1, top + 0.33, "$F_n$", va="center")


def _models(axes: Axes) -> None:
    """The two models of contact: a spring under each edge, and springs along the face."""
    _model(axes, -0.75, 2, "B1: points")
    _model(axes, 0.75, 9, "B2: line")
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-1.5, 1.5)
    axes.set_ylim(-0.6, 1.2)


def lamps(hammering: Hammering, sets: Sets) -> dict[str, list[str]]:
    """The motions, as "b1-a", of which each statement is true."""
    # each motion over one observation time; over ten it stands under "10"
    motions = {name: by_windows["1"] for name, by_windows in hammering.motions.items()}
    reference = sets.sets[REFERENCE]
    return {
        "an edge separates": [name for name, m in motions.items() if m.lost],
        "both separate at once": [name for name, m in motions.items() if m.separated > 0.0],
        "the pad hammers": [name for name, m in motions.items() if m.hammers],
        "the equilibrium flutters": [
            stem(model, case) for model, cases in reference.flutters.items() for case in cases
        ],
        "contact keeps changing": [name for name, s in reference.lasting.items() if s > 0.0],
    }


def draw(hammering: Hammering, sets: Sets) -> Drawing:
    """The figure, ready to be saved."""
    answers = lamps(hammering, sets)
    with style():
        figure = Figure(figsize=(DOUBLE, 1.85))
        grid = figure.subplots(
            2, 5, height_ratios=[1.0, 1.0], width_ratios=[1.15, 1, 1, 1, 1], squeeze=False
        )
        _models(grid[0, 0])
        for axes, (case, angles) in zip(grid[0, 1:], CASES.items(), strict=True):
            _pad(axes, *angles)
            axes.set_title(f"({case})", pad=0.0)
        for axes in grid[1]:
            axes.set_axis_off()
            axes.set_xlim(-1.0, 1.0)
            axes.set_ylim(-len(answers) + 0.4, 1.4)
        # below the models the statements, below each case a lamp for each model and statement
        for row, statement in enumerate(answers):
            grid[1, 0].text(1.0, -row, statement, ha="right", va="center")
        columns = (("B1", "points", -0.3), ("B2", "line", 0.3))  # model, its name, and x
        for axes, case in zip(grid[1, 1:], CASES, strict=True):
            for _, kind, x in columns:
                axes.text(x, 1.0, kind, ha="center", va="center")
            for row, names in enumerate(answers.values()):
                for model, _, x in columns:
                    color = ON if stem(model, case) in names else OFF
                    axes.plot(x, -row, "o", ms=7.5, mfc=color, mec="k", mew=0.7)
    sentences = []
    for statement, names in answers.items():
        sentences.append(f"{statement}: {', '.join(names) or 'no case'}")
    made = origin(__name__, hammering.provenance, sets.provenance)
    return Drawing(
        figure,
        "A pad on two springs under its edges, and one on springs along its face. Four "
        f"arrangements of the inclined springs, (a) to (d). {'; '.join(sentences)}.",
        "The result in one picture",
        made,
    )
