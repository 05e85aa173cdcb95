"""Numbers of the command line."""

import pytest

from squeal.cli.numbers import few


@pytest.mark.parametrize("n", [1, 2, 8, 9, 10, 18, 19, 26, 35, 100])
def test_few_values_hold_both_ends(n):
    values = [0.1 * k for k in range(n)]
    found = few(values, 9)
    assert found[0] == values[0]
    assert found[-1] == values[-1]
    assert len(found) == len(set(found)) == min(n, 9)
    assert sorted(found) == found
