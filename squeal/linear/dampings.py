"""Damping that is not given as a matrix: Rayleigh, modal ratios, structural loss factor.

All three refer to the structure's own stiffness: the symmetric part of K at the system's own
parameters, without friction. The friction coefficient is the parameter `mu`; in a system without
one it is the swept parameter, if all matrices of K that it multiplies are unsymmetric. A factor of
one changes nothing.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from squeal.errors import InputError
from squeal.linear.matrices import SKEW
from squeal.linear.system import Matrix, Term, TermSystem, dense
from squeal.numerics.differentiation import Formula


def structure_stiffness(system: TermSystem) -> tuple[Matrix, tuple[int, ...]]:
    """The stiffness (n, n) that damping refers to, and which terms of K it is of.

    Raises InputError where there is none.
    """
    at = frictionless(system)
    factors = [term.factor.value(at) for term in system.K]
    parts = [(i, f * t.matrix) for i, (f, t) in enumerate(zip(factors, system.K)) if f]  # noqa: B905
    K = sum(part for _, part in parts).real if parts else None
    if K is None or not abs(K).max():
        raise InputError("damping: K has no stiffness without friction; it must have some")
    return (K + K.T) / 2, tuple(i for i, _ in parts)


def frictionless(system: TermSystem) -> dict[str, float]:
    """The nominal parameters without friction, at which a structure's stiffness is taken."""
    return dict(system.values(dict.fromkeys(_friction(system), 0.0)))


def _friction(system: TermSystem) -> list[str]:
    if "mu" in system.parameters:
        return ["mu"]
    own = [t.matrix for t in system.K if system.parameter in t.factor.names]
    return [system.parameter] if own and not any(map(_symmetric, own)) else []


def _symmetric(X: Matrix) -> bool:
    return bool(abs(X - X.T).max() <= SKEW * abs(X).max())


def rayleigh(system: TermSystem, alpha: float, beta: float) -> TermSystem:
    """C with alpha M + beta K added (alpha in 1/s, beta in s), K the structure's stiffness."""
    added = tuple(Term(t.matrix, Formula(f"{alpha!r} * ({t.factor.text})")) for t in system.M)
    if not alpha:
        added = ()
    if beta:
        added += (Term(beta * structure_stiffness(system)[0]),)
    return dataclasses.replace(system, C=system.C + added)


def structural(system: TermSystem, loss_factor: float) -> TermSystem:
    """K with i loss_factor times the structure's stiffness added: complex matrices.

    It describes oscillation exp(lambda t) with Im lambda > 0; the roots below the real axis are
    the mirror images of those above.
    """
    if loss_factor == 0.0:
        return system
    added = Term(1j * loss_factor * structure_stiffness(system)[0])
    return dataclasses.replace(system, K=(*system.K, added))


def modal(system: TermSystem, ratios: Sequence[float]) -> TermSystem:
    """C with M Phi diag(2 zeta_i omega_i) Phi' M added, of the first modes of the structure.

    Phi are the modes of M and the structure's stiffness, Phi' M Phi = 1, by rising frequency.
    Raises InputError for more than 2000 rows (the matrix is full), for more ratios than modes and
    for an M that is not symmetric and positive definite.
    """
    from scipy.linalg import eigh

    most = 2000
    if system.n > most or not 1 <= len(ratios) <= system.n:
        raise InputError(
            f"damping.ratios: {len(ratios)} ratios of {system.n} rows are not allowed; modal "
            f"damping takes up to one for each row of at most {most}, rayleigh takes more"
        )
    M, K = system.arrays()[0], dense(structure_stiffness(system)[0])
    try:
        squares, modes = eigh(K, M, subset_by_index=(0, len(ratios) - 1))
    except np.linalg.LinAlgError:
        raise InputError("damping.ratios: M must be symmetric and positive definite") from None
    shapes = M @ modes
    weights = 2 * np.asarray(ratios) * np.sqrt(np.maximum(squares, 0.0))
    added = (shapes * weights) @ shapes.T
    return dataclasses.replace(system, C=(*system.C, Term(added)))
