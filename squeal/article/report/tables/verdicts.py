"""Shares of random parameter sets for which the verdicts hold."""

from squeal.article.report.latex import tabular
from squeal.article.studies.ensemble import Ensemble, Share

CAPTION = r"""Share of random parameter sets, drawn within physical bounds, for which a statement
holds, in \%, with its 95\,\% interval (Wilson). Columns: all sets whose lower face stays slower
than \val[n]{ensemble.speed}\,m/s; those that stay slower than \val[n]{ensemble.slow}\,m/s; those
with $h/w < 0.296$; those that satisfy at least \val{ensemble.close} of \val{ensemble.statements}
independent statements. A set counts as undecided, and widens the interval to its side, where
motions from initial conditions off by $10^{-10}$ do not agree. About as long: the shares of time
differ by less than 5 percentage points, and by less than 6 if all edges count. Released alike: both
models at rest where the contact bears so many times the load of their own equilibrium. Damped:
modal damping of \val[p0]{ensemble.ratio}, the first \val{ensemble.damped} sets,
\val{ensemble.starts} initial conditions within \val[n]{ensemble.reach} static compressions."""
GROUPS = {"all": "all", "slow": "slower", "flat": "flat", "close": "close"}
NAMES = {
    "restless": "no motion settles, undamped",
    "differ": "points: some cases hammer, others do not",
    "differ_where_hammering": "\\quad of the sets that hammer on points",
    "c_only": "(c) is the only case that hammers with both models",
    "c_only_where_both": "\\quad of the sets with a case that does",
    "points_longer": "points lose contact longer (edges that touch in sliding)",
    "line_longer_all_edges": "the line loses contact longer, all edges counted",
    "two_alike": "line and two points of its stiffness lose it for about as long",
    "locked_line": "where the line separates: with rotation locked it does not",
    "locked_points": "where points lose contact: with rotation locked they do too",
    "permanent_all": "points keep full contact after a small release, in each case",
    "permanent_some": "\\quad in some case",
    "separates_fluttering": "line separates in (c), where its equilibrium flutters",
    "separates_stable": "\\quad where it does not",
}
LOADS = {
    "0_02": "released alike, at 0.02 of the load",
    "0_5": "at 0.5",
    "1_2": "at 1.2",
    "2": "at twice the load",
}
COEXIST = {
    "points": "contact lost beside stable sliding, damped: points",
    "line": "\\quad line",
    "either": "\\quad either",
}


def entry(share: Share | None) -> str:
    """A share with its interval, in per cent."""
    if share is None:
        return "--"
    low, high = share.interval
    return f"{100 * share.share:.0f} ({100 * low:.0f}--{100 * high:.0f})"


def table(ensemble: Ensemble) -> str:
    """The table in LaTeX, a row per statement, a column per group of sets."""

    def row(statement: str, name: str) -> list[str]:
        return [statement, *(entry(ensemble.shares[name].get(group)) for group in GROUPS)]

    rows = [row(statement, name) for name, statement in NAMES.items()]
    alike = []  # releases from a share of the load, which of the models loses contact longer
    for load, statement in LOADS.items():
        alike.append(row(f"{statement}: points longer", f"points_longer_{load}"))
        alike.append(row("\\quad line longer", f"line_longer_{load}"))
    damped = []  # known of the first group alone: the other cells stay empty
    for model, statement in COEXIST.items():
        share = entry(ensemble.coexist.get(model))
        damped.append([statement, share, *[""] * (len(GROUPS) - 1)])
    head = ["", *(f"{name} ({ensemble.groups[group]})" for group, name in GROUPS.items())]
    return tabular("lrrrr", head, [rows, alike, damped])
