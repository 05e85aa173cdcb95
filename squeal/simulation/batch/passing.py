"""Where polynomials pass zero, as expressions without branches."""

import itertools
import math
from dataclasses import dataclass
from functools import reduce
from typing import Any

import heyoka as hy

from squeal.simulation.batch.series import Number, total

PASSES = 4  # of Newton's method
CLOSE = 1e-24  # square of its last correction, as a share of the step, at which it has converged


def choose(condition: Any, yes: Number, no: Number) -> Any:
    """`yes` where the condition holds, else `no`."""
    return hy.select(condition, hy.expression(yes), hy.expression(no))


def positive(value: Any) -> Any:
    """The condition that a value is above zero."""
    return hy.gt(value, hy.expression(0.0))


def below(value: Any, limit: float) -> Any:
    """1 where a value is below a limit, else 0."""
    return choose(hy.lt(value, hy.expression(limit)), 1.0, 0.0)


def least(a: Any, b: Number) -> Any:
    """The lesser of two values."""
    return choose(hy.lt(a, hy.expression(b)), a, b)


def most(a: Any, b: Number) -> Any:
    """The greater of two values."""
    return choose(hy.gt(a, hy.expression(b)), a, b)


def horner(coefficients: list[Number], at: Number) -> Any:
    """The value of a polynomial."""
    return reduce(lambda value, c: value * at + c, reversed(coefficients))


def bernstein(a: list[Number]) -> list[Number]:
    """The coefficients over [0, 1] of a polynomial in Bernstein form."""
    n = len(a) - 1
    row = [c * (1.0 / math.comb(n, k)) for k, c in enumerate(a)]
    found = [row[0]]
    while len(row) > 1:
        row = [here + there for here, there in itertools.pairwise(row)]
        found.append(row[0])
    return found


@dataclass(frozen=True)
class Passing:
    """Where a polynomial first rises above zero in [0, 1], it being negative at first.

    ends: it is above zero at 1 (1 or 0); sure: it passes zero once, at `at`, or never (1 or 0).
    """

    ends: Any
    sure: Any
    at: Any


def passing(a: list[Number]) -> Passing:
    """See `Passing`; a first coefficient above zero is taken for rounding.

    The polynomial lies between its Bernstein coefficients and passes zero at most as often as they
    change sign, as often but for an even number.
    """
    n = len(a) - 1
    b = bernstein(a)
    b[0] = least(b[0], 0.0)
    above = [hy.expression(0.0)] + [choose(positive(value), 1.0, 0.0) for value in b[1:]]
    up = [(1.0 - above[j - 1]) * above[j] for j in range(1, n + 1)]
    down = [(1.0 - above[j]) * above[j - 1] for j in range(2, n + 1)]
    turns = total(up + down)
    never, once = below(turns, 0.5), below(turns, 1.5)
    # Newton's method sets out from where the polygon of the coefficients passes
    low = total([here * value for here, value in zip(up, b[:-1], strict=True)])
    high = total([here * value for here, value in zip(up, b[1:], strict=True)]) + never
    first = total([here * float(j) for j, here in enumerate(up)])
    at = least((first + low / (low - high)) * (1.0 / n), 1.0)
    slopes = [c * float(k) for k, c in enumerate(a)][1:]
    moved = hy.expression(1.0)
    for _ in range(PASSES):
        slope = horner(slopes, at)
        slope = choose(positive(slope), slope, 1.0)
        better = most(least(at - horner(a, at) / slope, 1.0), 0.0)
        at, moved = better, better - at
    exact = below(moved * moved, CLOSE)
    return Passing(above[-1], never + (1.0 - never) * once * exact, at)


def before_zero(a: list[Number]) -> Any:
    """A share of [0, 1] in which a polynomial that is above zero at 0 stays there, at most 1."""
    # by Cauchy's inequality for all but the first two coefficients
    rest = total([value * value for value in a[2:]]) * float(len(a) - 2)
    fall = hy.sqrt(2.0 * (a[1] * a[1] + rest) + 1e-300)
    return least(most(a[0], 0.0) * (0.9 / fall), 1.0)
