"""Figures: style, drawing parts, and `draw`, which gives the figure of an answer.

What an answer draws by `answer.plot("picture.png")` is made here; Matplotlib loads with it.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from squeal.plots.answers import draw

__all__ = ["draw"]


def __getattr__(name: str) -> Any:
    if name != "draw":
        raise AttributeError(f"module 'squeal.plots' has no attribute {name!r}")
    return import_module("squeal.plots.answers").draw
