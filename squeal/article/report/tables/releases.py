"""Points and line released from equal shares of their load."""

from squeal.article.report.latex import percent, tabular
from squeal.article.studies.releases import LOADS, Releases

CAPTION = r"""Loss of contact after a release at rest from the pose of the sliding equilibrium,
moved vertically until full contact would carry the multiple in the head of the equilibrium's own
reaction: share of the observation time in which an edge is separated that touches in the
equilibrium, on points / on the line, as means over the cases in which both models have an
equilibrium. Start: contact force of the set's own initial conditions over $F_n$, on points / on the
line."""


def table(releases: Releases) -> str:
    """A row a parameter set, a column a load."""
    rows = []
    for name, one in releases.sets.items():
        start = f"{one.start['B1']:.2f} / {one.start['B2']:.2f}"
        cells = []
        for load in LOADS:
            release = one.loads[str(load)]
            cells.append(f"{100 * release.points:.1f} / {percent(release.line)}")
        rows.append([name.replace("-", " "), ", ".join(one.cases), start, *cells])
    loads = [f"${load:g}$" for load in LOADS]
    return tabular("lllrrrr", ["set", "cases", "start", *loads], [rows])
