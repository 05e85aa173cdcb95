"""Large test systems from formulas, sparse, any size."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array, eye_array

from squeal.linear.system import TermSystem
from tests.known import affine


def _lattice(
    shape: Sequence[int], stiffness: float, offset: int, periodic: bool
) -> tuple[list[tuple[int, int]], list[np.ndarray], list[float]]:
    """Springs of a block of nodes to all neighbours: pairs of nodes, directions, stiffnesses."""
    nodes = np.arange(math.prod(shape)).reshape(shape) + offset
    pairs = []
    ways = []
    springs = []
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


def disc_and_pad(cells: int) -> TermSystem:
    """A ring of 6 x `cells` nodes around and a pad on part of it, three-dimensional lattices.

    Normal contact springs join the faces; the friction force mu times the contact force acts along
    the ring, so K is not symmetric: K0 + mu K1. Some 3 x 6 c^2 (c + 2)/4 ... degrees of freedom;
    SI units of steel, audible frequencies. C = 2e-6 K without friction + gyroscopic part.
    """
    ring = (6 * cells, cells, max(2, cells // 2))
    pad = (2 * cells, cells, max(2, cells // 2))
    at = math.prod(ring)
    pairs, ways, springs = _lattice(ring, 4e7, 0, True)
    pad_pairs, pad_ways, pad_springs = _lattice(pad, 2.2e7, at, False)
    pairs += pad_pairs
    ways += pad_ways
    springs += pad_springs
    n = 3 * (at + math.prod(pad))
    ring_nodes = np.arange(at).reshape(ring)
    pad_nodes = np.arange(math.prod(pad)).reshape(pad) + at
    contact = []
    for i in range(pad[0]):
        for j in range(pad[1]):
            contact.append((int(ring_nodes[i + cells, j, -1]), int(pad_nodes[i, j, 0])))
    axial = np.array([0.0, 0.0, 1.0])
    elastic = _gaps(n, pairs, ways)
    K = elastic.T @ diags_array(np.array(springs)) @ elastic
    normal = _gaps(n, contact, [axial] * len(contact))
    along = _gaps(n, contact, [np.array([1.0, 0.1, 0.0])] * len(contact))
    k_contact = 6e6
    ground = np.zeros(n)
    ground[2 : 3 * at : 3 * ring[2]] = 3e5  # the ring sits on its bearings, the pad on its piston
    ground[3 * pad_nodes[:, :, -1].ravel() + 2] = 5e5
    for i in (0, 1):
        ground[3 * pad_nodes[:, 0, -1] + i] = 2e6
        ground[i : 3 * at : 3 * ring[2]] += 1e5
    K0 = csc_array(K + k_contact * (normal.T @ normal) + diags_array(ground))
    K1 = csc_array(k_contact * (along.T @ normal))
    M = csc_array(diags_array(np.repeat([2e-3, 1.1e-3], [3 * at, n - 3 * at])))
    rows = 3 * np.arange(at)
    skew = csc_array((np.full(at, 1e-3), (rows, rows + 1)), shape=(n, n))
    return affine(M, K0, K1, csc_array(2e-6 * K0 + skew - skew.T))


def _gaps(n: int, pairs: list[tuple[int, int]], ways: list[np.ndarray]) -> csc_array:
    """Elongation of springs from displacements (number of springs, n)."""
    way = np.ravel(ways)
    rows = np.repeat(np.arange(len(pairs)), 3)
    a, b = (3 * np.array(pairs).T[:, :, None] + np.arange(3)).reshape(2, -1)
    where = np.tile(rows, 2), np.concatenate([b, a])
    return csc_array((np.concatenate([way, -way]), where), shape=(len(pairs), n))


def mixed(rng: np.random.Generator, *matrices) -> tuple[csc_array, ...]:
    """Matrices multiplied by sparse unit-triangular ones from both sides.

    Nothing is symmetric, orthogonal or normal any more and the roots stay what they are.
    """
    n = matrices[0].shape[0]

    def mixer() -> csc_array:
        rows, columns = rng.integers(0, n, (2, 3 * n))
        keep = rows > columns
        data = rng.uniform(-0.4, 0.4, keep.sum())
        return eye_array(n) + coo_array((data, (rows[keep], columns[keep])), shape=(n, n))

    left = mixer()
    right = mixer().T
    return tuple(csc_array(left @ x @ right) for x in matrices)


def blocks(
    damping: np.ndarray, frequency: np.ndarray, rng: np.random.Generator
) -> tuple[csc_array, ...]:
    """M, C, K with the roots of q'' + 2 a q' + (a^2 + w^2) q = 0 for each (a, w): -a +- i w."""
    a = np.asarray(damping, dtype=float)
    w = np.asarray(frequency, dtype=float)
    return mixed(rng, *(diags_array(d) for d in (np.ones(len(a)), 2 * a, a * a + w * w)))


def with_loss_factor(rng: np.random.Generator, size: int = 30) -> tuple[TermSystem, float, float]:
    """lambda^2 + A(mu) with A = (1 + i eta) diag(a, b) + mu [[0, -k], [k, 0]] among other, stable,
    oscillators, mixed: at the threshold an eigenvalue of A is real and positive, 2 a b / (a + b).

    The system, its threshold and the frequency there, rad/s.
    """
    eta = 0.03
    a = 400.0**2
    b = 480.0**2
    k = 0.5 * (b - a)
    n = size + 2
    mu = np.sqrt(a * b * (eta**2 + ((a - b) / (a + b)) ** 2)) / k
    K0 = diags_array(np.r_[a, b, rng.uniform(300.0, 900.0, size) ** 2]) * (1 + 1j * eta)
    K1 = coo_array(([-k, k], ([0, 1], [1, 0])), shape=(n, n))
    return affine(*mixed(rng, eye_array(n), K0, K1)), mu, np.sqrt(2 * a * b / (a + b))
