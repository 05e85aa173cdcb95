"""Figures: style, drawing parts, and functions that take results and return a matplotlib Figure.

    from squeal.plots import coupling_figure
    coupling_figure(sweep_modes(scene, 0.0, 1.0)).savefig("coupling.png")

The names below are loaded when they are first used.
"""

import importlib
from typing import Any

_HOME = {
    "contour_figure": "maps",
    "coupling_figure": "coupling",
    "draw": "answers",
    "mode_figure": "modes",
    "scatter_figure": "scatter",
    "stability_figure": "maps",
}
__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'squeal.plots' has no attribute {name!r}")
    return getattr(importlib.import_module(f"squeal.plots.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
