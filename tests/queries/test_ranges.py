"""The pieces of a range that the printed intervals of thresholds leave to the proof."""

import numpy as np

from squeal.linear.events import Crossing
from squeal.queries.ranges import _intervals_of


def crossing(mu: float, start: float, stop: float) -> Crossing:
    """A flutter at mu whose interval is given."""
    return Crossing(mu, "flutter", "up", 1.0, (start, stop), 1, True)


def test_merged_intervals_hold_every_crossing():
    """A wide interval may begin before that of a crossing at a smaller value."""
    rng = np.random.default_rng(20261129)
    for _ in range(200):
        crossings = []
        for mu in rng.uniform(-0.5, 2.5, 6):
            below, above = rng.exponential(0.2, 2)
            crossings.append(crossing(mu, mu - below, mu + above))
        merged = _intervals_of(crossings, 0.0, 2.0, 0.0)
        ends = np.ravel(merged)
        assert np.all(np.diff(ends) > 0.0)
        for one in crossings:
            start, stop = np.clip(one.interval, 0.0, 2.0)
            if start < stop:
                assert any(low <= start and stop <= high for low, high in merged)
