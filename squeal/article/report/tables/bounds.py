"""Bounds between which random parameter sets are drawn."""

from squeal.article.identify.space import LENGTH, STIFFNESS
from squeal.article.report.latex import number, tabular
from squeal.article.studies.ensemble import Bound, Ensemble

CAPTION = r"""Bounds of the random parameter sets. Numbers marked log are drawn uniformly in their
logarithm, the others uniformly; in each set both free lengths are equal, and the initial conditions
are the same in all four cases or, for half of the sets, the equilibrium without friction of each
case. Seed \val{ensemble.seed}; the surface moves at \val[n]{ensemble.speed}\,m/s for
$w = 40$\,mm, $m = 0.15$\,kg and $k_1 = 150$\,MN/m."""
NAMES = {
    "h": ("$h/w$", "half height"),
    "inertia": ("$I$ over a uniform rectangle's", "moment of inertia"),
    "k2": ("$k_2/k_1$", "second spring"),
    "k3": ("$k_3/k_1$", "B1, leading contact"),
    "k4": ("$k_4/k_1$", "B1, trailing contact"),
    "k_c": ("$k_c/k_1$", "B2, line contact"),
    "L": ("$L/w$", "free lengths"),
    "mu": (r"$\mu$", "friction, brake linings"),
    "F_n": ("$F_n$, kN", "brake force"),
    "preload": (r"$k_c\,(-y_0 - y(0))/F_n$", "B2, load of the initial position"),
    "lift": ("$y(0)\\,k_1/F_n$", "B2, height over relaxed springs"),
    "first_y": ("$-(k_3+k_4)\\,y(0)/F_n$", "B1, load of the initial position"),
    "first_x": ("$x(0)\\,k_1/F_n$", "initial position"),
    "tilt": (r"$\theta_0\,k_1 w/F_n$", "tilt beyond 1 or $-1$, level between"),
    "x0": ("$x_0/w$", "B2, place of the frame"),
}


def _ends(bound: Bound) -> list[str]:
    scale = STIFFNESS * LENGTH / 1e3 if bound.name == "F_n" else 1.0
    return [number(scale * end, 3) for end in (bound.low, bound.high)]


def table(ensemble: Ensemble) -> str:
    """The table in LaTeX, a row per number."""
    rows = []
    for bound in ensemble.bounds:
        if bound.name != "start":
            rows.append([*NAMES[bound.name], *_ends(bound), "log" if bound.log else ""])
    return tabular("llrrl", ["", "", "from", "to", ""], [rows])
