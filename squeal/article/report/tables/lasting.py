"""What lasts with damping."""

from squeal.article.report.latex import number, percent, tabular
from squeal.article.studies.energy import motion_title
from squeal.article.studies.onset import Onset

CAPTION = r"""Motions with damping and sustained loss of contact. Each is seen for
\val[n]{onset.seen} observation times after \val[n]{onset.longer}. Reference: whether the reference
initial conditions lead to it. Others: how many do of those from a box of half-width
\val[2]{onset.box} static compressions (seed \val[n]{onset.seed}). Of the liveliest motion: shares
of time with an edge and with both edges separated; peak contact force over $F_n$ at the leading
edge, at the trailing edge and of their sum (the line has one reaction); changes of the edge
struck; whether it hammers. Growth: greatest real part of the eigenvalues about the equilibrium."""


def table(onset: Onset) -> str:
    """A row a motion and damping ratio."""
    rows = []
    for name, every in onset.after.items():
        for row in every:
            lively = row.liveliest
            if lively is None:
                continue
            own = "yes" if row.own and row.own.goes_on else "no"
            rows.append(
                [motion_title(name), percent(row.ratio), own, f"{row.lasting} of {row.starts}"]
                + [percent(lively.lost, 0), percent(lively.airborne, 0)]
                + [number(one, 3) for one in (lively.leading, lively.trailing, lively.peak)]
                + [str(lively.turns)]
                + ["yes" if lively.hammers else "no", number(row.growth, 2)]
            )
    head = ["", r"$\zeta$", "reference", "others", "lost", "both off"]
    head += ["leading", "trailing", "sum", "turns", "hammers", "growth, 1/ms"]
    return tabular("lrrrrrrrrrlr", head, [rows])
