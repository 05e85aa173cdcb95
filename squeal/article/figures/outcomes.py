"""What lasts with damping, a tile a case and damping ratio, from the study `onset`."""

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from squeal.article.studies.onset import After, Onset
from squeal.plots.style import SINGLE, Drawing, blank, origin, style

COLOURS = ("#E6F3FB", "#E69F00", "#C8380E")
CAPTION = r"""Share of initial conditions from which the loss of contact is sustained, by case
and damping ratio (B2 with the energy-consistent law). Red: from the reference initial conditions
too; orange: from others alone, beside a stable equilibrium; blue: permanent contact from all."""


def _tile(row: After) -> tuple[int, str]:
    own = bool(row.own and row.own.goes_on)
    share = 100.0 * row.lasting / row.starts
    return (2 if own else 1 if row.lasting else 0), f"{share:.0f} %" if row.lasting else ""


def draw(record: Onset) -> Drawing:
    """The figure, ready to be saved."""
    title = "What lasts with damping"
    if not record.after:
        return blank(title, record.left_out, __name__, record.provenance)
    shown = {name[:4]: rows for name, rows in record.after.items() if not name.endswith("mean")}
    with style():
        figure = Figure(figsize=(SINGLE, 2.75))
        axes = figure.add_subplot()
        for y, rows in enumerate(shown.values()):
            for x, row in enumerate(rows):
                kind, share = _tile(row)
                axes.add_patch(
                    Rectangle((x, y), 1, 1, facecolor=COLOURS[kind], edgecolor="w", lw=1.5)
                )
                ink = "w" if kind == 2 else "k"
                axes.text(x + 0.5, y + 0.5, share, ha="center", va="center", color=ink)
        axes.set_xlim(0, len(record.ratios))
        axes.set_ylim(len(shown), 0)
        axes.set_xticks(
            [i + 0.5 for i in range(len(record.ratios))], [f"{100 * r:g} %" for r in record.ratios]
        )
        axes.set_yticks(
            [i + 0.5 for i in range(len(shown))], [f"{n[:2].upper()} ({n[-1]})" for n in shown]
        )
        axes.tick_params(length=0.0)
        axes.set_xlabel(r"damping ratio $\zeta$")
    lasting = [
        f"{name} at {100 * row.ratio:g} % from {row.lasting} of {row.starts}"
        for name, rows in shown.items()
        for row in rows
        if row.lasting
    ]
    text = f"Cases by damping ratio with sustained loss of contact: {'; '.join(lasting)}."
    return Drawing(figure, text, title, origin(__name__, record.provenance))
