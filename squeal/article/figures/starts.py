"""What becomes of other initial conditions, from the study of the same name: a map a case."""

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from squeal.article.records import Missing
from squeal.article.studies.starts import KINDS, WINDOWS, Map, Starts
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

COLOURS = ("#E6F3FB", "#E69F00", "#3B0F4A", "#C8380E", "#4D4D4D")
"""By the kind of motion, apart in grey too."""
HALO = [withStroke(linewidth=2.2, foreground="w")]
CAPTION = r"""What becomes of initial conditions at rest after ten observation times without
damping, over their height above the sliding equilibrium and their tilt (equilibrium: cross;
reference initial conditions: ring). A height of one is the reference's, a tilt of one lifts an
edge by the static compression of the contact."""


def starts_figure(maps: dict[str, Map], reach: float) -> Figure:
    """Maps of the kinds of motion, B1 above B2."""
    palette = ListedColormap(list(COLOURS))
    norm = BoundaryNorm(np.arange(len(KINDS) + 1) - 0.5, len(KINDS))
    with style():
        figure = Figure(figsize=(DOUBLE, 3.9))
        grid = figure.subplots(2, 4, sharex=True, sharey=True)
        for axes, (name, one) in zip(grid.flat, maps.items(), strict=False):
            codes = np.array([[int(digit) for digit in row] for row in one.rows])
            edges = np.linspace(-reach, reach, len(codes) + 1)
            axes.pcolormesh(
                edges, edges, codes, cmap=palette, norm=norm, edgecolors="face", linewidth=0.4
            )
            axes.plot(0.0, 0.0, "+", color="k", ms=5, mew=0.9, path_effects=HALO)
            axes.plot(1.0, 0.0, "o", mfc=COLOURS[one.own], mec="k", ms=5, path_effects=HALO)
            axes.set_title(f"{name[:2].upper()} ({name[-1]})", pad=3.0)
            axes.set_aspect("equal")
            axes.set_xticks([-1, 0, 1])
            axes.set_yticks([-1, 0, 1])
        figure.supxlabel("height of the initial condition", fontsize=8)
        figure.supylabel("tilt", fontsize=8)
        present = {int(digit) for one in maps.values() for row in one.rows for digit in row}
        handles = [
            Patch(facecolor=COLOURS[k], edgecolor="k", linewidth=0.5, label=KINDS[k])
            for k in sorted(present)
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))
    return figure


def draw(record: Starts) -> Drawing:
    """The figure, ready to be saved."""
    title, longest = "What the initial conditions decide", WINDOWS[-1]
    maps = {
        name: next(part for part in one if part.windows == longest)
        for name, one in record.cases.items()
        if not isinstance(one, Missing)
    }
    if not maps:
        reason = next(one.reason for one in record.cases.values() if isinstance(one, Missing))
        return blank(title, reason, __name__, record.provenance)
    shares = "; ".join(
        f"{name} {100 * one.share[KINDS[0]]:.0f} % permanent contact, "
        f"{100 * one.share[KINDS[3]]:.0f} % hammering"
        for name, one in maps.items()
    )
    text = (
        "Maps over height and tilt of initial conditions about the equilibrium of each case, "
        f"coloured by what becomes of the motion. Shares: {shares}."
    )
    made = origin(__name__, record.provenance)
    return Drawing(starts_figure(maps, record.reach), text, title, made)
