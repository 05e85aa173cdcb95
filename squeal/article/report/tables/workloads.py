"""Evaluations that each integrator needs for the same error."""

from squeal.article.report.latex import tabular, typeset
from squeal.article.studies.accuracy import OWN, Accuracy

CAPTION = r"""Evaluations of the right-hand side for a relative error of the final place of at most
$10^{-10}$ with every contact change found, and in brackets the multiple of squeal's. A dash: not
reached before the integrator takes \val[n]{accuracy.patience} evaluations. LSODA's numbers vary by
some per cent with the processor."""


def table(accuracy: Accuracy) -> str:
    """The table in LaTeX, a row per integrator, a column per case."""
    if not accuracy.points:
        return tabular("l", [""], [[[typeset(accuracy.left_out)]]])
    rows = []
    for path in dict.fromkeys(point.path for point in accuracy.points):
        cells = [typeset(path)]
        for case in accuracy.changes:
            count = accuracy.least(case, path)
            by_squeal = accuracy.least(case, OWN)
            if count is None or by_squeal is None:
                cells.append("--")
            elif path == OWN:
                cells.append(str(count))
            else:
                cells.append(f"{count} ({count / by_squeal:.1f})")
        rows.append(cells)
    return tabular("l" + "r" * len(accuracy.changes), ["", *accuracy.changes], [rows])
