"""Growth rates fitted to simulations, from the results of `squeal.article.studies.stability`."""

import numpy as np
from matplotlib.figure import Figure

from squeal.article.cases import HISTORY_FIGURES, title
from squeal.article.results.stability import Stability
from squeal.plots.style import DOUBLE, Drawing, origin, style

COLOURS = ("#3498DB", "#6A1B7B", "#C8380E")


def _label(name: str) -> str:
    return title(name) if name in HISTORY_FIGURES else name[0].upper() + name[1:]


def growth_figure(found: Stability) -> Figure:
    """Growth rates and frequencies: predicted by the linearisation, fitted to simulations."""
    with style():
        figure = Figure(figsize=(DOUBLE, 2.5))
        left, right = figure.subplots(1, 2)
        looks = zip(found.growth, COLOURS, ("o", "s", "^"), strict=False)  # as many as flutter
        for one, colour, marker in looks:
            mu = np.array(one.mu)
            for axes, part, unit in ((left, 0, 1e3), (right, 1, 2e3 * np.pi)):
                predicted = np.array(one.predicted)[:, part] / unit
                fitted = np.array(one.fitted)[:, part] / unit
                axes.plot(mu, fitted, marker, mfc="none", mec=colour, ms=5, label=_label(one.name))
                axes.plot(mu, predicted, "+", color=colour, ms=4)
        left.set_ylabel("growth rate [1/ms]")
        right.set_ylabel("frequency [kHz]")
        right.set_ylim(bottom=0.0)
        for axes in (left, right):
            axes.set_xlabel(r"friction $\mu$")
        handles, names = left.get_legend_handles_labels()
        figure.legend(handles, names, loc="outside upper center", ncols=3)
    return figure


def draw(found: Stability) -> Drawing:
    """The figure, ready to be saved."""
    text = (
        "Growth rate and frequency over friction: crosses are predicted, open marks fitted to the "
        "start of simulations; each cross lies within its mark."
    )
    made = origin(__name__, found.provenance)
    return Drawing(growth_figure(found), text, "Growth rates fitted to simulations", made)
