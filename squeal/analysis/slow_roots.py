"""Roots and verdict of a pad, also beside a stiffness or damping far greater than others."""

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import ComputationError
from squeal.linear import Judgement, Spectrum
from squeal.linear.eigen import STIFF, hidden, ordered, scaled_rank, spectrum_of
from squeal.linear.judgement import judge_reduced
from squeal.linear.matrices import EPS, checked, reduce

LOST = 0.03  # of an eigenvalue: rounding of K that leaves nothing to be told


def roots_and_verdict(
    M: ArrayLike, C: ArrayLike | None, K: ArrayLike
) -> tuple[Spectrum, Judgement]:
    """All eigenvalues of matrices (n, n) and the verdict on them.

    Where the standard form hides slow roots they come from the pencil, each with the error that
    rounding of M, C and K may bring. Raises ComputationError if that leaves one no digit, and
    OverflowError where one is beyond double precision.
    """
    M, C, K = checked(M, C, K)
    reduced = reduce(M, C, K)
    squares = np.abs(np.diag(reduced.A))  # of the frequencies of each coordinate alone
    # upright springs hold nothing along the surface: (k cos^2) of a rounded angle is no slow mode
    free = squares.min() <= EPS**2 * squares.max()
    if free or not hidden(reduced, K):
        return spectrum_of(reduced), judge_reduced(reduced)
    from squeal.analysis.systems.roots import ROUNDING, decided  # a tenth of a query's time
    from squeal.sparse.spectrum import dense_spectrum

    found = dense_spectrum(M, C, K)
    if len(found) < 2 * len(M):  # a pad has no motion without mass
        raise OverflowError("the eigenvalues are beyond double precision")
    regular = scaled_rank(K) == len(K)  # else roots may be exactly zero
    errors = [max(e.residual, ROUNDING) * e.condition if e.value or regular else 0.0 for e in found]
    if not all(error <= LOST for error in errors):
        raise ComputationError(f"no eigenvalue can be given: {STIFF}")
    values = np.array([e.value for e in found])
    order = ordered(values)
    zeros = errors.count(0.0)
    verdict = decided(values, np.abs(values) * np.array(errors))
    return Spectrum(tuple(found[k] for k in order), C is None, zeros), verdict
