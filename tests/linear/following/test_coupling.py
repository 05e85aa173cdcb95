"""What couples two roots by way of others, against the sums term by term and exact roots."""

import numpy as np
import pytest

from squeal.linear.following.coupling import Couplings


@pytest.mark.parametrize("damped", [True, False])
def test_the_shifted_coupling_is_the_sum_over_third_roots(rng, damped):
    half = rng.normal(size=6) + 1j * rng.uniform(1.0, 5.0, 6)
    z = np.concatenate([half, half.conj(), rng.uniform(1.0, 9.0, 4)])
    z.real[:12] = np.abs(z.real[:12])
    n = len(z)
    W = rng.normal(size=(n, n)) + 1j * rng.normal(size=(n, n))
    of = Couplings.of(z, W, np.full(n, 1e-12), damped)
    pairs = set(zip(of.k.tolist(), of.l.tolist(), strict=True))
    assert pairs >= {(k, k + 6) for k in range(6)}  # conjugates
    assert ((0, 1) in pairs, (12, 15) in pairs, (6, 7) in pairs) == (damped, True, False)
    for i, ends in enumerate(zip(of.k, of.l, strict=True)):
        others = [m for m in range(n) if m not in ends]
        for row, (k, l) in enumerate((ends, ends[::-1])):
            terms = [W[k, m] * W[m, l] for m in others]
            shares = [(1 / (z[k] - z[m]) + 1 / (z[l] - z[m])) / 2 for m in others]
            assert of.indirect[row, i] == pytest.approx(np.dot(terms, shares), rel=1e-9)
            squares = [1 / abs(z[k] - z[m]) ** 2 + 1 / abs(z[l] - z[m]) ** 2 for m in others]
            assert of.alone[row, i] ** 2 == pytest.approx(np.dot(np.abs(terms) ** 2, squares))


def test_roots_bend_as_others_push_them(rng):
    z, x = np.array([1.0, 2.5, 4.0]), 1e-4
    W = rng.normal(size=(3, 3))
    roots = [np.sort(np.linalg.eigvals(np.diag(z) + s * x * W).real) for s in (-1, 0, 1)]
    second = (roots[0] - 2 * roots[1] + roots[2]) / x**2 / 2
    of = Couplings.of(z.astype(complex), W.astype(complex), np.full(3, 1e-15), False)
    for i, (k, l) in enumerate(zip(of.k, of.l, strict=True)):
        own = 2 * W[k, l] * W[l, k] / (z[k] - z[l])
        assert of.bend[i].real + own == pytest.approx(second[k] - second[l], rel=1e-4, abs=1e-5)
