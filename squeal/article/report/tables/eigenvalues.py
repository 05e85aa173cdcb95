"""Complex eigenvalues about the sliding equilibria of both models."""

from squeal.article.cases import short_title
from squeal.article.records import Missing
from squeal.article.report.latex import number, tabular, typeset
from squeal.article.studies.eigenvalues import Eigenvalues

CAPTION = r"""Complex eigenvalues about the sliding equilibria without damping, computed with
python-control from the same matrices as \texttt{squeal eigenvalues}. Real parts of rounding size
are set to zero."""


def table(eigenvalues: Eigenvalues) -> str:
    """The table in LaTeX, a group of rows a case, a row for a pair or a real eigenvalue."""
    groups = []
    for scene, entry in eigenvalues.scenes.items():
        case = short_title(scene)
        if isinstance(entry, Missing):
            groups.append([[case, "--", rf"\multicolumn{{5}}{{l}}{{{typeset(entry.reason)}}}"]])
            continue
        rows = []
        # the first row alone names the case, its contact and its verdict
        contact = entry.contact
        verdict = entry.verdict
        for pole in entry.poles:
            sign = r"\pm" if pole.imag else ""
            rows.append(
                [
                    case,
                    contact,
                    number(pole.real, 4),
                    f"${sign}{pole.imag:.0f}$",
                    f"{pole.frequency_hz:.1f}",
                    number(pole.damping_ratio, 3),
                    verdict,
                ]
            )
            case = contact = verdict = ""
        groups.append(rows)
    head = ["case", "contact", "real part, 1/s", "imaginary part, rad/s", "frequency, Hz"]
    return tabular("llrrrrl", [*head, "damping ratio", "verdict"], groups)
