"""Points and line released from equal shares of their load."""

from squeal.article.report.latex import tabular
from squeal.article.studies.releases import LOADS, Releases, percent

CAPTION = r"""Loss of contact on points / on the line, released alike. The pad starts at rest in the
pose of its sliding equilibrium, moved vertically until full contact would carry the multiple in the
head of the equilibrium's own reaction. Loss: share of the observation time, in per cent, in which
an edge is separated that touches in the equilibrium; means over the cases in which both models have
one. Start: contact force of the set's own initial conditions over $F_n$."""


def table(releases: Releases) -> str:
    """The table in LaTeX, a row per parameter set, a column per load."""
    rows = []
    for name, one in releases.sets.items():
        start = f"{one.start['B1']:.2f} / {one.start['B2']:.2f}"
        cells = []
        for load in LOADS:
            release = one.loads[percent(load)]
            cells.append(f"{100 * release.points:.1f} / {100 * release.line:.1f}")
        rows.append([name.replace("-", " "), ", ".join(one.cases), start, *cells])
    loads = [f"${load:g}$" for load in LOADS]
    return tabular("lllrrrr", ["set", "cases", "start", *loads], [rows])
