"""Modes with exactly one frequency: each has a number of its own, its conjugate the same."""

import numpy as np
import pytest

import squeal
from squeal.linear.paths import mode_numbers


@pytest.mark.parametrize("rows", [2, 3, 5])
@pytest.mark.parametrize("damping", [None, 300.0, -10.0])
def test_equal_pairs_have_a_number_each(rows, damping):
    """n equal oscillators: n equal pairs -c/2m +- i (k/m - (c/2m)^2)^(1/2)."""
    C = None if damping is None else damping * np.eye(rows)
    found = squeal.eigenvalues(squeal.System(10 * np.eye(rows), C, 1e6 * np.eye(rows)))
    assert found.modes.tolist() == np.repeat(np.arange(1, rows + 1), 2).tolist()
    assert [found.mode_of(mode) for mode in found.unstable] == (
        list(range(1, rows + 1)) if damping == -10.0 else []
    )


def test_pairs_of_one_frequency_and_different_growth_have_a_number_each():
    """-10 +- 100i and -20 +- 100i, from k = 100^2 + (c/2)^2."""
    system = squeal.System(np.eye(2), np.diag([20.0, 40.0]), np.diag([1e4 + 100, 1e4 + 400]))
    assert squeal.eigenvalues(system).modes.tolist() == [1, 1, 2, 2]


def test_conjugates_are_paired_one_to_one_in_any_order():
    values = np.array([1 - 2j, 3 - 2j, 1 + 2j, 1 - 2j, 1 + 2j, 3 + 2j])
    numbers = mode_numbers(values)
    assert sorted(numbers.tolist()) == [1, 1, 2, 2, 3, 3]
    for number in (1, 2, 3):
        assert np.sum(values[numbers == number]).imag == 0.0


def test_a_sweep_of_equal_oscillators_keeps_a_number_each():
    system = squeal.System(np.eye(3), {"1": np.eye(3), "mu": np.eye(3)}, 1e4 * np.eye(3))
    for step in squeal.sweep(system, [0.0, 1.0, 2.0]).steps:
        assert step.modes.tolist() == [1, 1, 2, 2, 3, 3]


def test_equal_real_roots_are_paired_fastest_with_slowest():
    """Two inverted pendulums: 1, 1, -1, -1."""
    found = squeal.eigenvalues(squeal.System(np.eye(2), K=-np.eye(2)))
    assert sorted(found.modes.tolist()) == [1, 1, 2, 2]
    assert sorted(found.mode_of(mode) for mode in found.unstable) == [1, 2]


def test_the_lowest_roots_have_the_numbers_that_they_have_among_all():
    """Three oscillators that creep, each with roots -a and -b: k/m = a b, c/m = a + b."""
    decay = np.array([[1.0, 60.0], [2.0, 50.0], [3.0, 40.0]])
    K = {"1": np.diag(decay.prod(axis=1)), "mu": np.eye(3)}
    system = squeal.System(np.eye(3), np.diag(decay.sum(axis=1)), K)
    every = squeal.eigenvalues(system)
    assert every.modes.tolist() == [1, 2, 3, 3, 2, 1]
    for count in range(1, 7):
        lowest = squeal.eigenvalues(system, modes=count)
        assert lowest.modes.tolist() == every.modes[:count].tolist()
        for step in squeal.sweep(system, [0.0, 0.1], modes=count).steps:
            assert step.modes.tolist() == lowest.modes.tolist()
    numbers = {row.mode for row in squeal.energy(squeal.eigenvalues(system, modes=3)).contributions}
    assert numbers == {1, 2, 3}
