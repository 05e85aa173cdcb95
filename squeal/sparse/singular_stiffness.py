"""Where K becomes singular along a parameter: a real root passes zero, a static loss of stability.

Such a root may come from far above a band and leave it again between two values of the parameter,
so that no spectrum shows it. If det K has different signs at the ends of a part of the range, an
odd number of roots pass zero in it. If 1 - K(middle)^-1 K contracts, none does.

Free motions X, with K X = 0 at all parameters, hide other roots that pass zero. Then K is bordered
by M X: if C X lies in the span of M X, [[K, M X], [(M X)', 0]] is singular where another root is
zero. The vectors of that root are known only up to free motions, so that it is reported without
being located.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_array

from squeal.linear.matrices import EPS, Array
from squeal.sparse.crossings import NEWTON_STEPS, CrossingGuess
from squeal.sparse.dense import STIFFNESS_ROUNDING
from squeal.sparse.eigensolver import enlarged
from squeal.sparse.factor import Factor, factorise, factorise_at
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.reduction import Complement

if TYPE_CHECKING:
    from scipy.sparse import csc_array

SHORTEST_PART = 2.0**-10  # of the range: shorter parts are not halved
MOST_PARTS = 200  # that are examined at most
NEAR_ZERO = 1e-6  # of the frequency scale: far below the lowest roots that are not zero
MOST_FREE = 12  # free motions, of two bodies
LARGEST_CONTRACTION = 0.4  # below 1, since few powers of T may underestimate its contraction
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
        The full system, real.
    values : sequence of float
        Of the parameter, rising: the ends of the range, and others at which the contraction is
        computed too if K is not linear in the parameter.

    Returns
    -------
    crossings : list of CrossingGuess
        With omega 0, in no order.
    unclear : list of str
        A sentence for each change of sign without a located crossing, for each singular K of a
        system with free motions, of which no crossing is given, and for free motions that prevent
        the search.
    """
    stiffness = _SweptStiffness(scaled, values)
    if not stiffness.is_border_valid:
        return [], ["beside so many free motions, or so damped ones, no static loss is looked for"]
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
        if sign_changes or is_last:  # else the search may be in vain, and halving is cheaper
            crossing = singular_between(stiffness, a, b, edge)
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
    if stiffness.border.size:
        for crossing in crossings:
            where = f"{stiffness.name} = {crossing.value:.6g}"
            unclear.append(f"a real root passes zero near {where}, beside free motions")
        return [], unclear
    return crossings, unclear


class _SweptStiffness:
    """K over the free parameter, bordered: signs of its determinant, and where it is regular."""

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
        self.border, self.is_border_valid = self._inertia_of_free_motions(values)

    def _inertia_of_free_motions(self, values: Sequence[float]) -> tuple[Array, bool]:
        """M X (n, k) of the free motions X, scaled to the size of K, and whether this border is
        valid: X are all free motions, and C X lies in the span of M X at all values."""
        problems = [self.scaled.at({self.name: value}) for value in values]
        problem = problems[0]
        damping_size = max(at_value.norms[1] for at_value in problems)
        stiffness_size = max(at_value.norms[2] for at_value in problems)
        # inverse iteration on K + s^2 M, s just above zero (C would mix in other motions), which
        # leaves free motions and rounding
        undamped = replace(problem, C=0.0 * problem.C)
        _, factor = factorise_at(undamped, complex(NEAR_ZERO * problem.frequency_scale))
        vectors = np.random.default_rng(2).standard_normal((problem.n, MOST_FREE))
        for _ in range(2):
            vectors, _ = np.linalg.qr(factor.solve(problem.M @ vectors))
        forces = np.vstack([at_value.K @ vectors for at_value in problems])
        _, sizes, coordinates = np.linalg.svd(forces, full_matrices=False)
        free = vectors @ coordinates[sizes <= STIFFNESS_ROUNDING * stiffness_size].T
        inertia = problem.M @ free
        directions, _ = np.linalg.qr(inertia)
        # as many as were searched: there may be more
        is_valid = free.shape[1] < min(MOST_FREE, problem.n)
        for at_value in problems:
            damping = at_value.C @ free
            others = damping - directions @ (directions.T @ damping)
            is_valid &= bool(np.all(np.abs(others) <= STIFFNESS_ROUNDING * damping_size))
        return problem.frequency_scale**2 * inertia, is_valid

    def at(self, value: float) -> csc_array:
        """K at a value of the parameter, bordered."""
        K = self.scaled.at({self.name: value}).K
        return block_array([[K, self.border], [self.border.T, None]], format="csc")

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
        complement = Complement(basis, projected=basis.T @ (K @ basis), matrix=K, factor=factor)
        tried = [a, b, *(value for value in self._inner_values if a < value < b)]
        return all(complement.contraction(self.at(p)) < LARGEST_CONTRACTION for p in tried)


def singular_between(
    stiffness: _SweptStiffness, low: float, high: float, edge: float
) -> CrossingGuess | None:
    """Where K, bordered, is singular between two values of the free parameter: a guess with omega 0
    and the unit null vectors x, y of the bordered K.

    By Newton's method on y' K(p) x = 0 from the middle, alternating with inverse iteration for x
    and y, until a step is at most 1e-3 of `edge`, half the width that the caller cuts out. None if
    the method leaves the interval or does not converge.
    """
    value = (low + high) / 2
    x, y = np.random.default_rng(1).standard_normal((2, stiffness.at(low).shape[0]))
    for _ in range(NEWTON_STEPS):
        K = stiffness.at(value)
        slope = stiffness.scaled.slope(stiffness.name, {stiffness.name: value}, 0.0)
        slope.resize(K.shape)  # zeros in the border
        with suppress(ZeroDivisionError), np.errstate(all="ignore"):
            factor = factorise(K)
            # inverse iteration on the pencil (K, dK/dp): null vectors of K + m dK/dp for the
            # smallest m; where K is exactly singular x and y stay as they were
            for _ in range(3):
                x = factor.solve(slope @ x)
                y = factor.solve(slope.T @ y, transposed=True)
                x = x / np.linalg.norm(x)
                y = y / np.linalg.norm(y)
        with np.errstate(all="ignore"):
            step = -float(y @ (K @ x)) / float(y @ (slope @ x) or np.nan)
        value += step
        if not low < value < high:  # NaN too
            return None
        if abs(step) <= 1e-3 * edge:
            return CrossingGuess(value, 0.0, x, y)
    return None
