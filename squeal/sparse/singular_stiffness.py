"""Where K becomes singular along a parameter: a real root passes zero, a static loss of stability.

Such a root may come from far above a band and leave it again between two values of the parameter,
so that no spectrum shows it. If det K has different signs at the ends of a part of the range, an
odd number of roots pass zero in it. If 1 - K(middle)^-1 K contracts, none does.

Free motions X, with K X = 0 at all parameters, hide what else passes zero. `without_zeros` borders
the system by what is left of P(lambda) X without the zeros of these motions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, eye_array

from squeal.linear.matrices import EPS, Array
from squeal.linear.terms import Term
from squeal.sparse.axis_crossing import NEWTON_STEPS, CrossingGuess
from squeal.sparse.corrections import enlarged
from squeal.sparse.dense import STIFFNESS_ROUNDING
from squeal.sparse.factor import Factor, factorise, factorise_at
from squeal.sparse.quadratic import ScaledProblem, ScaledSystem, projected
from squeal.sparse.reduction import Complement

SHORTEST_PART = 2.0**-10  # of the range: shorter parts are not halved
MOST_PARTS = 200  # that are examined at most
NEAR_ZERO = 1e-6  # of the frequency scale: far below the lowest roots that are not zero
MOST_FREE = 12  # free motions, of two bodies; beside as many no static loss is looked for
SLOW = 1e-4  # a random vector has at least this share of a free motion, up to some 10^7 rows
LARGEST_CONTRACTION = 0.4  # below 1, since few products with T may underestimate it
DROPPED_PART = 1e-12  # of null vectors: what they add less is left out


def singular_stiffness(
    scaled: ScaledSystem, values: Sequence[float]
) -> tuple[list[CrossingGuess], list[str]]:
    """Where K of real matrices becomes singular over the free parameter: a real root passes zero.

    The range is divided into parts.

    - If 1 - K(middle)^-1 K contracts in a part (Neumann series), K is regular there.
    - Else, if det K changes its sign or the part is too short to be halved, a value with a singular
      K is searched in it. It is cut out with a narrow edge on either side, which leaves two parts.
    - Else, and where no such value was located, the part is halved, as far as the constants allow.

    Next to a value that was cut out K is nearly singular: there the contraction is judged apart
    from the null vectors at that value, and K is regular if, besides, det K keeps its sign.

    Parameters
    ----------
    scaled : ScaledSystem
        The full system, real, `without_zeros`.
    values : sequence of float
        Of the parameter, rising: the ends of the range, and others at which the contraction is
        computed too if K is not linear in the parameter.

    Returns
    -------
    crossings : list of CrossingGuess
        With omega 0, in no order.
    unclear : list of str
        A sentence for each change of sign that was not located, and one if K is singular at all
        values.
    """
    stiffness = _SweptStiffness(scaled, values)
    span = values[-1] - values[0]
    edge = 1e-6 * span  # what is cut out on either side of a singular K
    crossings: list[CrossingGuess] = []
    unclear: list[str] = []
    parts = [(values[0], values[-1])]
    for a, b in parts:  # the list grows in the loop
        close_crossings = []  # crossings next to an end of the part, where K is nearly singular
        for other in crossings:
            if min(abs(other.value - a), abs(other.value - b)) <= 2 * edge:
                close_crossings.append(other)
        contracts = stiffness.contracts(a, b, close_crossings)
        if contracts and not close_crossings:  # K is regular: no sign can have changed
            continue
        sign_changes = stiffness.sign(a) * stiffness.sign(b) < 0.0
        if contracts and not sign_changes:  # regular, but for the crossings cut out already
            continue
        # if the sign changes a root does pass zero, and is searched down to the width of a cut
        shortest = edge if sign_changes else SHORTEST_PART * span
        is_last = b - a <= shortest or len(parts) >= MOST_PARTS  # the part is not halved
        crossing = None
        # otherwise a search may be in vain, and halving is cheaper
        if sign_changes or is_last:
            crossing = singular_between(stiffness, a, b, edge)
        # a crossing that was not located before
        if crossing and all(abs(crossing.value - other.value) > edge for other in crossings):
            crossings.append(crossing)
            if a < crossing.value - edge:
                parts.append((a, crossing.value - edge))
            if crossing.value + edge < b:
                parts.append((crossing.value + edge, b))
        elif not is_last:
            middle = stiffness.middle(a, b)
            parts += [(a, middle), (middle, b)]
        elif sign_changes:
            where = f"{stiffness.name} = {a:.6g} and {b:.6g}"
            unclear.append(f"a real root passes zero between {where} and was not located")
    if stiffness.is_singular_everywhere:
        unclear.append("K is singular at all values, so that no static loss is looked for")
    return crossings, unclear


def without_zeros(scaled: ScaledSystem, values: Sequence[float]) -> ScaledSystem:
    """A real system, bordered so that it has all its roots but the zeros of free motions.

    X1 are free motions that nothing damps, X2 others, with C X2 of full rank. As P(lambda) X1 =
    lambda^2 M X1 and P(lambda) X2 = lambda (C + lambda M) X2, the determinant of
    [[P(lambda), M X1, (C + lambda M) X2], [X', 0, 0]] is that of P(lambda) without one factor
    lambda for each column of X2 and two for each of X1, but for a constant.

    Parameters
    ----------
    scaled : ScaledSystem
        The system, n rows. It is returned itself where it has no free motions or too many.
    values : sequence of float
        Of the parameter: K X is zero at all of them.

    Returns
    -------
    ScaledSystem
        Of n rows and a row for each free motion. Its first n rows have the scaled coordinates of
        the system; `zeros` is how many roots at zero the border takes out.
    """
    name = scaled.system.parameter
    slow = _slow_motions(scaled.at({name: values[0]}))
    if not slow.size:
        return scaled
    problems = [scaled.at({name: value}) for value in values]
    noise = STIFFNESS_ROUNDING * max(problem.norms[2] for problem in problems)  # of M, C and K: K
    # combinations of slow motions on which no K exerts a force
    free, _ = _split_by_forces(slow, [problem.K @ slow for problem in problems], noise)
    count = free.shape[1]
    if count in (0, MOST_FREE):
        return scaled
    # a motion of mass m and damping c has the roots 0 and -c / m. Rounding of K moves zeros by
    # sqrt(noise / m): a root up to there, c <= sqrt(noise m), counts as a second zero
    slight = math.sqrt(noise * problems[0].norms[0])
    # X1: damping exerts no force on them; X2: the others
    X1, X2 = _split_by_forces(free, [p.C @ free for p in problems], slight)
    X1 = X1 * problems[0].frequency_scale ** 2  # so that M X1 has the size of K

    n = scaled.n
    system = scaled.system
    rows = eye_array(n, n + count)  # places n columns of the system before the border
    border = eye_array(count, n + count, k=n)  # places `count` columns in the border
    # from scaled coordinates, in which the motions are, to those of the system
    scale = scaled.scale[:, None]
    X1_in_border = csc_array(np.hstack([X1, 0.0 * X2]) * scale) @ border
    X2_in_border = csc_array(np.hstack([0.0 * X1, X2]) * scale) @ border
    # X' below P: any basis of all free motions serves
    free_rows = Term(border.T @ csc_array(free / scale).T @ rows)

    unbordered = projected(system, rows, rows)  # P, with an empty border
    on_X1 = projected(system, rows, X1_in_border)  # its M is M X1, in columns of the border
    on_X2 = projected(system, rows, X2_in_border)
    stiffness = (*unbordered.K, *on_X1.M, *on_X2.C, free_rows)
    bordered = replace(unbordered, C=unbordered.C + on_X2.M, K=stiffness)
    bordered_scaled = ScaledSystem(bordered, np.append(scaled.scale, np.ones(count)))
    bordered_scaled.zeros = count + X1.shape[1]  # an undamped free motion has two
    return bordered_scaled


def _slow_motions(problem: ScaledProblem) -> Array:
    """Orthonormal motions (n, k) that hold all free ones; none where K holds every motion.

    By inverse iteration on K + s^2 M, s just above zero, which leaves free motions and rounding:
    C would mix in other motions. To the forces M v a free motion X, X' M X = 1, responds by
    (X' M v) / s^2 X: by the share of v that it makes up, over s^2.
    """
    undamped = replace(problem, C=0.0 * problem.C)
    s = NEAR_ZERO * problem.frequency_scale
    _, factor = factorise_at(undamped, complex(s))
    vectors = np.random.default_rng(2).standard_normal((problem.n, MOST_FREE))
    first = vectors[:, :1]
    # where `first` has no share of a free motion there is none
    if s**2 * np.linalg.norm(factor.solve(problem.M @ first)) < SLOW * np.linalg.norm(first):
        return np.zeros((problem.n, 0))
    for _ in range(2):
        vectors, _ = np.linalg.qr(factor.solve(problem.M @ vectors))
    return vectors


def _split_by_forces(motions: Array, forces: Sequence[Array], noise: float) -> tuple[Array, Array]:
    """Combinations of orthonormal motions (n, k) with forces up to `noise`, and the others.

    forces: of the motions. The first combinations are orthonormal, the others have forces of unit
    size together.
    """
    _, sizes, coordinates = np.linalg.svd(np.vstack(forces), full_matrices=False)
    combinations = motions @ coordinates.T
    is_free = sizes <= noise
    return combinations[:, is_free], combinations[:, ~is_free] / sizes[~is_free]


class _SweptStiffness:
    """K over the free parameter: signs of its determinant, and where it is regular."""

    def __init__(self, scaled: ScaledSystem, values: Sequence[float]) -> None:
        self.scaled = scaled
        self.name = scaled.system.parameter
        self._signs: dict[float, float] = {}
        slopes = set()
        for value in values:
            p = scaled.system.values({self.name: value})
            slopes.add(tuple(term.factor.slope(p, self.name) for term in scaled.system.K))
        # K that is linear in the parameter differs most from that of the middle at the ends
        self._inner_values = values if len(slopes) > 1 else ()

    def at(self, value: float) -> csc_array:
        """K at a value of the parameter."""
        return self.scaled.at({self.name: value}).K

    @property
    def is_singular_everywhere(self) -> bool:
        """Whether det K has been zero at all values so far: a free motion changes with the
        parameter."""
        signs = list(self._signs.values())
        return bool(signs) and not any(signs)

    @staticmethod
    def middle(a: float, b: float) -> float:
        """A value next to the middle of a and b: in the middle symmetry may make K singular."""
        return a + 0.4871 * (b - a)

    def sign(self, value: float) -> float:
        """The sign of det K: 1, -1, or 0 if K is singular to rounding, as with rigid bodies."""
        if value not in self._signs:
            self._signs[value] = self._computed_sign(value)
        return self._signs[value]

    def _computed_sign(self, value: float) -> float:
        try:
            factor = Factor(self.at(value))
        except ZeroDivisionError:
            return 0.0
        pivots = np.abs(factor.lu.U.diagonal())
        if pivots.min() <= 2 * EPS * pivots.max():
            return 0.0
        return math.copysign(1.0, math.cos(factor.logarithm().imag))

    def contracts(self, a: float, b: float, close_crossings: Sequence[CrossingGuess]) -> bool:
        """True if 1 - K(middle)^-1 K contracts at a, at b and at the inner values between them.

        K is then regular from a to b, apart from the null vectors at `close_crossings`, values
        close to a or b at which K is singular.
        """
        K = self.at(self.middle(a, b))
        basis = np.zeros((K.shape[0], 0))
        if close_crossings:
            columns: list[NDArray] = []
            for crossing in close_crossings:
                columns += [crossing.right, crossing.left]
            basis = enlarged(basis, np.column_stack(columns), DROPPED_PART)
        try:
            factor = factorise(K)
        except ZeroDivisionError:
            return False
        # the directions outside of the basis, in which `contraction` is judged
        complement = Complement(basis, projected=basis.T @ (K @ basis), matrix=K, factor=factor)
        tried = [a, b, *(value for value in self._inner_values if a < value < b)]
        return all(complement.contraction(self.at(p)) < LARGEST_CONTRACTION for p in tried)


def singular_between(
    stiffness: _SweptStiffness, low: float, high: float, edge: float
) -> CrossingGuess | None:
    """Where K is singular between the values low and high of the free parameter: a guess with
    omega 0 and the unit null vectors x, y of K.

    By Newton's method on y' K(p) x = 0 from the middle, alternating with inverse iteration for x
    and y, until a step is at most 1e-3 of `edge`, half the width that the caller cuts out. None if
    the method leaves the interval or does not converge.
    """
    value = (low + high) / 2
    x, y = np.random.default_rng(1).standard_normal((2, stiffness.at(low).shape[0]))
    for _ in range(NEWTON_STEPS):
        K = stiffness.at(value)
        slope = stiffness.scaled.slope(stiffness.name, {stiffness.name: value}, 0.0)
        with suppress(ZeroDivisionError), np.errstate(all="ignore"):
            factor = factorise(K)
            # inverse iteration on the pencil (K, dK/dp): null vectors of K + m dK/dp for the
            # smallest m; where K is exactly singular x and y stay as they were
            for _ in range(3):
                x = factor.solve(slope @ x)
                y = factor.solve(slope.T @ y, transposed=True)
                x = x / np.linalg.norm(x)
                y = y / np.linalg.norm(y)
        with np.errstate(all="ignore"):  # a vanishing slope gives a step of NaN
            step = -float(y @ (K @ x)) / float(y @ (slope @ x) or np.nan)
        value += step
        if not low < value < high:  # NaN too
            return None
        if abs(step) <= 1e-3 * edge:
            return CrossingGuess(value, 0.0, x, y)
    return None
