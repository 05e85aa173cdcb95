"""Mode coupling: frequencies and growth rates over friction, from the study `stability`."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.article.cases import title
from squeal.article.records import first_reason
from squeal.article.studies.stability import Branch, SceneStability, Stability
from squeal.plots.coupling import mark_events
from squeal.plots.modes import RED
from squeal.plots.style import DOUBLE, Drawing, blank, origin, state_label, style

CAPTION = r"""Frequencies and growth rates of the three modes along the sliding equilibria of model
B2 over friction, without damping: where two frequencies meet, one mode begins to grow (flutter)
until stability is regained. PC: partial contact begins. Grey vertical: the reference friction."""
SHOWN = ("b2-c", "b2-d")
LOOKS: list[dict[str, Any]] = [
    {"color": "#3498DB", "linestyle": "-"},
    {"color": "#6A1B7B", "linestyle": (0, (4, 1.5))},
    {"color": RED, "linestyle": (0, (5, 1.5, 1, 1.5))},
]
KHZ = 2e3 * np.pi  # in rad/s
PER_MS = 1e3  # in 1/s


def shown_branches(record: Stability) -> list[tuple[SceneStability, Branch]]:
    """The scenes that the figure shows, each with its branch; none without a branch."""
    shown = []
    for scene in record.scenes:
        if scene.name in SHOWN and isinstance(scene.branch, Branch):
            shown.append((scene, scene.branch))
    return shown


def _events(branch: Branch) -> list[tuple[float, str, str]]:
    """(mu, label, line style) of contact changes and thresholds on the branch, by rising mu.

    A threshold at a contact change is left out.
    """
    events = [(c.mu, state_label(c.into), ":") for c in branch.contact_changes]
    jumps = {c.mu for c in branch.contact_changes}
    for threshold in branch.thresholds:
        if threshold.mu not in jumps:
            label = "regained" if threshold.kind == "restabilised" else threshold.kind
            events.append((threshold.mu, label, "--"))
    return sorted(events)


def _draw_modes(
    upper: Axes,
    lower: Axes,
    mu: np.ndarray,
    values: np.ndarray,
) -> None:
    """Curves of each mode over mu (k,): its frequency above, its growth rates below.

    values (k, 2n) in rad/s, of n modes: columns 2j and 2j + 1 are the two eigenvalues of a mode,
    conjugates of one growth rate or real numbers of two. Modes beyond those of `LOOKS` have no
    curves.
    """
    pairs = np.split(values, values.shape[1] // 2, axis=1)
    for k, (look, pair) in enumerate(zip(LOOKS, pairs, strict=False), 1):
        upper.plot(mu, np.abs(pair[:, 0].imag) / KHZ, gid=f"mode {k}", **look)
        lower.plot(mu, pair.real / PER_MS, gid=f"mode {k}", **look)


def _column(scene: SceneStability, branch: Branch, upper: Axes, lower: Axes) -> None:
    """Draw the two panels of a scene."""
    upper.set_title(title(scene.name), pad=3.0)
    for axes in (upper, lower):
        axes.axvline(scene.mu, color="0.7", linewidth=0.6, zorder=0, gid="reference friction")
    values = (np.array(branch.real) + 1j * np.array(branch.imag)).T
    _draw_modes(upper, lower, np.array(branch.mu), values)
    mark_events(_events(branch), upper, lower)


def coupling_figure(record: Stability) -> Figure:
    """Frequencies over growth rates, a column per case."""
    shown = shown_branches(record)
    with style():
        figure = Figure(figsize=(DOUBLE, 3.2))
        layout: Any = {"sharex": True, "sharey": "row", "height_ratios": (1.7, 1.0)}
        grid = figure.subplots(2, len(shown), squeeze=False, **layout)
        for (scene, branch), upper, lower in zip(shown, *grid, strict=True):
            _column(scene, branch, upper, lower)
            lower.set_xlabel(r"friction $\mu$")
        # the panels of a row share limits, which show all that is drawn in them
        top = max(axes.dataLim.y1 for axes in grid[0])
        reach = max(abs(axes.dataLim.intervaly).max() for axes in grid[1]) or 1.0  # 1 if all are 0
        grid[0, 0].set(ylim=(0.0, 1.07 * top), ylabel="frequency [kHz]")
        grid[1, 0].set(ylim=(-1.15 * reach, 1.15 * reach), ylabel="growth [1/ms]")
        grid[0, 0].set(xlim=(0.0, record.mu_max), xticks=[0.0, 0.5, 1.0])
        handles = [Line2D([], [], label=f"mode {k}", **look) for k, look in enumerate(LOOKS, 1)]
        figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return figure


def draw(record: Stability) -> Drawing:
    """The figure, ready to be saved."""
    name = "Mode coupling over friction"
    parts = []
    for scene, branch in shown_branches(record):
        events = [f"{label} at {mu:.3g}" for mu, label, _ in _events(branch)]
        parts.append(f"{title(scene.name)}: {', '.join(events) or 'no change'}")
    if not parts:
        why = first_reason(scene.branch for scene in record.scenes)
        return blank(name, why, __name__, record.provenance)
    text = (
        "Frequencies above growth rates of the three modes over friction along the sliding "
        f"equilibria. {'; '.join(parts)}."
    )
    made = origin(__name__, record.provenance)
    return Drawing(coupling_figure(record), text, name, made)
