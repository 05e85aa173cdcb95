"""What lasts with damping."""

from squeal.article.report.latex import number, percent, tabular
from squeal.article.studies.energy import motion_title
from squeal.article.studies.onset import Onset

CAPTION = r"""Motions with damping and sustained loss of contact, over \val[n]{onset.seen}
observation times after \val[n]{onset.longer}: whether from the reference initial conditions,
from how many others; of the liveliest the share of time with an edge separated, the peak force
over $F_n$, the changes of the edge struck, and whether it hammers; greatest real part of the
eigenvalues about the equilibrium."""


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
                + [percent(lively.lost, 0), number(lively.peak, 3), str(lively.turns)]
                + ["yes" if lively.hammers else "no", number(row.growth, 2)]
            )
    head = ["", r"$\zeta$", "reference", "others", "lost", "peak", "turns", "hammers"]
    return tabular("lrrrrrrlr", [*head, "growth, 1/ms"], [rows])
