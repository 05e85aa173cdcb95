"""Springs along the face against the line, from the study of the same name."""

import numpy as np
from matplotlib.figure import Figure

from squeal.article.records import Missing, first_reason
from squeal.article.studies.line_springs import COUNTS, Contact, LineSprings
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

LOOKS = {"a": ("#3498DB", "o"), "b": ("#000000", "s"), "c": ("#C8380E", "^"), "d": ("#6A1B7B", "D")}
LEAST = 1e-9  # of the range: motions that are nearer are the same to rounding


def springs_figure(record: LineSprings) -> Figure:
    """Contact lost, surfaces apart and distance from the line's motion over the springs' number."""
    with style():
        figure = Figure(figsize=(DOUBLE, 2.5))
        panels = figure.subplots(1, 3)
        lost_panel, apart_panel, distance_panel = panels
        for name, case in record.cases.items():
            colour, marker = LOOKS[name]
            simulated = [contact for contact in case.springs if isinstance(contact, Contact)]
            counts = [contact.count for contact in simulated]
            for axes, key in ((lost_panel, "lost"), (apart_panel, "apart")):
                shares = [getattr(contact, key) for contact in simulated]
                axes.plot(counts, shares, marker + "-", color=colour, ms=3, label=f"case ({name})")
                if isinstance(case.line, Contact):
                    axes.axhline(getattr(case.line, key), color=colour, ls="--", lw=0.7)
            distances = np.array([contact.off for contact in simulated])
            distances[distances <= LEAST] = np.nan  # not drawn
            distance_panel.plot(counts, distances, marker + "-", color=colour, ms=3)
        guide = np.array([8.0, 32.0])  # between these numbers a line shows how N^-2 falls
        distance_panel.plot(guide, 2.0 / guide**2, color="0.5", lw=0.7)
        distance_panel.text(3.0, 2e-4, r"grey: $\propto N^{-2}$", color="0.4", ha="center")
        lost_panel.set_ylabel("share of time, some spring separated")
        apart_panel.set_ylabel("share of time, surfaces separated")
        distance_panel.set_ylabel("distance from the line's motion")
        distance_panel.set_yscale("log")
        for axes, letter in zip(panels, "abc", strict=True):
            axes.set_xscale("log", base=2)
            axes.set_xticks(COUNTS, [str(n) for n in COUNTS])
            axes.minorticks_off()
            axes.set_xlabel("number of springs $N$")
            axes.set_title(f"({letter})", loc="left", pad=3.0)
        for axes in (lost_panel, apart_panel):
            axes.set_ylim(-0.03, 1.0)
        legend = lost_panel.get_legend_handles_labels()
        figure.legend(*legend, loc="outside upper center", ncols=4)
    return figure


def draw(record: LineSprings) -> Drawing:
    """The figure, ready to be saved."""
    title = "Springs along the face against the line"
    parts = []
    for name, case in record.cases.items():
        line = case.line
        if isinstance(line, Missing):  # nothing is compared with it
            continue
        first = case.springs[0]
        if isinstance(first, Contact):
            parts.append(
                f"case ({name}) {100 * first.lost:.1f} and {100 * first.apart:.1f} % on "
                f"{first.count} springs, {100 * line.lost:.1f} and {100 * line.apart:.1f} % on "
                "the line"
            )
    if not parts:
        why = first_reason(case.line for case in record.cases.values())
        return blank(title, why, __name__, record.provenance)
    text = (
        "Over the number of springs along the face: share of the time in which some contact is "
        "lost, share in which the surfaces are apart, and greatest distance from the motion on "
        f"the line, which dashed lines show. Lost and apart: {'; '.join(parts)}."
    )
    made = origin(__name__, record.provenance)
    return Drawing(springs_figure(record), text, title, made)


CAPTION = r"""$N$ springs in place of the line: share of time in which some spring is separated (a)
and in which all are (b), dashed for the edges of the line; greatest distance from the motion on the
line over its range (c)."""
