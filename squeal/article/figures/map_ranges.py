"""Fig. 13 over its parameters, from the study of the same name."""

import numpy as np
from matplotlib.figure import Figure

from squeal.article.outline import angle_axes_of_pi, mark_cases
from squeal.article.studies.map_ranges import MapRanges, Span
from squeal.plots.style import DOUBLE, Drawing, origin, style

LOOKS = (("#3498DB", "--"), ("#000000", "-"), ("#C8380E", ":"))
SYMBOLS = {"h/w": "$h/w$", "k2/k1": "$k_2/k_1$", "mu": r"friction $\mu$"}


def map_ranges_figure(record: MapRanges) -> Figure:
    """A column for each of h/w, k2/k1 and mu: above outlines of the area in which (23a, b) hold as
    printed, at three values; below the shares of the map over the parameter.

    The grey band goes from the least to the greatest share as printed, over the other two
    parameters. A vertical line marks the scene's value.
    """
    with style():
        figure = Figure(figsize=(DOUBLE, 4.5))
        grid = figure.subplots(2, 3)
        for column, (name, sweep) in enumerate(record.sweeps.items()):
            upper, lower = grid[:, column]
            for (value, curves), (colour, dash) in zip(sweep.shapes.items(), LOOKS, strict=False):
                label = f"{SYMBOLS[name].split()[-1]} = {value}"  # without a word before the symbol
                for curve in curves:
                    alpha1, alpha2 = np.array(curve).T / np.pi
                    upper.plot(alpha1, alpha2, dash, color=colour, label=label, lw=0.9)
                    label = "_"  # the legend names the first curve of a value alone
            mark_cases(upper)
            upper.set_title(f"({'abc'[column]})", loc="left", pad=3.0)
            angle_axes_of_pi(upper)
            if column:
                upper.set_ylabel("")
            upper.legend(loc="lower left", fontsize=8)
            lower.fill_between(sweep.values, sweep.low, sweep.high, color="0.85", lw=0.0)
            lower.plot(sweep.values, sweep.printed, "k-", label="(23a, b) as printed")
            lower.plot(sweep.values, sweep.complete, "k--", label="complete conditions")
            # equilibria are searched at some of the values alone
            lower.plot(
                sweep.sparse,
                sweep.reached,
                "o-",
                color="#3498DB",
                ms=3,
                label="equilibrium on the branch",
            )
            lower.plot(
                sweep.sparse, sweep.stable, "s-", color="#6A1B7B", ms=3, label="stable equilibrium"
            )
            lower.axvline(sweep.own, color="0.4", lw=0.7, zorder=1.5)  # the scene's value
            lower.set_title(f"({'def'[column]})", loc="left", pad=3.0)
            lower.set_xlabel(SYMBOLS[name])
            lower.set_xlim(sweep.values[0], sweep.values[-1])
            lower.set_ylim(0.0, 1.0)
        _, stiffness_ratio, _ = grid[1]  # the lower panels, of h/w, k2/k1 and mu
        stiffness_ratio.set_xscale("log")
        stiffness_ratio.set_xticks([0.25, 0.5, 1.0, 2.0, 4.0], ["1/4", "1/2", "1", "2", "4"])
        stiffness_ratio.minorticks_off()
        grid[1, 0].set_ylabel("share of the map")
        handles, labels = grid[1, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def draw(record: MapRanges) -> Drawing:
    """The figure, ready to be saved."""

    def percent(span: Span) -> str:
        return f"{100 * span.low:.1f} to {100 * span.high:.1f} % of the map"

    text = (
        "Upper row: outlines over the two spring angles of the area in which the conditions "
        "(23a, b) hold as printed, at three values each of h/w, k2/k1 and mu, with the four cases "
        f"marked. Lower row: shares of the map over the same parameters. Over all {record.pads} "
        f"pads the printed conditions hold on {percent(record.printed)}, the complete necessary "
        f"ones on {percent(record.complete)}; grey bands show the range of the share of the "
        "printed conditions at each value, black lines the share of the printed and of the "
        "complete conditions with all else as in the scene, coloured lines those with an "
        "equilibrium on the branch and with a stable one. A vertical line marks the scene's value."
    )
    made = origin(__name__, record.provenance)
    return Drawing(map_ranges_figure(record), text, "The map of Fig. 13 over its parameters", made)


CAPTION = r"""Where quasi-static sliding is possible, over the parameters, the others as in the
reference set (grey verticals). Above: outlines of the region of both spring angles in which
\aeqs{23a}{23b} of the article hold as printed. Below: shares of all angles for which they hold as
printed (grey: range over the others), for which the complete necessary conditions hold, for which
B2 has a sliding equilibrium, and for which no mode grows about it."""
