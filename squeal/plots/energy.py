"""What each term does to the growth of a mode over a parameter."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.plots.maps import symbol_of
from squeal.plots.style import DOUBLE, Drawing, blank, literal, origin, style
from squeal.queries.energy_sweep import TABLES, EnergySweep


def energy_sweep_drawing(answer: EnergySweep, name: str) -> Drawing:
    """A panel for each of the fastest modes: growth rate in black, and what each term adds."""
    title = f"Energy of {name} over {answer.parameter}"
    modes = answer.modes[:TABLES]
    if not modes:
        return blank(title, f"There is no mode of {name} over {answer.parameter}.", __name__)
    with style():
        figure = Figure(figsize=(DOUBLE, 3.0))
        panels = figure.subplots(1, len(modes), squeeze=False, sharey=True)[0]
        for mode, axes in zip(modes, panels, strict=True):
            draw_terms(answer, axes, mode)
            axes.axhline(0.0, color="0.7", lw=0.6, zorder=0)
            axes.label_outer(remove_inner_ticks=False)
        # by label, of all panels: a term that does no work on a mode has no line in its panel
        lines: dict[str, Any] = {}
        for axes in panels:
            handles, labels = axes.get_legend_handles_labels()
            lines |= dict(zip(labels, handles, strict=True))
        figure.legend(lines.values(), lines.keys(), loc="outside upper center", ncols=4)
    text = f"Growth that each term adds to modes {modes} of {name} over {answer.parameter}."
    return Drawing(figure, text, title, origin(__name__))


def draw_terms(answer: EnergySweep, axes: Axes, mode: int, **look: object) -> None:
    """Draw the growth of one mode and of its terms into an Axes; `look` goes to the lines.

    A term has one colour for all modes.
    """
    values, rates, terms = answer.growth_of(mode)
    of_mode: dict[str, Any] = {"color": "k", "linewidth": 1.6, "label": "growth rate", **look}
    axes.plot(values, rates, **of_mode)
    names = list(dict.fromkeys(f"{row.part}: {row.term}" for _, _, row in answer.contributions))
    for term, growth in terms.items():
        of_term: dict[str, Any] = {"color": f"C{names.index(term)}", "label": literal(term), **look}
        axes.plot(values, growth, **of_term)
    axes.set_title(f"mode {mode}, {answer.frequency_of(mode):.4g} Hz", loc="left")
    axes.set(xlabel=symbol_of(answer.parameter), ylabel="growth rate [1/s]")
