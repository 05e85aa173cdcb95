"""What lasts with damping: by case, by the box of initial conditions, and the blows of (c).

From the studies `onset`, `basin` and `grazing`.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from squeal.article.cases import short_title
from squeal.article.studies.basin import Basin
from squeal.article.studies.grazing import Grazing
from squeal.article.studies.onset import After, Onset
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

COLOURS = ("#E6F3FB", "#E69F00", "#C8380E")
LOOKS: dict[str, dict[str, Any]] = {
    "B1 (d)": {"color": "#C8380E", "marker": "o", "mfc": "#C8380E"},
    "B2 (d)": {"color": "k", "marker": "s", "mfc": "w", "ls": (0, (4, 1.5))},
}
NAMES = {"b1-d": "B1 (d)", "b2-d-integral": "B2 (d)"}
CAPTION = r"""Sustained loss of contact with damping (B2 with the energy-consistent law). (a)~Share
of initial conditions that lead to it, of \val[n]{onset.starts} drawn from a box of half-width
\val[2]{onset.box} static compressions (\val[n]{onset.starts_unstable} beside an unstable
equilibrium). Red: from the reference initial conditions too; orange: from others alone, beside a
stable equilibrium; blue: permanent contact from all. (b)~The share in case (d) at
\val[p1]{basin.ratio} over the half-width of the box, with intervals of \val[p0]{basin.confidence}
confidence. The box spans $x$, $y$, $w\theta$ and their velocities over $\sqrt{k_1/m}$ about the
sliding equilibrium (seed \val[n]{basin.seed}). (c)~Impulse of the heaviest blow on the trailing
half of the line in case (c) over the damping ratio. Above the dashed line,
\val[2]{grazing.level}, the blow counts for hammering."""


def _colours_of(row: After) -> tuple[str, str]:
    """Of a tile and of its text: by which initial conditions loss of contact lasts."""
    permanent, from_others, from_reference = COLOURS
    if row.own is not None and row.own.goes_on:
        return from_reference, "w"
    return (from_others if row.lasting else permanent), "k"


def _tiles(axes: Axes, shown: dict[str, tuple[After, ...]], ratios: tuple[float, ...]) -> None:
    """A row per motion, a column per damping ratio, with the share of starts that lead to sustained
    loss of contact.

    shown: by case, such as "b2-d", the outcomes at each of the `ratios` (1 is critical), from the
    top.
    """
    for y, outcomes in enumerate(shown.values()):
        for x, after in enumerate(outcomes):
            colour, ink = _colours_of(after)
            axes.add_patch(Rectangle((x, y), 1, 1, facecolor=colour, edgecolor="w", lw=1.5))
            share = f"{100.0 * after.lasting / after.starts:.0f} %" if after.lasting else ""
            axes.text(x + 0.5, y + 0.5, share, ha="center", va="center", color=ink)
    axes.set_xlim(0, len(ratios))
    axes.set_ylim(len(shown), 0)
    axes.set_xticks([i + 0.5 for i in range(len(ratios))], [f"{100 * r:g}" for r in ratios])
    names = [short_title(name) for name in shown]
    axes.set_yticks([i + 0.5 for i in range(len(shown))], names)
    axes.tick_params(length=0.0)
    axes.set_xlabel(r"damping ratio $\zeta$ [%]")


def _shares(axes: Axes, basin: Basin) -> None:
    """Draw the share that lasts, in per cent, with its interval over the half-width of the box."""
    for name, rows in basin.shares.items():
        widths = [row.half_width for row in rows]
        low, share, high = 100.0 * np.array([(row.low, row.share, row.high) for row in rows]).T
        look: Any = {"ms": 4.0, "capsize": 2.0, "lw": 0.9, "label": NAMES[name], "clip_on": False}
        axes.errorbar(widths, share, yerr=[share - low, high - share], **look, **LOOKS[NAMES[name]])
    axes.set_xlim(0.0, 3.2)
    axes.set_ylim(0.0, 100.0)
    axes.set_xlabel("half-width [static compressions]")
    axes.set_ylabel("share that lasts [%]")
    axes.legend(loc="lower right", borderaxespad=0.4)


def _blows(axes: Axes, grazing: Grazing) -> None:
    ratios = [100.0 * blow.ratio for blow in grazing.blows]
    axes.plot(ratios, [blow.trailing for blow in grazing.blows], "o-", color="k", ms=2.5)
    axes.axhline(grazing.level, color="#C8380E", ls="--", lw=0.9)
    axes.set_xlim(0.0, 2.05)
    axes.set_ylim(0.0, 1.0)
    axes.set_xlabel(r"damping ratio $\zeta$ [%]")
    axes.set_ylabel("trailing blow [$F_n T_1$]")


def _energy_consistent(onset: Onset) -> dict[str, tuple[After, ...]]:
    """What lasts by motion, without the motions under the printed (mean) law."""
    return {name: rows for name, rows in onset.after.items() if not name.endswith("mean")}


def outcomes_figure(onset: Onset, basin: Basin, grazing: Grazing) -> Figure:
    """Tiles, a case and damping ratio each; shares over the box; blows over the damping ratio."""
    shown = {name[:4]: rows for name, rows in _energy_consistent(onset).items()}
    with style():
        figure = Figure(figsize=(DOUBLE, 2.6))
        panels = figure.subplots(1, 3, width_ratios=[1.1, 1.0, 1.0])
        _tiles(panels[0], shown, onset.ratios)
        _shares(panels[1], basin)
        _blows(panels[2], grazing)
        titles = ("by case", f"case (d), {100 * basin.ratio:g} % damping", "B2 (c)")
        for axes, letter, title in zip(panels, "abc", titles, strict=True):
            axes.set_title(f"({letter}) {title}", loc="left", pad=3.0)
    return figure


def draw(onset: Onset, basin: Basin, grazing: Grazing) -> Drawing:
    """The figure, ready to be saved."""
    title = "What lasts with damping"
    made = [record.provenance for record in (onset, basin, grazing)]
    if grazing.grazes is None or grazing.crosses is None or not onset.after:
        why = onset.left_out or "No trailing blow of B2 (c) begins or counts at the damping ratios."
        return blank(title, why, __name__, *made)
    lasting = []
    for name, rows in _energy_consistent(onset).items():
        for row in rows:
            if row.lasting:
                lasting.append(
                    f"{name} at {100 * row.ratio:g} % from {row.lasting} of {row.starts}"
                )
    shares = []
    for name, rows_of_box in basin.shares.items():
        of_widths = [f"{100 * row.share:.0f} % at {row.half_width:g}" for row in rows_of_box]
        shares.append(f"{NAMES[name]} {', '.join(of_widths)}")
    text = (
        f"Cases by damping ratio with sustained loss of contact: {'; '.join(lasting)}. Share that "
        f"lasts by half-width of the box of initial conditions: {'; '.join(shares)}. The blow on "
        f"the trailing half in B2 (c) begins at {100 * grazing.grazes:.2f} % damping and passes "
        f"{grazing.level:g} at {100 * grazing.crosses:.2f} %."
    )
    figure = outcomes_figure(onset, basin, grazing)
    return Drawing(figure, text, title, origin(__name__, *made))
