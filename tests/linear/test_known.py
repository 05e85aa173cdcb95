"""Thresholds of larger systems: known blocks under non-orthogonal transformations, both counts."""

import numpy as np
import pytest

from squeal.errors import InputError
from squeal.linear import thresholds
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula
from tests.known import known_system


@pytest.mark.parametrize("seed", range(20))
def test_every_known_threshold_is_found_and_none_invented(seed):
    rng = np.random.default_rng(seed)
    system, expected = known_system(int(rng.integers(4, 32)), rng, damped=bool(seed % 2))
    found = thresholds(system, 2.0)
    assert found.certified is not False
    crossings = sorted((c.mu, c) for c in found.crossings)
    assert len(crossings) == len(expected)
    for (mu, c), (at, kind, direction, omega) in zip(crossings, expected, strict=True):
        assert (c.kind, c.direction) == (kind, direction)
        assert mu == pytest.approx(at, rel=1e-9)
        assert c.interval[0] - 1e-14 <= at <= c.interval[1] + 1e-14
        assert 2 * np.pi * c.frequency_hz == pytest.approx(omega, rel=1e-7, abs=1e-7)


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize(("sign", "ends"), [(1.0, None), (1.0, 0.7), (-1.0, 0.7)])
def test_a_mode_that_is_undamped_at_the_start_grows_from_there_or_not(order, sign, ends, rng):
    """Its growth rate is a mu^order (mu - end), of which rounding hides the start."""
    L, R = (np.eye(5) + 0.4 * rng.normal(size=(5, 5)) for _ in range(2))
    w = np.array([1.0, 1.5, 2.1, 3.3, 4.7])

    def system(mu):
        a = sign * mu**order * (1.0 if ends is None else ends - mu)
        C = np.diag([-0.2 * a, 0.02, 0.03, 0.04, 0.05])
        return L @ R, L @ C @ R, L @ np.diag(w * w) @ R

    found = thresholds(system, 2.0)
    expected = [(0.0, "up")] if sign > 0 else []
    if ends is not None:
        expected.append((ends, "down" if sign > 0 else "up"))
    assert [c.direction for c in found.crossings] == [way for _, way in expected]
    for c, (mu, _) in zip(found.crossings, expected, strict=True):
        assert c.mu == pytest.approx(mu, rel=1e-9)
        assert 0.0 <= c.interval[0] <= mu <= c.interval[1] < mu + 1e-3
        assert 2 * np.pi * c.frequency_hz == pytest.approx(1.0, rel=1e-3)


def test_a_mass_matrix_without_symmetry_is_taken_and_a_singular_one_refused():
    K0, K1 = np.diag([4.5, 3.5, 20.0, 30.0]), np.zeros((4, 4))
    K1[0, 1], K1[1, 0] = 1.0, -1.0
    mixed = np.eye(4) + np.triu(np.full((4, 4), 0.3), 1)
    terms = (Term(mixed @ K0), Term(mixed @ K1, Formula("mu")))
    found = thresholds(TermSystem((Term(mixed),), (), terms), 2.0)
    assert [c.mu for c in found.crossings] == pytest.approx([0.5], rel=1e-10)
    mixed[3] = mixed[2]
    with pytest.raises(InputError, match="regular"):
        thresholds(lambda mu: (mixed, None, K0 + mu * K1), 2.0)
