"""Stiff contacts over one and ten support periods, and how far ahead they can be computed."""

import math

from squeal.article.report.latex import number, tabular
from squeal.article.studies.horizon import Horizon, Run

CAPTION = r"""Stiff contacts, from a start pressed in by twice the static depth: contact changes
and error of the default path against quad precision after one and ten support periods; horizons
at which the error passes $10^{-9}$ in doubles, by the second method, and in quad precision from a
start that is off by $10^{-15}$; Lyapunov exponent per support period, the horizon that it
predicts from $10^{-16}$, and the growth of an error by an impact. \emph{Beyond}: after the
horizon. A dash: not computed, or not within ten periods. Beyond the horizon a number of contact
changes is one of many that are as likely."""


def _count(changes: int | None) -> str:
    """Three digits: beyond the horizon no more are certain."""
    return "--" if changes is None else f"${float(f'{changes:.3g}'):.0f}$"


def _after(run: Run, periods: float) -> str:
    error = run.after(periods)
    if error is not None:
        return number(error, 1)
    lost = run.horizon is not None and run.horizon[0] < periods
    return r"\emph{beyond}" if lost else "--"


def table(horizon: Horizon) -> str:
    """The table in LaTeX, a row per stiffness, a group per model."""
    groups = []
    for model in ("B1", "B2"):
        rows = []
        for run in horizon.with_model(model):
            power = f"$10^{{{round(math.log10(run.stiffness))}}}$"
            # the least horizon of several runs; of the other two columns that at the first level
            in_doubles = None if run.horizon is None else run.horizon[0]
            predicted = run.predicted if run.exponent > 0.0 else None
            rows.append(
                [
                    f"{model}, {power}",
                    _count(run.one),
                    _count(run.ten),
                    _after(run, 1.0),
                    _after(run, 10.0),
                    number(in_doubles, 2),
                    number(run.independent[0], 2),
                    number(run.start[0], 2),
                    number(run.exponent, 2),
                    number(predicted, 2),
                    f"${run.per_impact:.2f}$",
                ]
            )
        groups.append(rows)
    # a head of two lines: `tabular` takes one, so that the upper one is put before its first cell
    upper = [
        "",
        r"\multicolumn{2}{c}{changes in}",
        r"\multicolumn{2}{c}{error after}",
        r"\multicolumn{3}{c}{horizon}",
        r"\multicolumn{2}{c}{exponent}",
        "growth",
    ]
    head = ["stiffness over $k_1$", "1", "10", "1", "10", "doubles", "second", "start"]
    head += ["", "predicts", "by impact"]
    head[0] = " & ".join(upper) + r" \\" + "\n" + head[0]
    return tabular("lrrrrrrrrrr", head, groups)
