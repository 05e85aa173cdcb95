"""Wilson's interval against SciPy's, which is slow to load."""

import pytest
from scipy.stats import binomtest
from scipy.stats import fisher_exact as of_scipy

from squeal.numerics.shares import fisher_exact, wilson


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


@pytest.mark.parametrize(
    ("counts", "totals"),
    [
        ((3, 9), (20, 20)),
        ((0, 4), (5, 7)),
        ((7, 7), (50, 50)),
        ((0, 0), (3, 4)),
        ((112, 17), (92_160,) * 2),
    ],
)
def test_whether_two_shares_differ_is_that_of_scipy(counts, totals):
    table = [counts, [n - k for k, n in zip(counts, totals, strict=True)]]
    other = of_scipy(table).pvalue
    assert fisher_exact(counts, totals) == pytest.approx(other, rel=1e-6)
    assert fisher_exact(counts[::-1], totals[::-1]) == pytest.approx(other, rel=1e-6)
