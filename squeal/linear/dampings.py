"""Damping that is not given as a matrix: Rayleigh, modal ratios, structural loss factor.

All three speak of the structure's own stiffness: the terms of K whose factor names no parameter,
which leaves friction out where it is written with its coefficient. Rayleigh's alpha takes all of M.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from squeal.errors import InputError
from squeal.linear.terms import Term, TermSystem, dense
from squeal.numerics.formula import Formula

MODAL_ROWS = 2000  # modal damping fills its matrix


def _constant(terms: tuple[Term, ...]) -> list[Term]:
    constant = [term for term in terms if term.constant]
    if not constant:
        raise InputError(
            "damping: is not allowed with matrices that all depend on a parameter; a term without "
            "one is required"
        )
    return constant


def _scaled(terms: list[Term], factor: float | complex) -> tuple[Term, ...]:
    """Constant terms times a number."""
    return tuple(Term(factor * t.factor.value({}) * t.matrix) for t in terms)


def rayleigh(system: TermSystem, alpha: float, beta: float) -> TermSystem:
    """C with alpha M + beta K added (alpha in 1/s, beta in s), of K what has no parameters."""
    added: tuple[Term, ...] = ()
    if alpha:
        mass = [Term(t.matrix, Formula(f"{alpha!r} * ({t.factor.text})")) for t in system.M]
        added += tuple(mass)
    if beta:
        added += _scaled(_constant(system.K), beta)
    return dataclasses.replace(system, C=system.C + added)


def structural(system: TermSystem, loss_factor: float) -> TermSystem:
    """K times (1 + i loss_factor), on the terms without parameters: complex matrices.

    It describes oscillation exp(lambda t) with Im lambda > 0; the roots below the real axis are
    the mirror images of those above.
    """
    if loss_factor == 0.0:
        return system
    added = _scaled(_constant(system.K), 1j * loss_factor)
    return dataclasses.replace(system, K=system.K + added)


def modal(system: TermSystem, ratios: Sequence[float]) -> TermSystem:
    """C with M Phi diag(2 zeta_i omega_i) Phi' M added, of the first modes of the structure.

    Phi are the modes of M and the symmetric part of K without parameters, Phi' M Phi = 1, by
    rising frequency. Raises InputError for more than 2000 rows (the matrix is full), for more
    ratios than modes and for an M that is not symmetric and positive definite.
    """
    from scipy.linalg import eigh

    if system.n > MODAL_ROWS or not 1 <= len(ratios) <= system.n:
        raise InputError(
            f"damping.ratios: {len(ratios)} ratios of {system.n} rows are not allowed; modal "
            f"damping takes up to one for each row of at most {MODAL_ROWS}, rayleigh takes more"
        )
    M, K = (_dense_sum(_constant(terms)) for terms in (system.M, system.K))
    try:
        squares, modes = eigh((K + K.T) / 2, M, subset_by_index=(0, len(ratios) - 1))
    except np.linalg.LinAlgError:
        raise InputError("damping.ratios: M must be symmetric and positive definite") from None
    shapes = M @ modes
    weights = 2 * np.asarray(ratios) * np.sqrt(np.maximum(squares, 0.0))
    return dataclasses.replace(system, C=system.C + (Term((shapes * weights) @ shapes.T),))


def _dense_sum(terms: list[Term]) -> np.ndarray:
    return sum(t.factor.value({}) * dense(t.matrix) for t in terms)  # type: ignore[return-value]
