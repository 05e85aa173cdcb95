"""The parameter sets in SI units."""

from squeal.article.report.latex import number, tabular
from squeal.article.studies.sets import Sets

CAPTION = r"""Parameter sets in SI units. Tilt and all velocities are zero at the start."""
ROWS = {
    "m": ("$m$", "mass", "kg"),
    "w": ("$w$", "half width", "m"),
    "h": ("$h$", "half height", "m"),
    "I": ("$I$", "moment of inertia", r"kg\,m$^2$"),
    "k1": ("$k_1$", "leading spring", "N/m"),
    "k2": ("$k_2$", "trailing spring", "N/m"),
    "k3": ("$k_3$", "B1, leading contact", "N/m"),
    "k4": ("$k_4$", "B1, trailing contact", "N/m"),
    "k_c": ("$k_c$", "B2, line contact", "N/m"),
    "L1": ("$L_1 = L_2$", "free lengths", "m"),
    "mu": (r"$\mu$", "friction coefficient", "1"),
    "F_n": ("$F_n$", "brake force", "N"),
    "V": ("$V$", "surface speed", "m/s"),
    "x0": ("$x_0$", r"B2, place in the frame of $\delta$ (E5)", "m"),
    "y0": ("$y_0$", "B2, height of the face", "m"),
    "x": ("$x(0)$", "initial position", "m"),
    "y1": ("$y(0)$", "B1, initial height", "m"),
    "y2": ("$y(0)$", "B2, initial height", "m"),
    "T": ("$T$", "observation time", "s"),
}


def table(sets: Sets) -> str:
    """The table in LaTeX, a column per set."""
    rows = []
    for key, texts in ROWS.items():
        values = [number(one.parameters[key], 5) for one in sets.sets.values()]
        rows.append([*texts, *values])
    head = ["", "", "unit", *(name.replace("-", " ") for name in sets.sets)]
    return tabular("lll" + "r" * len(sets.sets), head, [rows])
