"""Works and energies of the motions."""

from squeal.article.records import Missing
from squeal.article.report.latex import number, tabular, typeset
from squeal.article.studies.energy import Energy, motion_title

CAPTION = r"""Works in mJ until the end of each motion: of friction, of the brake force, and of
the contact law beyond what its potential gives back, positive and negative, with the number of
episodes of partial contact; greatest kinetic energy."""


def table(energy: Energy) -> str:
    """The table in LaTeX, a row per motion."""
    head = ["", "friction", "brake force", "law, positive", "episodes", "law, negative", "episodes"]
    groups: dict[str, list[list[str]]] = {}
    for name, motion in energy.motions.items():
        row = [motion_title(name)]
        if isinstance(motion, Missing):
            row.append(rf"\multicolumn{{7}}{{l}}{{{typeset(motion.reason)}}}")
        else:
            row += [number(1e3 * motion.friction, 3), number(1e3 * motion.load, 3)]
            for sign in (1, -1):  # works of the law, positive and negative
                works = [episode.fed for episode in motion.working_episodes(sign)]
                row += [number(1e3 * sum(works), 3) if works else "0", str(len(works))]
            row.append(number(1e3 * motion.kinetic, 3))
        model = name.partition("-")[0]
        groups.setdefault(model, []).append(row)
    return tabular("lrrrrrrr", [*head, "kinetic"], list(groups.values()))
