"""Energies and works along the motions of case (c), from the study of the same name."""

from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from squeal.article.records import first_reason
from squeal.article.studies.energy import Energy, Motion, motion_title
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

CURVES = {
    "kinetic": ("kinetic energy", "#3498DB", (0, (2, 0.7))),
    "elastic": ("elastic energy", "#4A1259", "-"),
    "friction": ("work of friction", "#C8380E", "-"),
    "load": ("work of the brake force", "#7A7A7A", (0, (3, 1))),
    "law": ("work of the contact law", "#000000", (0, (5, 1, 1, 1))),
}
"""Label, colour and line style of each energy, and of each work so far."""
ENERGIES = ("kinetic", "elastic")
AREAS: dict[int, dict[str, Any]] = {
    1: {"fc": "#F6C9BC", "ec": "none"},
    -1: {"fc": "#CFE6F5", "ec": "0.4", "hatch": "//////", "lw": 0.0},
}
"""Of episodes of partial contact in which the law does positive and negative work."""


def _episodes(axes: Axes, motion: Motion) -> None:
    """Shade the episodes in which the contact law does work."""
    for sign, look in AREAS.items():
        for episode in motion.working_episodes(sign):
            axes.axvspan(episode.start, episode.stop, zorder=0, **look)


def energy_figure(record: Energy) -> Figure:
    """Energies above and works below, a column for each motion that has curves."""
    shown = {
        name: motion
        for name, motion in record.motions.items()
        if isinstance(motion, Motion) and motion.curves
    }
    with style():
        figure = Figure(figsize=(DOUBLE, 3.9))
        grid = figure.subplots(2, len(shown), sharex="col", squeeze=False)
        for column, (name, motion) in enumerate(shown.items()):
            upper, lower = grid[:, column]
            # motion.kinetic: the greatest kinetic energy, in J
            factor, unit = (1e3, "mJ") if motion.kinetic < 0.1 else (1.0, "J")
            t = motion.curves["t"]
            for key, (label, colour, look) in CURVES.items():
                axes = upper if key in ENERGIES else lower
                values = [factor * v for v in motion.curves[key]]
                axes.plot(t, values, ls=look, color=colour, label=label, lw=0.9)
            _episodes(lower, motion)
            upper.set_title(f"({'abc'[column]}) {motion_title(name)}", loc="left", pad=3.0)
            upper.set_ylabel(f"energy [{unit}]")
            lower.set_ylabel(f"work so far [{unit}]")
            lower.set_xlabel(r"time $t$ [ms]")
            lower.set_xlim(0.0, t[-1])
        figure.align_ylabels(grid)
        upper, lower = grid[:, 0]
        handles: list[Artist] = [*upper.get_lines(), *lower.get_lines()]
        for sign, word in ((1, "positive"), (-1, "negative")):
            handles.append(Patch(label=f"{word} work of the law", **AREAS[sign]))
        figure.legend(handles=handles, loc="outside upper center", ncols=4)
    return figure


def draw(record: Energy) -> Drawing:
    """The figure, ready to be saved."""
    title = "Energies and works in case (c)"
    parts = []
    for name, motion in record.motions.items():
        if isinstance(motion, Motion) and motion.curves:
            # works (J) of the contact law in the episodes in which it does positive work, and in
            # those in which it does negative work
            gain = [episode.fed for episode in motion.working_episodes(1)]
            loss = [episode.fed for episode in motion.working_episodes(-1)]
            parts.append(
                f"{motion_title(name)}: friction does {motion.friction:.2g} J, the contact law "
                f"{sum(gain):.2g} J in {len(gain)} episodes of partial contact and "
                f"{sum(loss):.2g} J in {len(loss)}"
            )
    if not parts:
        return blank(title, first_reason(record.motions.values()), __name__, record.provenance)
    text = (
        "Kinetic and elastic energy over time in the upper row, works of friction, brake force and "
        f"contact law in the lower row. {'; '.join(parts)}. Areas mark the episodes of partial "
        "contact in which the law does positive or negative work."
    )
    made = origin(__name__, record.provenance)
    return Drawing(energy_figure(record), text, title, made)


CAPTION = r"""Energies (above) and works since the start (below) in case (c): point contact and
both laws of line contact from the same initial conditions. Areas: episodes of partial contact with
positive or negative work of the contact law."""
