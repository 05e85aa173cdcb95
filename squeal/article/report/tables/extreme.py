"""Degenerate and extreme cases over ten support periods."""

from squeal.article.report.latex import long_table, number, typeset
from squeal.article.studies.extreme import Extreme, Outcome

CAPTION = r"""Degenerate and extreme cases: time in support periods $2\pi\sqrt{m/k_1}$, outcome,
relative error of the final place against the second method, which is independent, and against quad
precision, which shows the rounding alone, contact changes, and any other measure of the error."""


def _measure(case: Outcome) -> str:
    """Another measure of the error, or the message."""
    if case.outcome == "rejected":
        return typeset(case.against)
    if case.error is None:
        return ""
    return f"{typeset(case.against)}: {number(case.error, 2)}"


def table(extreme: Extreme) -> str:
    """A row a case."""
    rows, group = [], ""
    for case in extreme.cases:
        first = "" if case.group == group else typeset(case.group)
        group = case.group
        cells = [first, typeset(case.name), number(case.periods, 3), case.outcome]
        cells += [number(case.independent, 2), number(case.rounding, 2)]
        cells += [str(case.changes), _measure(case)]
        rows.append(cells)
    head = ["", "case", "periods", "outcome", "second method", "quad", "changes", "other measure"]
    return long_table(head, rows)
