"""Signs of a polynomial whose coefficients are balls, over intervals of its variable.

Needs python-flint.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from squeal.proof.balls import EPS, Ball

try:
    import flint
except ImportError:  # an extra
    flint = None

Polynomial = Any
"""A `flint.arb_poly` in t."""
MOST_PARTS = 400
"""How many intervals are examined at most, halves of others among them; what is left is unknown."""
NARROWEST_PART = 1e-13
"""An interval of t that is not divided any more."""


class Sign(NamedTuple):
    """The sign 1 or -1 of a function from t = low to high, 0 where it is not known."""

    low: float
    high: float
    sign: int


def first_with_sign(pieces: Sequence[Sign], sign: int) -> float:
    """Where the first piece with a sign begins; 1, the end of a cell, if none has it."""
    for piece in pieces:
        if piece.sign == sign:
            return piece.low
    return 1.0


def signs(polynomial: Polynomial, low: float, high: float) -> list[Sign]:
    """The signs of a polynomial with balls as coefficients, for t from low to high in -1..1.

    The pieces follow each other without gaps, and neighbours have different signs. The polynomial
    differs from D, the polynomial of the midpoints, by at most the sum of the radii, the
    `uncertainty`. An interval is halved until D is certain there, or monotonic, so that its values
    at the ends decide.
    """
    coefficients_of_balls = polynomial.coeffs()
    D = flint.arb_poly([c.mid() for c in coefficients_of_balls])
    uncertainty = sum((c.rad() for c in coefficients_of_balls), flint.arb(0))
    pieces: list[Sign] = []
    waiting = [(low, high)]  # intervals, the leftmost last
    for _ in range(MOST_PARTS):
        if not waiting:
            break
        left, right = waiting.pop()
        decided = _signs_of_part(D, uncertainty, left, right)
        if decided is None:
            middle = (left + right) / 2.0
            waiting += [(middle, right), (left, middle)]
            continue
        pieces += decided
    for left, right in waiting[::-1]:
        pieces.append(Sign(left, right, 0))
    joined: list[Sign] = []
    for piece in pieces:
        if joined and joined[-1].sign == piece.sign:
            joined[-1] = Sign(joined[-1].low, piece.high, piece.sign)
        elif piece.high > piece.low:
            joined.append(piece)
    return joined


def _signs_of_part(D: Polynomial, uncertainty: Ball, low: float, high: float) -> list[Sign] | None:
    """The signs of D, known up to the uncertainty, in an interval; None if it has to be halved.

    With D(middle + half s) = c0 + c1 s + c2 s^2 + ... for |s| <= 1, D has the sign of c0 if
    |c0| - |c1| - |c2| - ... exceeds the uncertainty, and is monotonic if
    |c1| > 2 |c2| + 3 |c3| + ... Of two balls a > b holds only if it does for all of their numbers.
    """
    middle = (low + high) / 2.0
    # rounded up, so that -1 <= s <= 1 covers the interval
    half = (high - low) / 2.0 * (1.0 + 4.0 * EPS) + EPS
    centred = D(flint.arb_poly([middle, half])).coeffs()
    sizes = [abs(c) for c in centred]
    variation = sum(sizes[1:], flint.arb(0))
    if not centred or sizes[0] + variation <= uncertainty:  # D is zero, or nowhere certain
        return [Sign(low, high, 0)]
    if sizes[0] - variation > uncertainty:
        return [Sign(low, high, 1 if centred[0] > 0 else -1)]
    slope_variation = flint.arb(0)
    for k in range(2, len(sizes)):
        slope_variation += k * sizes[k]
    if len(centred) > 1 and sizes[1] > slope_variation:
        return _signs_where_monotonic(D, uncertainty, low, high)
    if high - low < NARROWEST_PART:
        return [Sign(low, high, 0)]
    return None


def _signs_where_monotonic(D: Polynomial, uncertainty: Ball, low: float, high: float) -> list[Sign]:
    """Signs of D in an interval in which D is monotonic.

    Bisection from each end of the interval finds how far the sign at that end extends; between the
    two lies at most a piece of unknown sign.
    """

    def sign_at(t: float) -> int:
        value = D(flint.arb(t))
        if value > uncertainty:
            return 1
        if value < -uncertainty:
            return -1
        return 0

    def last_with_sign(sign: int, inside: float, outside: float) -> float:
        """The double farthest from the end `inside` at which D still has `sign`, its sign there.

        `inside` itself for the sign 0, which is unknown.
        """
        while sign:
            t = (inside + outside) / 2.0
            if t in (inside, outside):  # no double lies between
                break
            if sign_at(t) == sign:
                inside = t
            else:
                outside = t
        return inside

    first = sign_at(low)
    last = sign_at(high)
    if first == last:
        return [Sign(low, high, first)]
    first_end = last_with_sign(first, low, high)
    last_start = last_with_sign(last, high, low)
    return [
        Sign(low, first_end, first),
        Sign(first_end, last_start, 0),
        Sign(last_start, high, last),
    ]
