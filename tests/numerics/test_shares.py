"""Wilson's interval against SciPy's, which is slow to load."""

import pytest
from scipy.stats import binomtest

from squeal.numerics.shares import wilson


@pytest.mark.parametrize("confidence", [0.5, 0.95, 0.999])
@pytest.mark.parametrize(("count", "total"), [(0, 1), (1, 1), (0, 7), (3, 7), (7, 7), (96, 192)])
def test_the_interval_is_that_of_scipy(count, total, confidence):
    other = binomtest(count, total).proportion_ci(confidence, method="wilson")
    assert wilson(count, total, confidence) == pytest.approx(other, rel=1e-13, abs=0.0)


def test_it_holds_the_share_and_narrows_with_the_number():
    widths = []
    for total in (10, 100, 1000):
        low, high = wilson(3 * total // 10, total, 0.95)
        assert low < 0.3 < high
        widths.append(high - low)
    assert widths == sorted(widths, reverse=True)
