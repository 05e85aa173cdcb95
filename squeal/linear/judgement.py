"""The verdict on a system: stable, marginal, flutter or divergence, and how it was reached.

`marginal` means that no eigenvalue lies to the right of the imaginary axis and at least one on
it: an undamped system that does not grow, or a damped one with an undamped or rigid-body mode.
Of flutter and divergence together the faster growth names the verdict.

Without damping, and up to three degrees of freedom, no eigenvalue is computed unless one is so
great that rounding hides the others: the signs of the
discriminant and of the coefficients of the polynomial in lambda^2 decide, each against a bound of
its own rounding error (`cubic`). At a flutter boundary two roots coalesce and computed real parts
are noise of the size of the square root of the machine precision, while the discriminant passes
through zero at full slope and is known to about 1e-14 of its terms. Otherwise an eigenvalue
counts as lying on an axis if its distance is below (backward error) x (its condition number). The
condition number grows without limit at a coalescence, so the tolerance widens by itself to the
square root of the machine precision there (m-th root where m eigenvalues meet), and only there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.linear import cubic
from squeal.linear.cubic import (
    DIVERGENCE,
    FLUTTER,
    STABLE,
    UNDECIDED,
    VERDICTS,
    Cubic,
    code,
    cubic_of,
)
from squeal.linear.eigen import axis_noise, squared_frequencies, standard_eigenvalues
from squeal.linear.matrices import EPS, Array, Reduced, first_order, reduce


@dataclass(frozen=True)
class Judgement:
    """A verdict with the number that decided it and the tolerance that number was held against."""

    verdict: str
    criterion: str
    value: float
    tolerance: float

    def __str__(self) -> str:
        size = f"{self.value:.6g} (rounding {self.tolerance:.2g})"
        return f"{self.verdict}: {self.criterion} = {size}"


def judge(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> Judgement:
    """Verdict on M q'' + C q' + K q = 0, matrices (n, n), with the reason. Raises InputError."""
    return judge_reduced(reduce(M, C, K))


def verdict(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> str:
    """Verdict on M q'' + C q' + K q = 0 in one word, see `judge`."""
    return judge(M, C, K).verdict


def judge_reduced(reduced: Reduced) -> Judgement:
    """As `judge`, for a system in mass-normalised coordinates."""
    if reduced.B is not None:
        return _damped(reduced)
    if reduced.n <= 3 and not (found := cubic_of(reduced)).vague:
        return _by_invariants(reduced, found)
    return _by_squares(reduced)


def _by_invariants(reduced: Reduced, cubic: Cubic) -> Judgement:
    if not np.isfinite([v for quantity in cubic[:5] for v in quantity]).all():
        raise OverflowError("the eigenvalues are beyond double precision")
    name = VERDICTS[int(code(cubic))]
    singular = abs(cubic.c.value) <= cubic.c.bound
    note = " (K singular)" if singular and reduced.n == 3 else ""
    if name != "divergence":
        disc = cubic.discriminant2 if singular else cubic.discriminant
        return Judgement(name, f"discriminant in lambda^2{note}", *map(float, disc))
    minors = "determinant" if reduced.n == 2 else "sum of principal minors"
    negative = [("determinant", cubic.c), (minors, cubic.b), ("trace", cubic.a)]
    criterion, value = next(item for item in negative if item[1].value < -item[1].bound)
    return Judgement(name, f"{criterion} of M^-1 K{note}", *map(float, value))


def _by_squares(reduced: Reduced) -> Judgement:
    squares, _, _, condition = squared_frequencies(reduced)
    noise = axis_noise(reduced.A, squares, condition, reduced.rounding)
    on_axis = (squares.imag == 0) & (squares.real >= -noise)
    growth = np.where(on_axis, 0.0, np.abs(np.sqrt(-squares).real))
    k = int(np.argmax(growth))
    if growth[k] == 0.0:
        k = int(np.argmin(squares.real))
        return Judgement("marginal", "least -lambda^2", float(squares[k].real), float(noise[k]))
    if squares[k].imag:
        value = float(abs(squares[k].imag))
        return Judgement("flutter", "|Im lambda^2|", value, float(noise[k]))
    return Judgement("divergence", "least -lambda^2", float(squares[k].real), float(noise[k]))


def _damped(reduced: Reduced) -> Judgement:
    assert reduced.B is not None
    matrix, rate = first_order(reduced.A, reduced.B)
    values, _, _, condition = standard_eigenvalues(matrix, reduced.rounding, reduced.A)
    noise = axis_noise(matrix, values, condition, reduced.rounding)
    noise[values == 0] = 0.0  # found by rank, hence exact
    excess = np.where(values.real > noise, values.real, -np.inf)
    k = int(np.argmax(excess))
    if np.isfinite(excess[k]):
        # close to where a pair meets the real axis the imaginary part is noise as well
        oscillates = abs(values[k].imag) > noise[k]
        name = "flutter" if oscillates else "divergence"
    else:
        on_axis = np.abs(values.real) <= noise
        name = "marginal" if np.any(on_axis) else "stable"
        k = int(np.argmax(np.where(on_axis, np.inf, values.real)))
    value, tolerance = float(values[k].real * rate), float(noise[k] * rate)
    return Judgement(name, "largest Re lambda", value, tolerance)


def damped_verdicts(A: Array, B: Array, rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (N,), indices into VERDICTS, of z'' + B z' + A z = 0; A, B of (N, n, n).

    The coordinates are mass-normalised and no B is zero throughout. The codes are those of
    `judge`: its tolerances are bounded from above for all systems together, and only those with an
    eigenvalue within this bound of an axis are judged one by one.
    """
    matrices, _ = first_order(A, B)
    values = np.linalg.eigvals(matrices)
    error, norm = 2 * matrices.shape[-1] * rounding, np.linalg.norm(matrices, axis=(-2, -1))
    apart = np.abs(values[:, :, None] - values[:, None, :]) / norm[:, None, None]
    cluster = np.maximum(2, np.sum(apart <= 4 * error ** (1 / 3), axis=-1))
    bound = norm[:, None] * error ** (1 / cluster)
    grows = np.take_along_axis(values, values.real.argmax(axis=-1)[:, None], axis=-1)[:, 0]
    codes = np.where(grows.imag != 0.0, FLUTTER, DIVERGENCE).astype(np.int8)
    codes[grows.real < 0.0] = STABLE
    doubtful = np.abs(values.real) <= bound
    doubtful |= (values.real > 0.0) & (values.imag != 0.0) & (np.abs(values.imag) <= bound)
    unit = np.eye(A.shape[-1])
    for k in np.flatnonzero(doubtful.any(axis=-1)):
        codes[k] = VERDICTS.index(_damped(Reduced(A[k], B[k], unit, rounding)).verdict)
    return codes


def undamped_verdicts(entries: Sequence[ArrayLike], rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes, indices into VERDICTS, of many undamped systems A = M^-1 K of three rows.

    `entries` are the nine entries of A row by row, numbers or arrays that broadcast against each
    other; the result has the broadcast shape.
    """
    codes = cubic.undamped_verdicts(entries, rounding)
    arrays = np.broadcast_arrays(*entries)
    for at in np.argwhere(codes == UNDECIDED):
        A = np.array([e[tuple(at)] for e in arrays]).reshape(3, 3)
        codes[tuple(at)] = _code_by_squares(A, rounding)
    return codes


def sum_verdicts(Q: NDArray, u: NDArray, rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (n1, n2), indices into VERDICTS, of A = Q[:, :, k] + u[:, i] u[:, i]'.

    Q (3, 3, n2) and u (3, n1) are in coordinates with a mass matrix of one.
    """
    codes = cubic.sum_verdicts(Q, u, rounding)
    for i, k in np.argwhere(codes == UNDECIDED):
        codes[i, k] = _code_by_squares(Q[:, :, k] + np.outer(u[:, i], u[:, i]), rounding)
    return codes


def _code_by_squares(A: Array, rounding: float) -> int:
    return VERDICTS.index(_by_squares(Reduced(A, None, np.eye(3), rounding)).verdict)
