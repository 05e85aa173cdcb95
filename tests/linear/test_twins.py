"""Thresholds of nearly equal parts are told apart."""

import numpy as np
import pytest

import squeal


def beside(pads, apart, rest):
    """Rows pairs that diverge at sqrt(k h) / g, of equal pads but for a relative difference of k,
    and of others; with the exact thresholds."""
    K0 = []
    K1 = []
    exact = []
    for index in range(pads + rest):
        if index < pads:
            k = 1.21 * (1.0 + apart * index)
            h = 1.3
            g = 0.8
        else:
            k = 1.3225 + 0.11 * index
            h = 1.4
            g = 0.75
        K0 += [k, h]
        K1.append(g)
        exact.append(np.sqrt(k * h) / g)
    friction = np.kron(np.diag(K1), [[0.0, 1.0], [1.0, 0.0]])
    return squeal.System(np.eye(len(K0)), K={"1": np.diag(K0), "mu": friction}), sorted(exact)


NEAR = [((2, 0), 1e-7), ((2, 1), 1e-9), ((2, 1), 1e-3), ((3, 2), 3.5e-6), ((3, 2), 0.0)]


@pytest.mark.parametrize(("numbers", "apart"), [*NEAR, ((4, 6), 1e-7)])
def test_each_of_nearly_equal_pads_has_its_own_threshold(numbers, apart):
    pads, rest = numbers
    system, exact = beside(pads, apart, rest)
    found = squeal.thresholds(system, 8.0)
    assert [c.mu for c in found.crossings] == pytest.approx(exact, rel=1e-12)
    assert {c.kind for c in found.crossings} == {"divergence"}
    for crossing, value in zip(found.crossings, exact, strict=True):
        room = 1e-13 * value
        assert crossing.interval[0] - room <= value <= crossing.interval[1] + room
    assert found.proof is not None
    assert found.proof["status"] == "proved"


WINDOWS = [
    (0.52246391, 6.3e-7, 2.3e-6, 3.3e-5),
    (1.7, 5e-8, 1e-7, 1e-3),
]


@pytest.mark.parametrize(("centre", "inner", "outer", "blunt"), WINDOWS)
def test_two_windows_of_a_coupling_that_nearly_vanishes(centre, inner, outer, blunt):
    square = f"(mu - {centre})**2"
    factor = f"({square} - {inner})*({square} - {outer})/({square}**2 + {blunt})"
    K = {"1": np.array([[2.0, 0.0], [1.0, 2.0]]), factor: np.eye(2, k=1)}
    found = squeal.thresholds(squeal.System(np.eye(2), K=K), 2.0)
    ends = np.sqrt([outer, inner])
    exact = [*(centre - ends), *(centre + ends[::-1])]
    assert [c.mu for c in found.crossings] == pytest.approx(exact, rel=1e-8)
    assert [c.direction for c in found.crossings] == ["up", "down", "up", "down"]


@pytest.mark.parametrize("part", ["damping", "stiffness", "bump"])
def test_a_dip_within_a_step_is_seen_or_nothing_is_certified(part):
    """A factor that passes zero, or two frequencies, for a 2e-3 part of the range."""
    bump = "1e-6/((mu - 0.7312)**2 + 1e-6)"
    if part == "damping":
        C = {"1": np.diag([0.1, 0.3]), f"-0.2*{bump}": np.diag([1.0, 0.0])}
        system = squeal.System(np.eye(2), C, np.diag([1.0, 3.0]))
        half = 1e-3
    elif part == "stiffness":
        K = {"1": np.diag([1.0, 3.0]), f"-2*{bump}": np.diag([1.0, 0.0])}
        system = squeal.System(np.eye(2), K=K)
        half = 1e-3
    else:  # frequencies 0.2 apart, coupled by 0.2 at most
        K = {"1": np.diag([1.0, 1.2]), f"0.2*{bump}": np.eye(2, k=1) - np.eye(2, k=-1)}
        system = squeal.System(np.eye(2), K=K)
        half = 1e-3
    found = squeal.thresholds(system, 2.0)
    exact = [0.7312 - half, 0.7312 + half]
    assert [c.mu for c in found.crossings] == pytest.approx(exact, rel=1e-9)
