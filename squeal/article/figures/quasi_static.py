"""Fig. 13: where the conditions (23a, b) for quasi-static sliding hold."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from squeal.article.cases import CASES
from squeal.article.outline import angle_axes_of_pi, draw_areas, mark
from squeal.article.studies.angles import PARTIAL, Angles
from squeal.article.studies.quasi_static import QuasiStatic
from squeal.plots.style import DOUBLE, Drawing, origin, style

Marks = Mapping[str, tuple[float, float]]
"""Letters of cases with their (alpha1, alpha2) in rad."""


def quasi_static_figure(record: QuasiStatic, angles: Angles, marks: Marks) -> Figure:
    """Fig. 13 as printed, beside it with the correct signs and what equilibria of B2 there are.

    The regions are black as in the article, within their traced boundaries.
    """
    quiet = np.arange(4) >= PARTIAL
    panels = {
        f"(a) as printed: {100 * record.share.as_printed:.1f} %": record.as_printed,
        f"(b) correct signs: {100 * record.share.sign_aware:.1f} %": record.sign_aware,
        f"(c) no growing mode: {100 * angles.share.quiet:.1f} %": angles.b2.regrouped(
            quiet.astype(int)
        ),
    }
    ring = {"boxstyle": "circle,pad=0.15", "ec": "#C8380E", "lw": 1.0}
    with style():
        figure = Figure(figsize=(DOUBLE, 2.75))
        axes = figure.subplots(1, 3, sharey=True)
        for one, (title, outline) in zip(axes, panels.items(), strict=True):
            draw_areas(one, outline, ("white", "black"), np.pi)
            mark(one, marks, np.pi, 8, **ring)
            one.set_title(title, pad=8.0)
            angle_axes_of_pi(one)
        for one in axes[1:]:
            one.set_ylabel("")
    return figure


def alternative_text(record: QuasiStatic, angles: Angles) -> str:
    """The maps in words."""
    printed, signs, quiet = (
        f"{100 * share:.1f} % of the map"
        for share in (record.share.as_printed, record.share.sign_aware, angles.share.quiet)
    )
    return (
        "Three maps over the spring angles alpha1 and alpha2 from 0 to pi at the friction "
        f"coefficient {record.mu:g}, black where: (a) the conditions (23a) and (23b) hold as "
        f"printed, {printed}; (b) they hold with the correct signs of the divisors, {signs}; (c) "
        f"model B2 has a sliding equilibrium about which no mode grows, {quiet}. Letters mark the "
        "cases."
    )


def draw(record: QuasiStatic, angles: Angles, marks: Marks = CASES) -> Drawing:
    """The figure, ready to be saved."""
    title = "Map of the quasi-static sliding motion"
    made = origin(__name__, record.provenance, angles.provenance)
    figure = quasi_static_figure(record, angles, marks)
    return Drawing(figure, alternative_text(record, angles), title, made)


CAPTIONS = {
    "fig13": r"""Where \aeqs{23a}{23b} hold (black) at $\mu = {}$\val{quasi_static.mu}: (a)~as
printed, as in the article; (b)~with the correct signs of the divisors $K_{21}$ and $K_{31}$.
(c)~Where model B2 has a sliding equilibrium about which no mode grows. Letters mark the four
cases."""
}
