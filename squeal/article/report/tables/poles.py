"""Poles of all cases, and friction as a loop gain."""

from squeal.article.cases import short_title
from squeal.article.records import Missing
from squeal.article.report.latex import number, tabular, typeset
from squeal.article.studies.eigenvalues import Eigenvalues, Loop

CAPTION = r"""Complex eigenvalues about the sliding equilibria by python-control, and the critical
friction of their loops. Frequencies and damping ratios of the three modes, with a damping of
\val[p1]{eigenvalues.ratio} in each mode at zero friction; negative: it grows. Critical: the
friction up to \val[2]{eigenvalues.greatest} at which a mode begins to grow, about the equilibrium
frozen at the reference friction (gain margin of the friction loop) and about the one that follows
friction. To $-1$: least distance of the Nyquist curve from there, for a stable loop that closes
through one reaction; it does not rank the cases by their margin in friction. At every friction the
poles lie within \val[1]{eigenvalues.agrees} of squeal's own eigenvalues, over the greatest
magnitude."""


def _row(name: str, loop: Loop) -> list[str]:
    """The row of a loop.

    It holds the frequencies (kHz) and damping ratios (%) of its modes, its critical friction about
    the frozen equilibrium and about the one that follows friction, and its modulus margin.
    """
    frequencies = [f"{pole.frequency_hz / 1e3:.2f}" for pole in loop.poles]
    ratios = []
    for pole in loop.poles:
        if pole.damping_ratio is None:
            ratios.append("--")
        else:
            ratios.append(f"${100 * pole.damping_ratio:.2f}$")
    return [
        short_title(name),
        loop.contact,
        ", ".join(frequencies),
        ", ".join(ratios),
        number(loop.frozen, 4),
        number(loop.followed, 4),
        number(loop.modulus, 2),
    ]


def table(eigenvalues: Eigenvalues) -> str:
    """The table in LaTeX, a row per case, a group per model."""
    groups: dict[str, list[list[str]]] = {}
    for name, loop in eigenvalues.loops.items():
        rows = groups.setdefault(name[:2], [])
        if isinstance(loop, Missing):
            reason = rf"\multicolumn{{6}}{{l}}{{{typeset(loop.reason)}}}"
            rows.append([short_title(name), reason])
        else:
            rows.append(_row(name, loop))
    head = ["case", "contact", "frequencies, kHz", r"damping ratios, \%"]
    critical = [r"$\mu$, frozen", r"$\mu$, following", "to $-1$"]
    return tabular("llllrrr", [*head, *critical], list(groups.values()))
