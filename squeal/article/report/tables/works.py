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
    for name, one in energy.motions.items():
        row = [motion_title(name)]
        if isinstance(one, Missing):
            row.append(rf"\multicolumn{{7}}{{l}}{{{typeset(one.reason)}}}")
        else:
            row += [number(1e3 * one.friction, 3), number(1e3 * one.load, 3)]
            for sign in (1, -1):
                part = [episode.fed for episode in one.working_episodes(sign)]
                row += [number(1e3 * sum(part), 3) if part else "0", str(len(part))]
            row.append(number(1e3 * one.kinetic, 3))
        groups.setdefault(name[:2], []).append(row)
    return tabular("lrrrrrrr", [*head, "kinetic"], list(groups.values()))
