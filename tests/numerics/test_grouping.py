"""What lies close together on a line."""

from squeal.numerics.grouping import together


def test_neighbours_stand_together_in_a_chain():
    found = together([0.0, 0.1, 0.2, 0.5, 0.6, 1.5], 0.11, float)
    assert found == [[0.0, 0.1, 0.2], [0.5, 0.6], [1.5]]
    assert together(["a", "bb", "ccc"], 1, len) == [["a", "bb", "ccc"]]
    assert together([], 1.0, float) == []
