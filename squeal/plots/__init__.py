"""Figures: style, drawing parts, and `draw`, which gives the figure of an answer.

What an answer draws by `answer.plot("picture.png")` is made here; Matplotlib loads with it.
"""

from squeal.plots.answers import draw

__all__ = ["draw"]
