"""Large test systems from formulas, sparse, any size; benchmarks use them too."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from scipy.sparse import block_diag, coo_array, csc_array, diags_array, eye_array, kron

from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula


def _lattice(
    shape: Sequence[int], stiffness: float, offset: int, periodic: bool
) -> tuple[list[tuple[int, int]], list[np.ndarray], list[float]]:
    """Springs of a block of nodes to all neighbours: pairs of nodes, directions, stiffnesses."""
    nodes = np.arange(math.prod(shape)).reshape(shape) + offset
    pairs, ways, springs = [], [], []
    for way in itertools.product((-1, 0, 1), repeat=3):
        if way <= (0, 0, 0):
            continue
        length = math.sqrt(sum(w * w for w in way))
        for index in np.ndindex(*shape):
            other = [i + w for i, w in zip(index, way, strict=True)]
            if periodic:
                other[0] %= shape[0]
            if all(0 <= o < s for o, s in zip(other, shape, strict=True)):
                pairs.append((int(nodes[index]), int(nodes[tuple(other)])))
                ways.append(np.array(way) / length)
                springs.append(stiffness / length)
    return pairs, ways, springs


def disc_and_pad(cells: int, damping: float = 2e-6, name: str = "disc and pad") -> TermSystem:
    """A ring of 6 x `cells` nodes around and a pad on part of it, three-dimensional lattices.

    Normal contact springs join the faces; the friction force mu times the contact force acts along
    the ring, so K is not symmetric: K0 + mu K1. Some 3 x 6 c^2 (c + 2)/4 ... degrees of freedom;
    SI units of steel, audible frequencies. C = damping * K without friction + gyroscopic part.
    """
    ring = (6 * cells, cells, max(2, cells // 2))
    pad = (2 * cells, cells, max(2, cells // 2))
    at = math.prod(ring)
    p1, w1, s1 = _lattice(ring, 4e7, 0, True)
    p2, w2, s2 = _lattice(pad, 2.2e7, at, False)
    pairs, ways, springs = p1 + p2, w1 + w2, s1 + s2
    n = 3 * (at + math.prod(pad))
    ring_nodes, pad_nodes = np.arange(at).reshape(ring), np.arange(math.prod(pad)).reshape(pad) + at
    contact = [
        (int(ring_nodes[i + cells, j, -1]), int(pad_nodes[i, j, 0]))
        for i in range(pad[0])
        for j in range(pad[1])
    ]
    axial = np.array([0.0, 0.0, 1.0])
    elastic = _gaps(n, pairs, ways)
    K = elastic.T @ diags_array(np.array(springs)) @ elastic
    normal = _gaps(n, contact, [axial] * len(contact))
    along = _gaps(n, contact, [np.array([1.0, 0.1, 0.0])] * len(contact))
    k_contact = 6e6
    ground = np.zeros(n)
    ground[2 : 3 * at : 3 * ring[2]] = 3e5  # the ring sits on its bearings, the pad on its piston
    ground[3 * pad_nodes[:, :, -1].ravel() + 2] = 5e5
    ground[3 * pad_nodes[:, 0, -1]] = 2e6
    ground[3 * pad_nodes[:, 0, -1] + 1] = 2e6
    ground[: 3 * at : 3 * ring[2]] += 1e5
    ground[1 : 3 * at : 3 * ring[2]] += 1e5
    K0 = csc_array(K + k_contact * (normal.T @ normal) + diags_array(ground))
    K1 = csc_array(k_contact * (along.T @ normal))
    mass = np.repeat(np.where(np.arange(n // 3) < at, 2e-3, 1.1e-3), 3)
    M = csc_array(diags_array(mass))
    skew = coo_array(
        (np.full(at, 1e-3), (3 * np.arange(at), 3 * np.arange(at) + 1)), shape=(n, n)
    ).tocsc()
    C = csc_array(damping * K0 + skew - skew.T)
    return TermSystem(
        (Term(M),), (Term(C),), (Term(K0), Term(K1, Formula("mu"))), {"mu": 0.3}, "mu", name
    )


def _gaps(n: int, pairs: list[tuple[int, int]], ways: list[np.ndarray]) -> csc_array:
    """Elongation of springs from displacements (number of springs, n)."""
    a, b = np.array(pairs).T
    way = np.array(ways)
    rows = np.repeat(np.arange(len(a)), 3)
    part = np.arange(3)
    columns_a, columns_b = ((3 * x[:, None] + part).ravel() for x in (a, b))
    data = np.concatenate([way.ravel(), -way.ravel()])
    where = (np.concatenate([rows, rows]), np.concatenate([columns_b, columns_a]))
    return coo_array((data, where), shape=(len(a), n)).tocsc()


def blocks(
    damping: np.ndarray, frequency: np.ndarray, rng: np.random.Generator, links: int = 3
) -> tuple[csc_array, csc_array, csc_array]:
    """M, C, K with the roots of q'' + 2 a q' + (a^2 + w^2) q = 0 for each (a, w): -a +- i w.

    The diagonal system is multiplied by sparse unit-triangular matrices from both sides, so that
    nothing is symmetric, orthogonal or normal any more and the roots stay what they are.
    """
    a, w = np.asarray(damping, dtype=float), np.asarray(frequency, dtype=float)
    n = len(a)

    def mixer() -> csc_array:
        rows = rng.integers(0, n, links * n)
        columns = rng.integers(0, n, links * n)
        keep = rows > columns
        data = rng.uniform(-0.4, 0.4, keep.sum())
        return csc_array(
            eye_array(n) + coo_array((data, (rows[keep], columns[keep])), shape=(n, n))
        )

    left, right = mixer(), mixer().T
    return tuple(
        csc_array(left @ diags_array(d) @ right) for d in (np.ones(n), 2 * a, a * a + w * w)
    )


def acoustic_wave_1d(n: int, impedance: complex = 1.0) -> tuple:
    """NLEVP `acoustic_wave_1d`: sound in a tube with an absorbing end.

    M, C, K in mu = lambda / i, here turned to lambda: real for real impedance.
    """
    M = diags_array([np.concatenate([np.full(n - 1, 1.0), [0.5]])], offsets=[0]) / n
    end = coo_array(([1.0 / np.real(impedance)], ([n - 1], [n - 1])), shape=(n, n))
    K = n * diags_array(
        [-np.ones(n - 1), np.concatenate([np.full(n - 1, 2.0), [1.0]]), -np.ones(n - 1)],
        offsets=[-1, 0, 1],
    )
    return csc_array(M), csc_array(end), csc_array(K)


def twice(matrices: tuple) -> tuple:
    """Two uncoupled copies: every root is double."""
    return tuple(csc_array(kron(eye_array(2), x)) for x in matrices)


def with_loss_factor(rng: np.random.Generator, size: int = 30) -> tuple[TermSystem, float, float]:
    """lambda^2 + A(mu) with A = (1 + i eta) diag(a, b) + mu [[0, -k], [k, 0]] among other, stable,
    oscillators, mixed: at the threshold an eigenvalue of A is real and positive, 2 a b / (a + b).

    The system, its threshold and the frequency there, rad/s.
    """
    eta, a, b = 0.03, 400.0**2, 480.0**2
    k = 0.5 * (b - a)
    mu = np.sqrt(a * b * (eta**2 + ((a - b) / (a + b)) ** 2)) / k
    w = rng.uniform(300.0, 900.0, size)
    M, _, K = blocks(np.zeros(size), w, rng)
    K0 = block_diag([np.diag([a, b]), K]) * (1 + 1j * eta)
    K1 = block_diag([np.array([[0.0, -k], [k, 0.0]]), csc_array((size, size))])
    parts = block_diag([np.eye(2), M]), K0, K1
    n = size + 2
    left, right = (
        csc_array(np.eye(n) + np.where(rng.uniform(size=(n, n)) < 0.05, 0.02, 0.0))
        for _ in range(2)
    )
    M, K0, K1 = (csc_array(left @ x @ right) for x in parts)
    system = TermSystem((Term(M),), (), (Term(K0), Term(K1, Formula("mu"))), {"mu": 0.1})
    return system, mu, np.sqrt(2 * a * b / (a + b))
