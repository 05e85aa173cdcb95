"""Stiff, degenerate and extreme cases."""

import math

from squeal.article.records import bound
from squeal.article.report.latex import long_table, number, typeset
from squeal.article.studies.extreme import Extreme

ROUNDING = 1e-12
CAPTION = r"""Stiff and extreme cases: outcome, relative error (of the final place; of the contact
times in closed forms; of the energy in long runs), contact changes, and what the error is measured
against."""


def _error(value: float | None) -> str:
    """An error; of one that is rounding, which each processor has its own, what it stays below."""
    if value is None or math.isnan(value) or abs(value) >= ROUNDING:
        return number(value, 2)
    return f"$<$ {typeset(bound(value))}"


def table(extreme: Extreme) -> str:
    """A row a case."""
    rows, group = [], ""
    for case in extreme.cases:
        first = "" if case.group == group else typeset(case.group)
        group = case.group
        cells = [first, typeset(case.name), case.outcome, _error(case.error)]
        cells += [str(case.changes), typeset(case.against)]
        rows.append(cells)
    return long_table(["", "case", "outcome", "error", "changes", "against"], rows)
