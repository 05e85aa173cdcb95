"""Ranges far beyond a system's own scale of its parameter."""

import numpy as np
import pytest

from squeal.linear import thresholds
from tests.known import coupled


def ramp(scale):
    """s = 1 - p / scale, 2 and 3: the first changes by its own size at the scale."""
    return lambda p: (np.eye(3), None, np.diag([1.0 - p / scale, 2.0, 3.0]))


@pytest.mark.parametrize("high", [10.0, 1e4, 1e9, 1e12])
@pytest.mark.parametrize("damping", [0.0, 0.02])
def test_thresholds_of_small_systems_are_told_to_rounding_on_every_range(high, damping):
    """omega^2 = 2 +- sqrt(1 - 4 mu / 3); with damping c flutter where Im lambda^2 = c omega."""

    def system(mu):
        return np.eye(2), damping * np.eye(2), coupled(mu)[2]

    (crossing,) = thresholds(system, high).crossings
    at = 0.75 * (1 + 2 * damping**2)
    assert crossing.mu == pytest.approx(at, rel=1e-9)
    assert crossing.interval[0] <= at * (1 + 1e-15)
    assert at * (1 - 1e-15) <= crossing.interval[1] <= crossing.interval[0] + 1e-9
