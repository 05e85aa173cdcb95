"""The coupling figure shows what it is given: thresholds, growing modes, units."""

import numpy as np
import pytest

from squeal.analysis.pads import ModeSweep
from squeal.linear import thresholds, track
from squeal.plots.coupling import coupling_figure
from tests.known import coupled


def artists(figure, gid):
    found = [a for axes in figure.axes for a in [*axes.get_lines(), *axes.patches]]
    return [a for a in found if a.get_gid() == gid]


def test_the_background_changes_at_the_threshold_and_the_growing_mode_is_said():
    modes, found = track(coupled, np.linspace(0.0, 1.0, 201)), thresholds(coupled, 1.0)
    (point,) = found.points
    spans = (0.0, point.mu, "marginal"), (point.mu, 1.0, "flutter")
    sweep = ModeSweep(0.0, 1.0, 1.0, modes.mus, modes.values, spans, tuple(found.crossings), ())
    figure = coupling_figure(sweep, own=0.6)
    shaded = artists(figure, "flutter")
    assert len(shaded) == 2  # of frequency and growth
    for span in shaded:
        assert span.get_x() == pytest.approx(0.75, rel=1e-12)
        assert span.get_x() + span.get_width() == pytest.approx(1.0)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words[0] == r"flutter from $\mu$ = 0.75, 0.2251 Hz"
    assert r"present $\mu$ = 0.6" in words
    (thick,) = [a for k in (1, 2) for a in artists(figure, f"grows {k}")]
    mu, frequency = thick.get_data()
    shown = np.isfinite(frequency)
    assert mu[shown].min() > 0.75 - 1e-9
    assert mu[shown].max() == 1.0
    # omega^2 = 2 + i sqrt(4 mu / 3 - 1) at mu = 1
    assert frequency[-1] == pytest.approx(1.428577 / (2 * np.pi), rel=1e-5)
