"""Degenerate and extreme cases over ten support periods."""

import math

from squeal.article.records import bound
from squeal.article.report.latex import long_table, number, typeset
from squeal.article.studies.extreme import LONG, Extreme, Outcome

ROUNDING = 1e-10
CAPTION = r"""Degenerate and extreme cases: time in support periods $2\pi\sqrt{m/k_1}$, outcome,
relative error of the final place against the second method, which is independent, and against quad
precision, which shows the rounding alone, contact changes, and any other measure of the error. Long
runs go beyond the horizon, so that their changes are one of many numbers as likely, given to a
digit."""


def _measure(case: Outcome) -> str:
    """Another measure of the error, or the message."""
    if case.outcome == "rejected":
        return typeset(case.against)
    if case.error is None:
        return ""
    return f"{typeset(case.against)}: {_error(case.error)}"


def _error(value: float | None) -> str:
    """An error; of one that is rounding, which each processor has its own, what it stays below."""
    if value is None or math.isnan(value) or abs(value) >= ROUNDING:
        return number(value, 2)
    return f"$<$ {typeset(bound(value))}"


def _changes(case: Outcome) -> str:
    """The number of contact changes."""
    if (case.periods or 0.0) < LONG:
        return str(case.changes)
    return rf"$\approx$ {number(float(case.changes), 1)}"


def table(extreme: Extreme) -> str:
    """The table in LaTeX, a row per case."""
    rows = []
    group = ""
    for case in extreme.cases:
        group_name = "" if case.group == group else typeset(case.group)  # in its first row alone
        group = case.group
        rows.append(
            [
                group_name,
                typeset(case.name),
                number(case.periods, 3),
                case.outcome,
                _error(case.independent),
                _error(case.rounding),
                _changes(case),
                _measure(case),
            ]
        )
    head = ["", "case", "periods", "outcome", "second method", "quad", "changes", "other measure"]
    return long_table(head, rows)
