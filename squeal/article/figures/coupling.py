"""Mode coupling: frequencies and growth rates over mu, from the results of `studies.loci`."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.article.cases import title
from squeal.article.figures import loci
from squeal.article.results.loci import Branch, Loci, Modes, SceneLoci
from squeal.plots.parts import LOOKS, draw_modes, mark_events
from squeal.plots.style import DOUBLE, Drawing, Unit, origin, state_label, style

UNITS = Unit(loci.KILOHERTZ, "kHz"), Unit(loci.PER_MS, "1/ms")
OWN: dict[str, Any] = {"mfc": "w", "mec": "k", "ms": 3.5, "mew": 0.7}


def _events(branch: Branch) -> list[tuple[float, str, str]]:
    """(mu, label, line style) of all that happens on the branch, sorted."""
    found = [(c.mu, state_label(c.into), ":") for c in branch.contact_changes]
    jumps = {mu for mu, _, _ in found}
    found += [(p.mu, p.kind, "--") for p in branch.thresholds if p.mu not in jumps]
    return sorted(found)


def _pair(scene: SceneLoci, upper: Axes, lower: Axes) -> None:
    branch, equilibrium = scene.branch, scene.equilibrium
    if isinstance(branch, Branch):
        values = (np.array(branch.real) + 1j * np.array(branch.imag)).T
        draw_modes(upper, lower, np.array(branch.mu), values, LOOKS, UNITS)
        if scene.leaves_axis:
            mark_events(_events(branch), upper, lower)
        else:  # above the middle mode there is room
            mark_events(_events(branch), upper, upper, height=0.72)
    else:
        upper.text(0.5, 0.5, "no branch", transform=upper.transAxes, ha="center")
    for axes in (upper, lower):
        axes.axvline(scene.mu, color="0.7", linewidth=0.6, zorder=0, gid="scene's mu")
    if isinstance(equilibrium, Modes):
        real, imag = np.array(equilibrium.real), np.array(equilibrium.imag)
        mark = loci.equilibrium_mark(equilibrium)
        mu = np.full(len(real), scene.mu)
        inside = imag >= 0.0
        upper.plot(mu[inside], imag[inside] / loci.KILOHERTZ, mark, gid="scene", **OWN)
        lower.plot(mu, real / loci.PER_MS, mark, gid="scene", **OWN)
    if not scene.leaves_axis:
        lower.remove()
        upper.tick_params(labelbottom=True)
    upper.set_title(title(scene.name), pad=3.0)


def coupling_figure(found: Loci) -> Figure:
    """For each model a row of frequencies over one of growth rates, where there are; one column a
    case."""
    grid_of = loci.rows(found)
    shape = 2 * len(grid_of), max(map(len, grid_of))
    moving = [any(scene.leaves_axis for scene in scenes) for scenes in grid_of]
    heights = [h for moves in moving for h in (1.7, 1.0 if moves else 1e-3)]
    with style():
        figure = Figure(figsize=(DOUBLE, 0.5 + 0.98 * sum(heights)))
        grid = figure.subplots(
            *shape, squeeze=False, sharex=True, sharey="row", height_ratios=heights
        )
        for i, scenes in enumerate(grid_of):
            upper, lower = grid[2 * i], grid[2 * i + 1]
            for scene, above, below in zip(scenes, upper, lower, strict=False):
                _pair(scene, above, below)
            upper[0].set_ylim(0.0, 1.07 * max(axes.dataLim.y1 for axes in upper))
            upper[0].set_ylabel("frequency [kHz]")
            shown = [axes for one, axes in zip(scenes, lower, strict=False) if one.leaves_axis]
            if shown:
                reach = 1.15 * max(abs(axes.dataLim.intervaly).max() for axes in shown)
                shown[0].set_ylim(-reach, reach)
                shown[0].set_ylabel("growth [1/ms]")
                shown[0].tick_params(labelleft=True)
                shown[0].yaxis.set_in_layout(shown[0] is lower[0])
        grid[0, 0].set_xlim(0.0, found.mu_max)
        grid[0, 0].set_xticks([0.0, 0.5, 1.0], ["0", "0.5", "1"])
        for scene, above, below in zip(grid_of[-1], grid[-2], grid[-1], strict=False):
            (below if scene.leaves_axis else above).set_xlabel(r"friction $\mu$")
        figure.legend(
            handles=_legend(found), loc="outside upper center", ncols=6, columnspacing=1.2
        )
    return figure


def _legend(found: Loci) -> list[Line2D]:
    def mark(label: str, **look: Any) -> Line2D:
        return Line2D([], [], label=label, **look)

    entries = [mark(f"mode {k}", **look) for k, look in enumerate(LOOKS, 1)]
    entries.append(mark(r"the scene's $\mu$", color="0.7", marker="o", **OWN))
    if loci.off_branch(found):
        entries.append(mark("off the branch", color="0.7", marker="^", **OWN))
    branches = [s.branch for s in found.scenes if isinstance(s.branch, Branch)]
    if any(branch.contact_changes for branch in branches):
        entries.append(mark("contact change", color="k", linestyle=":", linewidth=0.7))
    return entries


def alternative_text(found: Loci) -> str:
    """What the figure shows, with what happens on each branch."""
    told = []
    for scene in found.scenes:
        if not isinstance(scene.branch, Branch):
            told.append(f"{title(scene.name)}: no branch")
            continue
        events = [f"{label} at {mu:.3g}" for mu, label, _ in _events(scene.branch)]
        told.append(f"{title(scene.name)}: {', '.join(events) if events else 'no change'}")
    return (
        f"Frequencies above growth rates of the three modes over friction to {found.mu_max:g} "
        "along the equilibrium branch, one column a case. Where two frequencies meet, one mode "
        "begins to grow and its partner to decay. "
        f"Events over friction: {'; '.join(told)}. At the scenes' friction {loci.growths(found)}."
    )


def draw(found: Loci) -> Drawing:
    """The figure of `squeal.article.studies.loci` results, ready to be saved."""
    return Drawing(
        coupling_figure(found),
        alternative_text(found),
        "Mode coupling over the coefficient of friction",
        origin(__name__, found.provenance),
    )
