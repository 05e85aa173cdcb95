"""All statements of the article with their verdicts."""

from squeal.article.report.latex import long_table, typeset
from squeal.article.studies.claims import Claims
from squeal.article.studies.sets import Sets

CAPTION = r"""Statements of the article about its results, in our words: what was measured with
the reference set, its verdict, and how many of the parameter sets satisfy the statement.
Statements that follow from others or from algebra, or that can be made true by a free number,
say so."""


def table(claims: Claims, sets: Sets) -> str:
    """The table in LaTeX, a row per statement."""
    rows = []
    for claim in claims.claims:
        verdict = rf"\verdict{{{claim.verdict}}}"
        if claim.kind != "informative":
            verdict += f" ({claim.kind}: {typeset(claim.derivation)})"
        satisfied = sum(claim.id not in of_set.failing for of_set in sets.sets.values())
        rows.append(
            [
                rf"\scriptsize {claim.id}",
                typeset(claim.where),
                typeset(claim.statement),
                typeset(claim.measured),
                verdict,
                f"{satisfied} of {len(sets.sets)}",
            ]
        )
    return long_table(["", "place", "statement", "measured", "verdict", "sets"], rows)
