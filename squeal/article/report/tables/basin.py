"""Shares of initial conditions that lead to sustained loss of contact."""

from squeal.article.report.latex import percent, tabular
from squeal.article.studies.basin import Basin

CAPTION = r"""Initial conditions of case (d) that lead to sustained loss of contact beside stable
sliding, by how far they reach. Of \val[n]{onset.starts} drawn uniformly (seed \val[n]{basin.seed})
from a box about the sliding equilibrium, at a modal damping of \val[p1]{basin.ratio}. The
half-width is that of $x$, $y$ and $w\theta$ in static compressions, on points
$F_n/(k_3+k_4) = {}$\val[2]{basin.compression.b1-d}\,$\mu$m and on the line
$F_n/k_c = {}$\val[3]{basin.compression.b2-d-integral}\,$\mu$m, and that of their velocities over
$\sqrt{k_1/m}$. In brackets: exact interval of \val[p0]{basin.confidence} confidence."""
NAMES = {"b1-d": "points, B1 (d)", "b2-d-integral": "line, B2 (d)"}


def table(basin: Basin) -> str:
    """The table in LaTeX, a row per model, a column per half-width."""
    rows = []
    widths: list[str] = []
    for name, shares in basin.shares.items():
        widths = [f"${row.half_width:g}$" for row in shares]
        cells = []
        for row in shares:
            low = f"{100 * row.low:.0f}"
            cells.append(f"{percent(row.share, 0)} ({low} to {100 * row.high:.0f})")
        rows.append([NAMES[name], *cells])
    return tabular("l" + "r" * len(widths), ["half-width", *widths], [rows])
