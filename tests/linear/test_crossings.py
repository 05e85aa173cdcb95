"""Every crossing of the imaginary axis, against systems put together from closed forms."""

import numpy as np
import pytest

from squeal.linear import crossings, thresholds


def coupled(w, at, e):
    """Two modes of frequency w (rad/s) with the roots s = w^2 +- e sqrt(1 - mu/at)."""
    return lambda mu: np.array([[w * w, e * (1 - mu / at)], [e, w * w]])


def assembled(blocks, T, damping=None):
    """Blocks K(mu) (and coefficients of C for each) seen in coordinates T."""

    def system(mu):
        parts = [block(mu) for block in blocks]
        n, i = sum(map(len, parts)), 0
        K, C = np.zeros((n, n)), np.zeros((n, n))
        for k, part in enumerate(parts):
            own = slice(i, i + len(part))
            K[own, own] = part
            if damping is not None:
                C[own, own] = damping[k] * np.eye(len(part))
            i += len(part)
        return T.T @ T, None if damping is None else T.T @ C @ T, T.T @ K @ T

    return system


def assert_crossings(found, expected, rel=1e-8):
    """Expected (mu, kind, direction, frequency in Hz), each within the interval that is told."""
    assert [(c.kind, c.direction) for c in found] == [(k, d) for _, k, d, _ in expected]
    for c, (mu, _, _, frequency) in zip(found, expected, strict=True):
        assert c.mu == pytest.approx(mu, rel=rel)
        assert c.interval[0] - 1e-12 <= mu <= c.interval[1] + 1e-12  # of rounding in T' K T
        assert c.interval[1] - c.interval[0] < 100 * rel
        assert c.frequency_hz == pytest.approx(frequency, rel=1e-5, abs=1e-9)


def test_what_happens_while_other_modes_grow_is_listed():
    blocks = [coupled(1.5, 0.25, 0.4), coupled(5.0, 0.5, 3.0), lambda mu: np.array([[1 - mu]])]
    found = crossings(assembled(blocks, np.eye(5)), 1.2)
    frequency = np.array([1.5, 5.0]) / (2 * np.pi)
    expected = [(0.25, "flutter", "up", frequency[0]), (0.5, "flutter", "up", frequency[1])]
    assert_crossings(found, [*expected, (1.0, "divergence", "up", 0.0)])
    assert [c.changes_verdict for c in found] == [True, False, False]
    assert [c.mode for c in found] == [2, 4, 1]  # of five modes by frequency at each place
    back = crossings(lambda mu: assembled(blocks, np.eye(5))(1.2 - mu), 1.2)
    assert [c.direction for c in back] == ["down"] * 3
    assert [c.mu for c in back] == pytest.approx([0.2, 0.7, 0.95], rel=1e-9)


@pytest.mark.parametrize("n", [6, 12, 20])
def test_clustered_thresholds_and_frequencies(n):
    rng = np.random.default_rng(n)
    at = 0.5 + 1e-4 * np.arange(n // 2)
    w = 3.0 * (1 + 1e-4 * rng.permutation(n // 2))
    blocks = [coupled(a, b, 0.2) for a, b in zip(w, at, strict=True)]
    found = crossings(assembled(blocks, rng.normal(size=(n, n)) + 3 * np.eye(n)), 1.0)
    assert_crossings(
        found, [(a, "flutter", "up", b / (2 * np.pi)) for a, b in zip(at, w, strict=True)], 1e-8
    )


def test_equal_subsystems_cross_together():
    blocks = [coupled(2.0, 0.4, 0.3)] * 3
    found = crossings(assembled(blocks, np.eye(6)), 1.0)
    assert [(c.kind, c.direction) for c in found] == [("flutter", "up")] * 3
    assert [c.mu for c in found] == pytest.approx([0.4] * 3, rel=1e-6)


def test_nearly_defective_systems():
    # blocks feed each other one way, ten times as strongly as they are stiff
    rng = np.random.default_rng(5)
    w, at = np.array([1.0, 1.3, 1.7, 2.2, 2.9]), np.array([0.2, 0.35, 0.5, 0.65, 0.8])
    blocks = [coupled(a, b, 0.1 * a * a) for a, b in zip(w, at, strict=True)]
    plain, feed = assembled(blocks, np.eye(10)), np.triu(10 * rng.normal(size=(10, 10)), 2)
    feed[::2, 1::2] *= 1 - np.eye(5)
    found = crossings(lambda mu: (np.eye(10), None, plain(mu)[2] + feed), 1.0)
    assert_crossings(
        found, [(b, "flutter", "up", a / (2 * np.pi)) for a, b in zip(w, at, strict=True)], 1e-5
    )


def test_rotor_of_thirty_degrees_of_freedom():
    # internal damping drives whirl: z'' + (ce + ci) z' + (w^2 - i ci mu) z = 0 grows above
    # mu = w (1 + ce/ci); frequencies over four decades, where products over all pairs underflow
    w = np.geomspace(1.0, 1e4, 15)
    ci, ce = 0.01 * w, 0.02 * w
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    Q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(30, 30)))

    def system(mu):
        C = np.kron(np.diag(ce + ci), np.eye(2))
        K = np.kron(np.diag(w**2), np.eye(2)) + np.kron(np.diag(mu * ci), turn)
        return np.eye(30), Q.T @ C @ Q, Q.T @ K @ Q

    found = crossings(system, 200.0)
    expected = [3 * one for one in w if 3 * one < 200]
    assert [(c.kind, c.direction) for c in found] == [("flutter", "up")] * len(expected)
    for c, mu in zip(found, expected, strict=True):
        assert c.interval[0] <= mu <= c.interval[1]
        assert c.interval[1] - c.interval[0] < 1e-3 * mu
        assert c.frequency_hz == pytest.approx(mu / 3 / (2 * np.pi), rel=1e-4)
    (point, *_) = thresholds(system, 200.0).points
    assert point.mu == found[0].mu


def test_gyroscopic_forces_end_flutter():
    # z'' - i mu z' - k z = 0: lambda = i mu/2 +- sqrt(k - mu^2/4), undamped above mu = 2 sqrt(k)
    k = np.array([0.04, 0.09, 0.16])
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    T = np.random.default_rng(8).normal(size=(6, 6)) + 3 * np.eye(6)

    def system(mu):
        C = np.kron(np.eye(3), mu * turn)
        return T.T @ T, T.T @ C @ T, -T.T @ np.kron(np.diag(k), np.eye(2)) @ T

    found = crossings(system, 1.0, mu_min=0.1)
    assert_crossings(
        found, [(2 * np.sqrt(x), "flutter", "down", np.sqrt(x) / (2 * np.pi)) for x in k], 1e-6
    )
    assert [c.changes_verdict for c in found] == [False, False, True]


def test_divergent_roots_that_join_cross_nothing():
    # s = -2 +- sqrt(1 - mu): two divergent roots, then a growing pair
    for n in (2, 5):
        blocks = [lambda mu: np.array([[-2.0, 1 - mu], [1, -2]])]
        blocks += [lambda mu: np.diag([5.0, 7, 9])] * (n == 5)
        system = assembled(blocks, np.eye(n))
        found = thresholds(system, 2.0)
        assert found.crossings == []
        assert [(p.kind, round(p.mu, 9)) for p in found.points] == [("flutter", 1.0)]
