"""What the start decides, from the study of the same name: a column a scene, a row a time."""

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from squeal.article.records import Missing
from squeal.article.results.starts import KINDS, SceneStarts, Starts
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

COLOURS = ("#CFE6F5", "#F2C14E", "#6A1B7B", "#C8380E", "#FFFFFF", "#4D4D4D")


def starts_figure(found: Starts) -> Figure:
    """Maps of the kinds of motion; a cross at the equilibrium, a ring at the scene's own start."""
    colours, norm = (
        ListedColormap(list(COLOURS)),
        BoundaryNorm(np.arange(len(KINDS) + 1) - 0.5, len(KINDS)),
    )
    scenes = {n: one for n, one in found.scenes.items() if isinstance(one, SceneStarts)}
    rows = max(len(one.maps) for one in scenes.values())
    with style():
        figure = Figure(figsize=(DOUBLE, 0.9 * rows + 1.0))
        grid = figure.subplots(rows, len(scenes), sharex=True, sharey=True, squeeze=False)
        for column, (name, one) in enumerate(scenes.items()):
            model, _, case = name.partition("-")
            grid[0, column].set_title(f"{model.upper()} ({case})", pad=3.0)
            for axes, part in zip(grid[:, column], one.maps, strict=True):
                codes = np.array([[int(digit) for digit in row] for row in part.rows])
                edges = np.linspace(-found.reach, found.reach, len(codes) + 1)
                axes.pcolormesh(
                    edges, edges, codes, cmap=colours, norm=norm, edgecolors="face", linewidth=0.4
                )
                axes.plot(0.0, 0.0, "+", color="k", ms=4, mew=0.8)
                axes.plot(1.0, 0.0, "o", mfc=COLOURS[part.own], mec="k", ms=4, mew=0.8)
                axes.set_aspect("equal")
                axes.set_xticks([-1, 0, 1])
                axes.set_yticks([-1, 0, 1])
        for axes, part in zip(grid[:, 0], next(iter(scenes.values())).maps, strict=True):
            axes.set_ylabel(f"{part.windows} window{'s'[: part.windows > 1]}\ntilt")
        words = "height of the start over the equilibrium, over that of the scene's start"
        figure.supxlabel(words, fontsize=8)
        handles = [
            Patch(facecolor=c, edgecolor="k", linewidth=0.5, label=kind)
            for c, kind in zip(COLOURS, KINDS, strict=True)
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return figure


def draw(found: Starts) -> Drawing:
    """The figure, ready to be saved."""
    reasons = {one.reason for one in found.scenes.values() if isinstance(one, Missing)}
    if len(reasons) == 1 and not any(isinstance(o, SceneStarts) for o in found.scenes.values()):
        return blank("What the start decides", reasons.pop(), __name__, found.provenance)
    parts = []
    for name, one in found.scenes.items():
        if isinstance(one, SceneStarts):
            shares = ", ".join(
                f"{100 * part.share[KINDS[0]]:.0f} and {100 * part.share[KINDS[3]]:.0f} % after "
                f"{part.windows}"
                for part in one.maps
            )
            parts.append(f"{name} {shares}")
    text = (
        "Maps over height and tilt of the start about the equilibrium of each scene, coloured by "
        "what becomes of the motion. Shares without a loss of contact and with alternate losses, "
        f"and windows: {'; '.join(parts)}."
    )
    made = origin(__name__, found.provenance)
    return Drawing(starts_figure(found), text, "What the start decides", made)
