"""Root loci: eigenvalues in the complex plane over mu, from the results of `studies.loci`."""

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.article.cases import title
from squeal.article.results.loci import Branch, Loci, Modes, SceneLoci, SingleLoop
from squeal.plots.parts import draw_locus
from squeal.plots.style import DOUBLE, Drawing, origin, style

KILOHERTZ, PER_MS = 2e3 * np.pi, 1e3
"""Units of the axes in rad/s and 1/s."""
RING: dict[str, Any] = {"mfc": "none", "mec": "#C8380E", "ms": 6}


def rows(found: Loci) -> list[list[SceneLoci]]:
    """The scenes of a result file in one row for each model."""
    models = dict.fromkeys(scene.model for scene in found.scenes)
    return [[s for s in found.scenes if s.model == model] for model in models]


def upper_half(part: Branch | SingleLoop | Modes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Growth (1/ms) and frequency (kHz) of the roots with Im >= 0, and where they stood in it."""
    real, imag = np.array(part.real), np.array(part.imag)
    inside = imag >= 0.0
    return real[inside] / PER_MS, imag[inside] / KILOHERTZ, np.argwhere(inside)


def equilibrium_mark(equilibrium: Modes) -> str:
    """Marker of the scene's own eigenvalues: another one where they are not on the branch."""
    return "o" if equilibrium.on_branch else "^"


def off_branch(found: Loci) -> bool:
    """Whether some scene's equilibrium is not on the branch from mu = 0."""
    own = [scene.equilibrium for scene in found.scenes]
    return any(isinstance(one, Modes) and not one.on_branch for one in own)


def _panel(axes: Axes, scene: SceneLoci) -> None:
    if isinstance(scene.loop, SingleLoop):
        growth, frequency, _ = upper_half(scene.loop)
        axes.plot(growth, frequency, "s", color="0.82", ms=8, mew=0.0, zorder=1, gid="loop")
    branch = scene.branch
    if isinstance(branch, Branch):
        growth, frequency, where = upper_half(branch)
        mu = np.array(branch.mu)[where[:, 1]]
        draw_locus(axes, growth, frequency, mu, (0.0, 1.0), 12.0)
    if isinstance(scene.equilibrium, Modes):
        growth, frequency, _ = upper_half(scene.equilibrium)
        mark = equilibrium_mark(scene.equilibrium)
        axes.plot(growth, frequency, mark, mew=0.9, gid="scene", **RING)
    axes.set_title(title(scene.name), pad=3.0)


def loci_figure(found: Loci) -> Figure:
    """One panel a scene whose roots leave the imaginary axis: frequency over growth, by mu."""
    found = replace(found, scenes=found.leaving)
    grid_of = rows(found)
    with style():
        figure = Figure(figsize=(DOUBLE, 0.9 + 1.75 * len(grid_of)))
        columns = max(map(len, grid_of))
        grid = figure.subplots(len(grid_of), columns, squeeze=False, sharex=True, sharey="row")
        for scenes, line in zip(grid_of, grid, strict=True):
            for scene, axes in zip(scenes, line, strict=False):
                _panel(axes, scene)
            line[0].set_ylabel("frequency [kHz]")
            top = max(axes.dataLim.y1 for axes in line)
            line[0].set_ylim(0.0, 1.07 * top)
        reach = max(abs(axes.dataLim.intervalx).max() for axes in grid.flat)
        reach = 1.15 * reach if np.isfinite(reach) and reach > 0.0 else 1.0
        grid[0, 0].set_xlim(-reach, reach)
        for axes in grid[-1]:
            axes.set_xlabel("growth rate [1/ms]")
        drawn = [c for axes in grid.flat for c in axes.collections]
        if drawn:
            figure.colorbar(drawn[0], ax=grid, label=r"friction $\mu$", aspect=40, pad=0.015)
        figure.legend(
            handles=_legend(found), loc="outside upper center", ncols=4, columnspacing=1.4
        )
    return figure


def _legend(found: Loci) -> list[Line2D]:
    def mark(label: str, marker: str, **look: Any) -> Line2D:
        return Line2D([], [], linestyle="", marker=marker, label=label, **look)

    entries = [
        mark(r"$\mu = 0$", "_", color="k", ms=11, mew=0.8),
        mark(r"the scene's $\mu$", "o", **RING),
    ]
    if off_branch(found):
        entries.append(mark(r"the scene's $\mu$, off the branch", "^", **RING))
    if any(isinstance(scene.loop, SingleLoop) for scene in found.scenes):
        entries.append(mark("friction loop, equilibrium held", "s", color="0.82", ms=8, mew=0.0))
    return entries


def growths(found: Loci) -> str:
    """Which scenes grow, in words."""
    growing = []
    for scene in found.scenes:
        if not isinstance(scene.equilibrium, Modes):
            continue
        rate = max(scene.equilibrium.real) / PER_MS
        if rate > 0.0:
            growing.append(f"{title(scene.name)} at {rate:.3g} per ms")
    return f"a mode grows in {'; '.join(growing)}" if growing else "no mode grows"


def draw(found: Loci) -> Drawing:
    """The figure of `squeal.article.studies.loci` results, ready to be saved."""
    text = (
        "One panel for each model and case whose roots leave the imaginary axis: eigenvalues of "
        "the upper half plane along the "
        f"equilibrium branch, coloured by friction to {found.mu_max:g}; frequency in kHz upwards, "
        "growth rate in 1/ms to the right. Ticks mark zero friction, rings the scene's. Pads whose "
        "eigenvalues stay on the imaginary axis are marginal; at the scenes' friction "
        f"{growths(found)}."
    )
    made = origin(__name__, found.provenance)
    return Drawing(loci_figure(found), text, "Root loci over the coefficient of friction", made)
