"""How the cases that hammer depend on the definition."""

from squeal.article.report.latex import tabular
from squeal.article.studies.hammering import WINDOWS, Hammering

CAPTION = r"""Cases that hammer by the least impulse of a blow (over $F_n T_1$) and by the
observation time. The definition takes \val[2]{hammering.level}."""


def table(hammering: Hammering) -> str:
    """A row a level, a column a model and observation time."""
    levels = dict.fromkeys(key.split(", ")[0] for key in hammering.hammering)
    rows = [
        [
            level,
            *(
                ", ".join(hammering.hammering[f"{level}, {w}"][model]) or "--"
                for model in ("B1", "B2")
                for w in WINDOWS
            ),
        ]
        for level in levels
    ]
    times = ["$T$" if w == 1 else f"${w}T$" for w in WINDOWS]
    head = ["impulse", *(f"{model}, {time}" for model in ("B1", "B2") for time in times)]
    return tabular("r" + "l" * 6, head, [rows])
