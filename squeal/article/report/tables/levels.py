"""How the cases that hammer depend on the definition."""

from squeal.article.report.latex import tabular
from squeal.article.studies.hammering import WINDOWS, Hammering

CAPTION = r"""Cases that hammer by the least impulse of a blow (over $F_n T_1$) and by the
observation time. The definition takes \val[2]{hammering.level}."""
MODELS = ("B1", "B2")


def table(hammering: Hammering) -> str:
    """The table in LaTeX, a row per level, a column per model and observation time."""
    levels = dict.fromkeys(key.split(", ")[0] for key in hammering.hammering)
    head = ["impulse"]
    for model in MODELS:
        head += [f"{model}, {'$T$' if times == 1 else f'${times}T$'}" for times in WINDOWS]
    rows = []
    for level in levels:
        row = [level]
        for model in MODELS:
            for times in WINDOWS:
                cases = hammering.hammering[f"{level}, {times}"][model]
                row.append(", ".join(cases) or "--")
        rows.append(row)
    return tabular("r" + "l" * (len(head) - 1), head, [rows])
