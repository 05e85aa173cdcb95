"""Ranges far beyond a system's own scale of its parameter."""

import numpy as np
import pytest

from squeal.errors import InputError
from squeal.linear import thresholds
from squeal.linear.following.scale import FAR, MOST, divided
from tests.known import coupled


def ramp(scale):
    """s = 1 - p / scale, 2 and 3: the first changes by its own size at the scale."""
    return lambda p: (np.eye(3), None, np.diag([1.0 - p / scale, 2.0, 3.0]))


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e9])
def test_a_range_is_divided_only_far_beyond_the_scale(scale):
    near, far = 0.99 * FAR * scale, 1.01 * FAR * scale
    assert divided(ramp(scale), 0.0, near) == [0.0, near]
    found = divided(ramp(scale), 0.0, far)
    assert (found[0], found[-1], len(found)) == (0.0, far, 3)
    # wherever the range ends
    other = divided(ramp(scale), 0.0, 1e9 * scale)
    assert other[1] == pytest.approx(found[1], rel=1e-9)
    both = divided(ramp(scale), -far, 1e9 * scale)
    assert both[:3] == pytest.approx([-far, -other[1], 0.0], rel=1e-9)
    assert both[3:] == pytest.approx(other[1:], rel=1e-9)


def test_a_range_without_zero_or_a_scale_is_not_divided():
    def falls(p):
        if p == 0.0:
            raise InputError("p: is zero")
        return np.eye(3), None, np.diag([1.0, 2.0, 3.0 + 1 / p])

    assert divided(falls, 0.0, 1e9) == [0.0, 1e9]
    assert divided(lambda p: (np.eye(3), None, p * np.eye(3)), 0.0, 1e9) == [0.0, 1e9]


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


def test_a_range_that_double_precision_cannot_hold_is_refused():
    assert thresholds(ramp(1.0), 1e90).crossings[0].mu == pytest.approx(1.0, rel=1e-12)
    for end in (2 * MOST, 1e300):
        with pytest.raises(InputError, match=f"up to {end:g} is not allowed".replace("+", r"\+")):
            thresholds(ramp(1.0), end)


@pytest.mark.parametrize("low", [0.0, -0.5])
@pytest.mark.parametrize("rows", [2, 4])
@pytest.mark.parametrize("damping", [0.0, 1e-7])
def test_two_modes_that_meet_at_the_origin_tell_no_scale(low, rows, damping):
    """s = 4 +- sqrt(1 - (1 + p)^2): at zero eigenvectors coalesce, and are said to change by any
    p however small."""

    def system(p):
        K = np.diag([5.0, 3.0, 11.0, 13.0])[:rows, :rows]
        K[0, 1], K[1, 0] = 1 + p, -1 - p
        return np.eye(rows), damping * np.eye(rows) if damping else None, K

    assert divided(system, low, 1.0) == [low, 1.0]
    assert len(divided(system, 0.0, 1e6)) > 2
    found = thresholds(system, 1.0, mu_min=low)
    assert [c.mu for c in found.crossings] == pytest.approx([0.0], abs=1e-12)
    assert [c.direction for c in found.crossings] == ["up"]
