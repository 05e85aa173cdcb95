"""Numbers as options name them, between colons where there are several."""

import math
from collections.abc import Callable

from squeal.errors import InputError

MOST = 100_000  # values of a parameter


def numbers(
    given: str, option: str, count: int, words: str, holds: Callable[..., bool] | None = None
) -> tuple[float, ...]:
    """So many finite numbers of which `holds` is true, as `words` say. Raises InputError."""
    try:
        found = tuple(map(float, given.split(":")))
    except ValueError:
        found = ()
    right = len(found) == count and all(map(math.isfinite, found))
    if not right or not (holds is None or holds(*found)):
        raise InputError(f"{option} {given}: is not allowed; it must be {words}")
    return found


def whole(given: str, option: str, low: int, high: int = 10**9) -> int:
    """A whole number in a range. Raises InputError."""
    words = f"a whole number from {low} to {high}"
    return int(*numbers(given, option, 1, words, lambda n: n == int(n) and low <= n <= high))


def spaced(given: str, option: str, low: float = -math.inf, high: float = math.inf) -> list[float]:
    """The N values from A to B that A:B:N names, within low and high. Raises InputError."""
    ends = f"{low:g} <= A < B <= {high:g}" if math.isfinite(high) else "A < B"

    def holds(a: float, b: float, n: float) -> bool:
        return low <= a < b <= high and n == int(n) and 2 <= n <= MOST

    words = f"A:B:N with {ends} and a whole number N from 2 to {MOST}"
    a, b, n = numbers(given, option, 3, words, holds)
    return [a + (b - a) * i / (int(n) - 1) for i in range(int(n))]


def band_of(given: str, option: str = "--band") -> tuple[float, float]:
    """The ends of a band of frequencies, LOW:HIGH. Raises InputError."""
    words = "LOW:HIGH in Hz with 0 <= LOW < HIGH, such as 500:8000"
    low, high = numbers(given, option, 2, words, lambda low, high: 0.0 <= low < high)
    return low, high


def few(values: list[float], most: int) -> list[float]:
    """At most so many of the values, both ends included."""
    if len(values) <= most:
        return values
    return [values[round(k * (len(values) - 1) / (most - 1))] for k in range(most)]
