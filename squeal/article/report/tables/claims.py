"""All statements of the article with their verdicts."""

from squeal.article.claims.judging import JudgedClaim
from squeal.article.report.latex import cells, long_table, typeset
from squeal.article.studies.claims import Claims
from squeal.article.studies.sets import Sets

CAPTION = r"""Statements of the article about its results, in our words: what was measured with
the reference set, its verdict, and how many of the parameter sets satisfy the statement.
Statements that follow from others or from algebra, or that can be made true by a free number,
say so."""


def table(claims: Claims, sets: Sets) -> str:
    """A row a statement."""
    every = list(sets.sets.values())

    def satisfied(claim: JudgedClaim) -> str:
        return f"{sum(claim.id not in one.failing for one in every)} of {len(every)}"

    def verdict(claim: JudgedClaim) -> str:
        reproduced = rf"\verdict{{{claim.verdict}}}"
        if claim.kind == "informative":
            return reproduced
        return f"{reproduced} ({claim.kind}: {typeset(claim.derivation)})"

    columns = {
        "": lambda c: rf"\scriptsize {c.id}",
        "place": lambda c: typeset(c.where),
        "statement": lambda c: typeset(c.statement),
        "measured": lambda c: typeset(c.measured),
        "verdict": verdict,
        "sets": satisfied,
    }
    return long_table(*cells(columns, claims.claims))
