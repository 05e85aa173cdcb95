"""What becomes of other initial conditions, from the study of the same name: a map per case."""

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from squeal.article.cases import short_title
from squeal.article.records import Missing, first_reason
from squeal.article.studies.starts import KINDS, WINDOWS, CaseMaps, Map, Starts
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

COLOURS = ("#E6F3FB", "#E69F00", "#3B0F4A", "#C8380E", "#4D4D4D")
"""By the kind of motion, apart in grey too."""
HALO = [withStroke(linewidth=2.2, foreground="w")]
CAPTION = r"""What becomes of initial conditions at rest after ten observation times without
damping, over height and tilt. Height: of the centre above the sliding equilibrium. Tilt: lift of
the trailing edge by rotation. Both are in static compressions of the contact, on points
$F_n/(k_3+k_4) = {}$\val[2]{starts.cases.b1-a.compression}\,$\mu$m and on the line
$F_n/k_c = {}$\val[3]{starts.cases.b2-a.compression}\,$\mu$m. Cross: equilibrium. Ring: height and
tilt of the reference initial conditions, in the colour of what becomes of these; they also lie off
the plane in $x$."""


def starts_figure(cases: dict[str, CaseMaps], reach: float) -> Figure:
    """Maps of the kinds of motion after the longest time, B1 above B2.

    Codes are indices of `KINDS`. reach: of the maps to each side, in static compressions.
    """
    palette = ListedColormap(list(COLOURS))
    norm = BoundaryNorm(np.arange(len(KINDS) + 1) - 0.5, len(KINDS))
    with style():
        figure = Figure(figsize=(DOUBLE, 3.9))
        grid = figure.subplots(2, 4, sharex=True, sharey=True)
        present = set()
        for axes, (name, case) in zip(grid.flat, cases.items(), strict=False):
            longest_map = longest(case)
            # (tilts, heights), as `pcolormesh` takes values at (y, x)
            codes = np.array([[int(digit) for digit in row] for row in longest_map.rows])
            reference_kind = longest_map.own  # of the reference initial conditions
            present |= {*codes.ravel().tolist(), reference_kind}
            edges = np.linspace(-reach, reach, len(codes) + 1)
            axes.pcolormesh(
                edges, edges, codes, cmap=palette, norm=norm, edgecolors="face", linewidth=0.4
            )
            # a cross at the equilibrium, and a dot at the reference initial conditions
            axes.plot(0.0, 0.0, "+", color="k", ms=5, mew=0.9, path_effects=HALO)
            _x, height, tilt = case.reference
            colour = COLOURS[reference_kind]
            axes.plot(height, tilt, "o", mfc=colour, mec="k", ms=5, path_effects=HALO)
            axes.set_title(short_title(name), pad=3.0)
            axes.set_aspect("equal")
            axes.set_xticks([-1, 0, 1])
            axes.set_yticks([-1, 0, 1])
        figure.supxlabel("height above equilibrium [static compressions]", fontsize=8)
        figure.supylabel("tilt: lift of the trailing edge [static compressions]", fontsize=8)
        handles = [
            Patch(facecolor=COLOURS[k], edgecolor="k", linewidth=0.5, label=KINDS[k])
            for k in sorted(present)
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))
    return figure


def longest(case: CaseMaps) -> Map:
    """The map after the longest time."""
    return next(of_time for of_time in case.maps if of_time.windows == WINDOWS[-1])


def draw(record: Starts) -> Drawing:
    """The figure, ready to be saved."""
    title = "What the initial conditions decide"
    cases = {name: case for name, case in record.cases.items() if not isinstance(case, Missing)}
    if not cases:
        return blank(title, first_reason(record.cases.values()), __name__, record.provenance)
    parts = []
    for name, case in cases.items():
        share = longest(case).share
        _x, height, tilt = case.reference
        parts.append(
            f"{name} {100 * share['permanent contact']:.0f} % permanent contact, "
            f"{100 * share['hammering']:.0f} % hammering, reference at ({height:.2f}, {tilt:.2f})"
        )
    text = (
        "Maps over height and tilt of initial conditions about the equilibrium of each case, in "
        f"static compressions of the contact, up to {record.reach:g} to each side, coloured by "
        f"what becomes of the motion. {'; '.join(parts)}."
    )
    made = origin(__name__, record.provenance)
    return Drawing(starts_figure(cases, record.reach), text, title, made)
