"""Reports of the two pairs, which are made once for each file."""

import pytest

import squeal
from tests.queries.remedies.pairs import two_pairs


@pytest.fixture(scope="module")
def trap():
    return squeal.report(two_pairs(0.4))


@pytest.fixture(scope="module")
def both():
    """Both pairs flutter."""
    return squeal.report(two_pairs(0.7))
