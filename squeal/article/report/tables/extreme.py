"""Stiff, degenerate and extreme cases."""

from squeal.article.report.latex import long_table, number, typeset
from squeal.article.studies.extreme import Extreme

CAPTION = r"""Stiff and extreme cases: outcome, relative error (of the final place; of the contact
times in closed forms; of the energy in long runs), contact changes, and what the error is measured
against."""


def table(extreme: Extreme) -> str:
    """A row a case."""
    rows, group = [], ""
    for case in extreme.cases:
        first = "" if case.group == group else typeset(case.group)
        group = case.group
        cells = [first, typeset(case.name), case.outcome, number(case.error, 2)]
        cells += [str(case.changes), typeset(case.against)]
        rows.append(cells)
    return long_table(["", "case", "outcome", "error", "changes", "against"], rows)
