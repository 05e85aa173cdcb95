"""What lasts with damping."""

from collections.abc import Callable

from squeal.article.report.latex import number, percent, tabular, with_spread
from squeal.article.studies.energy import motion_title
from squeal.article.studies.onset import Onset, Settled

CAPTION = r"""Motions with damping and sustained loss of contact. Each is seen for
\val[n]{onset.seen} observation times after \val[n]{onset.longer}. Reference: whether the reference
initial conditions lead to it. Others: how many do of those from a box of half-width
\val[2]{onset.box} static compressions (seed \val[n]{onset.seed}). Of the liveliest motion: shares
of time with an edge and with both edges separated; peak contact force over $F_n$ at the leading
edge, at the trailing edge and of their sum (the line has one reaction); changes of the edge
struck; whether it hammers. Growth: greatest real part of the eigenvalues about the equilibrium.
In brackets: least and greatest value of \val[n]{onset.repeats} repeats from initial conditions
changed by rounding."""


def _share(value: float | None) -> str:
    return number(value) if value is None else percent(value, 0)


def _force(value: float | None) -> str:
    return number(value, 3)


LIVELIEST: dict[str, Callable[..., str]] = {
    "lost": _share,
    "airborne": _share,
    "leading": _force,
    "trailing": _force,
    "peak": _force,
    "turns": str,
}
"""What is shown of the liveliest motion, and how."""


def _lively(onset: Onset, lively: Settled, key: str) -> list[str]:
    """The cells of the liveliest motion with their spreads; key: of its row in the result."""
    cells = []
    for name, show in LIVELIEST.items():
        ends = onset.ends(f"{key}.liveliest.{name}")
        cells.append(with_spread(getattr(lively, name), ends, show))
    return cells


def table(onset: Onset) -> str:
    """The table in LaTeX, a row per motion and damping ratio."""
    rows = []
    for name, rows_of_motion in onset.after.items():
        for i, row in enumerate(rows_of_motion):  # one for each damping ratio
            lively = row.liveliest
            if lively is None:  # no motion lasts: nothing to list
                continue
            key = f"after.{name}.{i}"  # of the row in the result, by which its spread is listed
            # whether the motion from the reference initial conditions lasts
            reference = "yes" if row.own and row.own.goes_on else "no"
            lasting = with_spread(row.lasting, onset.ends(f"{key}.lasting"), str)
            cells = [motion_title(name), percent(row.ratio), reference]
            cells.append(f"{lasting} of {row.starts}")
            cells += _lively(onset, lively, key)  # from `lost` to `turns` of the head
            cells.append("yes" if lively.hammers else "no")
            cells.append(number(row.growth, 2))
            rows.append(cells)
    head = ["", r"$\zeta$", "reference", "others", "lost", "both off"]
    head += ["leading", "trailing", "sum", "turns", "hammers", "growth, 1/ms"]
    return tabular("lrrrrrrrrrlr", head, [rows])
