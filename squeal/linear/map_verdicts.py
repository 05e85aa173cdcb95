"""Verdicts on arrays of systems, for maps: codes that index VERDICTS."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from squeal.linear.invariants import invariants, share_of_largest
from squeal.linear.matrices import ENTRY_ROUNDING, Array, NormalisedSystem, first_order
from squeal.linear.roots import roots_of
from squeal.linear.verdicts import DIVERGENCE, FLUTTER, MARGINAL, STABLE, VERDICTS, Codes, decide

CHUNK = 8192  # matrices per pass: temporaries of 64 kB stay in the cache and in malloc's pool


def _code(A: Array, B: Array | None, relative_error: float = ENTRY_ROUNDING) -> int:
    """The verdict code of one system z'' + B z' + A z = 0, by its roots."""
    roots = roots_of(NormalisedSystem(A, B, np.eye(len(A)), relative_error))
    return VERDICTS.index(decide(roots.values, roots.rounding).verdict)


def damped_verdicts(A: Array, B: Array, relative_error: float | Array = ENTRY_ROUNDING) -> Codes:
    """Verdict codes (N,), indices into VERDICTS, of N damped systems z'' + B z' + A z = 0.

    Systems with an eigenvalue that rounding may move to the imaginary axis, or with a growing one
    that it may move to the real axis, are judged one by one, as `judge` does.

    Parameters
    ----------
    A, B : array (N, n, n)
        In mass-normalised coordinates. Every system is damped: no B[k] is the zero matrix.
    relative_error : float or array (N,)
        Of the entries of the matrices. Where such errors hide whether a root grows, and no other
        root certainly grows, the system counts as marginal.
    """
    relative_errors = np.broadcast_to(relative_error, len(A))
    matrices, _ = first_order(A, B)
    values = np.linalg.eigvals(matrices)
    norm = np.linalg.norm(matrices, axis=(-2, -1))[:, None]
    # as a share of the norm: an error e of the matrix, taken as that of an entry times twice the
    # number of rows, moves a triple root by its cube root
    share = (2 * matrices.shape[-1] * relative_errors) ** (1 / 3)
    rounding = norm * share[:, None]
    fastest = values[np.arange(len(values)), values.real.argmax(axis=-1)]  # of each system
    codes = np.where(fastest.imag != 0.0, FLUTTER, DIVERGENCE).astype(np.int8)
    codes[fastest.real < 0.0] = STABLE
    # near the imaginary axis, or growing so near to the real one that it may be a real root
    doubtful = np.abs(values.real) <= rounding
    doubtful |= (values.real > 0.0) & (values.imag != 0.0) & (np.abs(values.imag) <= rounding)
    for k in np.flatnonzero(doubtful.any(axis=-1)):
        codes[k] = _code(A[k], B[k], float(relative_errors[k]))
    return codes


def errors_may_change(A: Array, B: Array | None, errors: Array) -> NDArray[np.bool_]:
    """Which (N,) of N verdicts on z'' + B z' + A z = 0 may change by errors of the entries.

    The faster of flutter and divergence names the verdict, which so may also change where both grow
    equally fast, as far as the errors tell.

    Parameters
    ----------
    A, B, errors : array (N, 3, 3)
        In mass-normalised coordinates, and how far each entry of A may be off. Errors of B are
        taken to be the same share of the largest entry. B may be None.
    """
    if B is None:
        B = np.zeros_like(A)
    damped = np.asarray(B.any(axis=(1, 2)))
    shares = share_of_largest(errors.reshape(-1, 9).T, np.abs(A).reshape(-1, 9).T)
    may_change = np.zeros(len(A), bool)
    may_change[~damped] = _errors_may_change_undamped(A[~damped], errors[~damped])
    # marginal: errors hide whether a root grows
    may_change[damped] = damped_verdicts(A[damped], B[damped], shares[damped]) == MARGINAL
    # a pair and a real root may grow equally fast if their rates differ by no more than what the
    # errors may move a triple root of the scaled matrix, the cube root of their share. Without
    # damping det A is the product of the three s = -lambda^2: that of a conjugate pair is positive
    # and the s of a growing real root negative, so that both occur together only if det A < 0. With
    # damping they may occur whatever its sign
    may_tie = damped | (np.linalg.det(A) < 0.0)
    matrices, _ = first_order(A[may_tie], B[may_tie])  # (k, 6, 6)
    values = np.linalg.eigvals(matrices)
    real_rate = np.where(values.imag == 0.0, values.real, 0.0).max(axis=1)  # 0 if none grows
    pair_rate = np.where(values.imag != 0.0, values.real, 0.0).max(axis=1)
    reach = np.cbrt(shares[may_tie])  # of a scaled matrix, whose norm is about 1
    are_equal = np.abs(pair_rate - real_rate) <= reach
    may_change[may_tie] |= (pair_rate > 0.0) & (real_rate > 0.0) & are_equal
    # a damped pair may turn into two real roots or the reverse, where the fastest two nearly meet
    rows = np.arange(len(values))
    fastest = values[rows, values.real.argmax(axis=1)]
    distances = np.sort(np.abs(values - fastest[:, None]), axis=1)[:, 1]
    may_meet = np.maximum(distances, np.abs(fastest.imag)) <= reach
    may_change[may_tie] |= (fastest.real > 0.0) & may_meet & damped[may_tie]
    return may_change


def _errors_may_change_undamped(A: Array, errors: Array) -> NDArray[np.bool_]:
    """Which (n,) of n verdicts on z'' + A z = 0 may change by errors of the entries of A (n, 3, 3).

    It may change in two ways. Whether there is a complex pair is open by the sign of the
    discriminant, unless A is symmetric. Whether a root is negative is open by the sign of a
    coefficient, unless a certain pair or another negative coefficient makes it unstable anyway.
    """
    # of s^3 - a s^2 + b s - c, whose roots s = -lambda^2 grow where they are complex or negative:
    # real ones are all positive if a, b and c are. Each with `value` and `bound` of its error (n,)
    a, b, c, discriminant, is_unresolved = invariants(
        list(A.reshape(-1, 9).T), errors=list(errors.reshape(-1, 9).T)
    )
    has_pair = discriminant.value < -discriminant.bound
    has_negative = np.zeros(len(A), bool)
    has_open_sign = np.zeros(len(A), bool)
    for coefficient in (a, b, c):
        has_negative |= coefficient.value < -coefficient.bound
        has_open_sign |= np.abs(coefficient.value) <= coefficient.bound
    is_symmetric = np.all(np.swapaxes(A, 1, 2) == A, axis=(1, 2))  # which has no complex pair
    pair_is_open = (np.abs(discriminant.value) <= discriminant.bound) & ~is_symmetric
    sign_is_open = has_open_sign & ~has_negative & ~has_pair
    return np.asarray(pair_is_open | sign_is_open | is_unresolved)


def undamped_verdicts(A: Array) -> Codes:
    """Verdict codes (...), indices into VERDICTS, of undamped systems A = M^-1 K (..., 3, 3)."""
    entries = np.ascontiguousarray(A.reshape(-1, 9).T)
    codes = np.zeros(entries.shape[1], np.int8)
    for start in range(0, len(codes), CHUNK):
        chunk = slice(start, start + CHUNK)
        codes[chunk] = _by_invariants(list(entries[:, chunk]))
    return codes.reshape(A.shape[:-2])


def _by_invariants(entries: Sequence[Array]) -> Codes:
    """Verdict codes (N,) of N undamped systems from the signs of the invariants of A.

    With roots s = -lambda^2 of s^3 - a s^2 + b s - c = 0: real and non-negative roots are marginal,
    a negative one is divergence, a complex pair flutter. A coalescence that rounding cannot tell
    from real roots counts as real. Where both occur the one that grows faster names the verdict.
    Systems with unresolved invariants are judged by their roots.

    entries: the nine entries (N,) of the matrices A, row by row.
    """
    a, b, c, discriminant, is_unresolved = invariants(entries)
    has_pair = discriminant.value < -discriminant.bound
    has_negative_product = c.value < -c.bound
    # a is the sum of the roots, b that of their products by twos, c the product of all: if all
    # roots are real, one is negative exactly if a, b or c is
    has_negative = has_negative_product | (b.value < -b.bound) | (a.value < -a.bound)
    without_pair = np.where(has_negative, DIVERGENCE, MARGINAL)
    codes = np.where(has_pair, FLUTTER, without_pair).astype(np.int8)
    # beside a complex pair, whose product is positive, the real root has the sign of c
    has_both = np.flatnonzero(has_pair & has_negative_product)
    unresolved = np.flatnonzero(is_unresolved)
    A = np.stack(entries, axis=-1).reshape(-1, 3, 3)
    s = np.linalg.eigvals(A[has_both]).astype(complex)
    fastest = np.argmax(np.abs(np.sqrt(-s).real), axis=1)  # by Re lambda, lambda^2 = -s
    is_flutter = s.imag[np.arange(len(s)), fastest] != 0.0
    codes[has_both] = np.where(is_flutter, FLUTTER, DIVERGENCE)
    codes[unresolved] = [_code(A[k], B=None) for k in unresolved]
    return codes
