"""Figs. 4-7 and 9-12: time histories of the article's cases."""

from pathlib import Path

from squeal.files.results import read_run
from squeal.plots.histories import drawing
from squeal.plots.style import Drawing


def draw(summary: Path, history: Path) -> Drawing:
    """From what `squeal simulate` wrote: the JSON summary and the CSV history."""
    return drawing(read_run(summary, history))
