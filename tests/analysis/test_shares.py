"""Wilson's interval against SciPy's, which is slow to load."""

import pytest
from scipy.stats import binomtest

from squeal.analysis.variations import wilson


@pytest.mark.parametrize(("count", "total"), [(0, 1), (1, 1), (0, 7), (3, 7), (7, 7), (96, 192)])
def test_the_interval_is_that_of_scipy(count, total):
    for confidence in (0.5, 0.95, 0.999):
        other = binomtest(count, total).proportion_ci(confidence, method="wilson")
        assert wilson(count, total, confidence) == pytest.approx(other, rel=1e-13, abs=0.0)
