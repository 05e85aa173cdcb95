"""How many finite roots the equations of a small system have, in exact arithmetic."""

import numpy as np

from squeal.linear.matrices import Array, Matrix, scaled_rank

PRIME = 2**31 - 1  # products of two smaller integers are below 2^63
FEW_ROWS = 40
"""Rows up to which the count is exact; beyond, it is bounded by two powers of w, which take a
second of 200 rows where all of them may take ten."""


def finite_root_count(M: Matrix, C: Matrix | None, K: Matrix, guess: int) -> int:
    """The degree of det(z^2 M + z C + K): how many finite roots arrays (n, n) as given have.

    It is 2n where M is regular. M = diag(1, 0) and K = [[2, -1], [-1, 1]] have
    det(z^2 M + K) = z^2 + 1: two roots, not four. A row without mass, a constraint, and entries
    that cancel exactly take roots; entries that cancel only to rounding take none.

    A bound is computed first: the largest degree of a product of n entries, one of each row and
    column, whatever the values of the entries are. It is returned if it is the guess, such as the
    number of roots that a solver lists, as it saves exact arithmetic then.

    Else the zeros at w = 1/z = 0 of det(M + w C + w^2 K) are counted, those that the degree lacks
    to 2n: they are the independent solutions of the first powers of w of
    (M + w C + w^2 K) (x_0 + w x_1 + ...) = 0, as soon as one more power adds none (derived in
    docs/searching.md, "How many roots there are").

    Where every z is a root, the count exceeds 2n, and 0 is returned. Of more than `FEW_ROWS` rows
    two powers are counted, and the equations may have fewer roots than is returned.
    """
    n = len(M)
    if scaled_rank(M) == n:
        return 2 * n
    from scipy.optimize import linear_sum_assignment  # slow to load, and M is hardly ever singular

    coefficients = [M, np.zeros_like(M) if C is None else C, K]  # of w^0, w^1 and w^2
    # of an entry that is zero for all z: so low that the degree of a product with it is below 0
    degrees = np.full((n, n), -2 * n)
    for degree, X in enumerate(reversed(coefficients)):
        degrees[X != 0] = degree
    most = int(degrees[linear_sum_assignment(degrees, maximize=True)].sum())
    if most == guess:
        return most
    copies = 1
    if any(map(np.iscomplexobj, coefficients)):
        # the real form of complex matrices has each zero twice
        copies = 2
        coefficients = [np.block([[X.real, -X.imag], [X.imag, X.real]]) for X in coefficients]
    rows = len(coefficients[0])
    equations = np.zeros((0, 0))
    zeros_before = -1
    zeros = 0
    powers = 0
    while zeros_before < zeros <= 2 * rows and (n <= FEW_ROWS or powers < 2):
        # one more power of w: rows K x_(i-2) + C x_(i-1) + M x_i below the others
        larger = np.zeros((len(equations) + rows,) * 2)
        larger[: len(equations), : len(equations)] = equations
        for power, X in enumerate(coefficients[: powers + 1]):
            first = (powers - power) * rows  # of the columns of x_(powers - power)
            larger[len(equations) :, first : first + rows] = X
        equations = larger
        powers += 1
        zeros_before = zeros
        zeros = len(equations) - exact_rank(equations)
    return max(0, min(most, 2 * n - zeros // copies))


def exact_rank(X: Array) -> int:
    """The rank of a matrix (n, m) of doubles as given: what cancels to rounding alone still counts.

    By elimination modulo a prime, in integers: doubles are integers times powers of two. The true
    rank is larger where the prime divides a minor; of arbitrary entries it does with a chance of
    about n over the prime.
    """
    mantissas, exponents = np.frexp(X)
    # a mantissa of 53 bits, from 1/2 to 1, times 2^53 is a whole number
    integers = np.ldexp(mantissas, 53).astype(np.int64)
    # 2^31 is 1 modulo the prime 2^31 - 1: of an exponent its remainder by 31 suffices
    powers = np.left_shift(np.int64(1), (exponents.astype(np.int64) - 53) % 31)
    remainders = integers % PRIME * powers % PRIME
    rank = 0
    for column in range(remainders.shape[1]):
        rows = rank + np.flatnonzero(remainders[rank:, column])
        if not rows.size:
            continue
        pivot, *others = rows.tolist()
        inverse = pow(int(remainders[pivot, column]), -1, PRIME)
        factors = remainders[others, column] * inverse % PRIME
        reduced = remainders[others] - factors[:, None] * remainders[pivot] % PRIME
        remainders[others] = reduced % PRIME
        remainders[[rank, pivot]] = remainders[[pivot, rank]]
        rank += 1
    return rank
