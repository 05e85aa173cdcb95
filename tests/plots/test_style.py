"""Figures in files, and what is said where the disc is full."""

import errno
import itertools

import pytest
from matplotlib.figure import Figure

from squeal.plots import style
from squeal.plots.style import move_apart, write_beside


@pytest.mark.parametrize("kind", ["pdf", "svg", "png"])
@pytest.mark.parametrize("room", [0, 1000, 4000])  # where Matplotlib writes fonts of a PDF, too
def test_a_full_disc_is_told_as_such(monkeypatch, tmp_path, kind, room):
    class Full:
        written = 0

        def write(self, held):
            self.written += len(held)
            if self.written > room:
                raise OSError(errno.ENOSPC, "full")

        tell = flush = lambda self: self.written

    monkeypatch.setattr(style, "write_whole", lambda path, write: write(Full()))
    figure = Figure()
    figure.text(0.5, 0.5, "some words")
    figure.add_subplot().plot([1, 2])
    with pytest.raises(OSError, match="full"):
        style.save(style.Drawing(figure, "", "", ""), tmp_path / f"x.{kind}")


def test_a_label_lies_where_no_line_runs():
    """Beside a point between two upright lines there is room at the left of one of them alone."""
    figure = Figure(figsize=(3.0, 2.0))
    axes = figure.add_subplot(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    for x in (0.5, 0.6):
        axes.plot([x, x], [0.0, 1.0])
    write_beside(axes, "mode 12", (0.5, 0.5), (4, 0))
    move_apart(figure)
    (label,) = axes.texts
    box = label.get_window_extent().transformed(axes.transData.inverted())
    assert 0.0 < box.x0 < box.x1 < 0.5
    assert box.y0 < 0.5 < box.y1


def test_labels_at_one_point_are_moved_apart():
    figure = Figure(figsize=(3.0, 2.0))
    axes = figure.add_subplot()
    for text in ("mode 1", "mode 2", "mode 3"):
        write_beside(axes, text, (0.5, 0.5), (4, 4))
    move_apart(figure)
    boxes = [label.get_window_extent() for label in axes.texts]
    for one, other in itertools.combinations(boxes, 2):
        assert not one.overlaps(other)
