"""Names and numbers of what the report is made of; light, since the workflow reads it each time."""

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.studies import STUDIES

FIGURES = range(1, 14)
RESULTS = (*HISTORY_FIGURES, *STUDIES)
"""All results that the report rests on."""
LOCI_FIGURES = ("coupling", "loci", "modes")
"""Figures of the stability chapter that are drawn from results/loci.json."""
CHAPTER_FIGURES = (*LOCI_FIGURES, "growth", "maps")
"""Figures of the stability chapter, which the article has not."""
CHAPTER_FILES = ("stability-values.tex", "literature.tex", "advice.tex", "thresholds.tex")
"""Files that the chapter reads from paper/generated."""
TABLES = (
    "values.tex",
    "table-1.tex",
    "table-2.tex",
    "parameters.tex",
    "eigenvalues.tex",
    "claims.tex",
    "findings.tex",
    "origin.tex",
)
"""Files that the report reads from paper/generated."""
IDENTIFICATION_FILES = ("identification-values.tex", "formulations.tex", "ranges.tex")
"""Files that the section on identification reads from paper/generated."""
EXTREME_FILES = ("extreme-values.tex", "extreme.tex", "accuracy.tex")
"""Files that the section on extreme cases reads from paper/generated."""
PRECISION_FIGURES = ("precision", "linear")
"""Figures of that section, drawn from results/precision.json."""
PRECISION_FILES = ("precision-values.tex", "speed.tex", "linear-speed.tex")
"""Files that the section on error against run time reads from paper/generated."""
