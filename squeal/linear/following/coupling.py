"""How two roots that may meet are coupled, by themselves and by way of all others.

In the eigenvectors of A(p) the matrix at p + x is diag(z) + x W, exactly if its factors are
affine. Two roots k, l that come close follow diag(z_k, z_l) + x [[W_kk, a], [b, W_ll]], in which
the others shift the coupling to a = W_kl + x T_kl, b = W_lk + x T_lk:
T_kl = sum_m W_km W_ml (1 / (z_k - z_m) + 1 / (z_l - z_m)) / 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from squeal.linear.matrices import Array

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Couplings:
    """Pairs (k, l) of roots that may change what grows, each an array (pairs,) or (2, pairs).

    With two rows the first is of kl, the second of lk.
    """

    k: NDArray[np.intp]
    l: NDArray[np.intp]
    conjugate: NDArray[np.bool_]
    apart: ComplexArray  # z_k - z_l
    own: ComplexArray  # (2, pairs) W_kk and W_ll
    direct: ComplexArray  # (2, pairs) W
    indirect: ComplexArray  # (2, pairs) T
    bend: ComplexArray  # half of z_k'' - z_l'' of all other roots
    alone: Array  # (2, pairs) each third root's part of T for itself: they need not cancel

    @staticmethod
    def of(z: ComplexArray, W: ComplexArray, noise: Array, damped: bool) -> Couplings:
        """Of roots z (m,) with the derivative W (m, m) in the eigenvectors, left^H right = 1."""
        with np.errstate(all="ignore"):
            apart = z[:, None] - z[None, :]
            unsure = np.add.outer(noise, noise)
            inverse = np.where(np.abs(apart) > unsure, 1 / apart, 0.0)
            F, own = W * inverse, W.diagonal()
            conjugate = np.abs(z[:, None] - z[None, :].conj()) <= unsure
            if damped:
                one = z.imag >= -noise
            else:
                one = (np.abs(z.imag) <= noise) & (z.real > 0)
                conjugate = conjugate & (z.real > 0)
            k, l = np.nonzero(np.triu((one[:, None] & one[None, :]) | conjugate, 1))
            pairs = np.stack([k, l]), np.stack([l, k])
            FW, WF = (_entries(X, Y, *pairs, one) for X, Y in ((F, W), (W, F)))
            indirect = (FW - WF + F[pairs] * (own[pairs[0]] - own[pairs[1]])) / 2
            bend = np.einsum("km,mk->k", F, W)
            bend = bend[k] - bend[l] - 2 * W[k, l] * W[l, k] * inverse[k, l]
            squares, others = np.abs(W) ** 2, np.abs(F) ** 2
            size = squares.diagonal()
            alone = _entries(others, squares, *pairs, one) + _entries(squares, others, *pairs, one)
            alone -= others[pairs] * (size[k] + size[l])
        return Couplings(
            k,
            l,
            conjugate[k, l],
            apart[k, l],
            own[pairs[0]],
            W[pairs],
            indirect,
            bend,
            np.sqrt(np.maximum(alone, 0.0)),
        )


def _entries(
    X: NDArray, Y: NDArray, i: NDArray[np.intp], j: NDArray[np.intp], some: NDArray[np.bool_]
) -> NDArray:
    """(X Y)_ij, by one product where both i and j are among some, else each for itself."""
    number = np.cumsum(some) - 1
    block = X[some] @ Y[:, some]
    both = some[i] & some[j]
    found = np.empty(i.shape, dtype=block.dtype)
    found[both] = block[number[i[both]], number[j[both]]]
    found[~both] = np.einsum("pm,mp->p", X[i[~both]], Y[:, j[~both]])
    return found
