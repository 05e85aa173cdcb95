"""Upper bounds: never below the value, with the requested digits."""

import math

import pytest

from squeal.article.records import rounded_up


@pytest.mark.parametrize(
    ("value", "digits", "bound"),
    [
        (1.32e-13, 2, 1.4e-13),
        (1.047e-15, 2, 1.1e-15),
        (298.7, 2, 300.0),
        (0.999, 1, 1.0),
        (0.25, 2, 0.25),  # as it is
        (-0.259, 2, -0.25),
        (0.0, 2, 0.0),
        (math.inf, 2, math.inf),
    ],
)
def test_bounds_are_rounded_up(value, digits, bound):
    assert rounded_up(value, digits) == bound
    assert rounded_up(value, digits) >= value
