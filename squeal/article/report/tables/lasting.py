"""What lasts with damping."""

from squeal.article.report.latex import number, percent, tabular, with_spread
from squeal.article.studies.energy import motion_title
from squeal.article.studies.onset import Onset

CAPTION = r"""Motions with damping and sustained loss of contact: whether from the reference
initial conditions, from how many others; of the liveliest the share of time with an edge separated,
the peak force over $F_n$, the changes of the edge struck, and whether it hammers; greatest real
part of the eigenvalues about the equilibrium. Measured over \val[n]{onset.seen} observation times
after \val[n]{onset.longer}. In brackets: least and greatest value of repeats from initial
conditions changed by rounding, where they differ."""


def _share(value: float) -> str:
    return percent(value, 0)


def _force(value: float) -> str:
    return number(value, 3)


def table(onset: Onset) -> str:
    """A row a motion and damping ratio."""
    rows = []
    for name, every in onset.after.items():
        for place, row in enumerate(every):
            lively = row.liveliest
            if lively is None:
                continue
            at = f"after.{name}.{place}"
            own = "yes" if row.own and row.own.goes_on else "no"
            lasting = with_spread(row.lasting, onset.ends(f"{at}.lasting"), str)
            lost = with_spread(lively.lost, onset.ends(f"{at}.liveliest.lost"), _share)
            peak = with_spread(lively.peak, onset.ends(f"{at}.liveliest.peak"), _force)
            turns = with_spread(lively.turns, onset.ends(f"{at}.liveliest.turns"), str)
            hammers = "yes" if lively.hammers else "no"
            rows.append(
                [motion_title(name), percent(row.ratio), own, f"{lasting} of {row.starts}"]
                + [lost, peak, turns, hammers, number(row.growth, 2)]
            )
    head = ["", r"$\zeta$", "reference", "others", "lost", "peak", "turns", "hammers"]
    return tabular("lrrrrrrlr", [*head, "growth, 1/ms"], [rows])
