"""To how many digits, or decimals, the numbers of a text file are written."""

import re
from collections import Counter
from collections.abc import Iterable
from itertools import islice

SAMPLED = 10_000  # numbers of a file that are looked at
FEWEST = 6  # digits: shorter numbers were typed by hand and are exact
MOST = 15  # digits: longer ones hold doubles
FEWEST_DECIMALS = 4  # fewer were typed by hand


def _mantissa(word: str) -> str:
    """The significant digits of a number as written, empty of a zero."""
    return re.split("[DdEe]", word, maxsplit=1)[0].lstrip("+-").replace(".", "").lstrip("0")


def written_digits(words: Iterable[str]) -> int | None:
    """The number of significant digits that numbers were rounded to when they were written.

    It is the number of digits with which more than half of the non-zero numbers are written. In
    columns of fixed width a minus may take the place of a digit: the usual numbers of digits of
    positive and of negative numbers may differ by one, and the smaller counts. Numbers that all end
    in 00 were padded, not rounded, and do not count. None unless it lies from 6 to 15: other
    numbers are exact, or doubles.

    words: the numbers as they are written, of which the first `SAMPLED` are looked at.

    >>> written_digits(["1.2345678901E+05", "2.5000000000E+00", "0.0"])
    11
    >>> written_digits(["1.2345678901E+05", "-2.507312345E+00"])
    10
    >>> written_digits(["2.0", "-1", "1000000.0"]), written_digits(["0.12345678901234567"])
    (None, None)
    """
    positive: list[str] = []
    negative: list[str] = []
    for word in islice(words, SAMPLED):
        digits = _mantissa(word)
        if digits and word.startswith("-"):
            negative.append(digits)
        elif digits:
            positive.append(digits)
    rarer_sign, usual_sign = sorted([negative, positive], key=len)
    length, count = _usual_length(usual_sign)
    rarer_length, rarer_count = _usual_length(rarer_sign)
    lengths = [length]
    if rarer_length and abs(rarer_length - length) <= 1:  # a minus took the place of one digit
        lengths.append(rarer_length)
        count += rarer_count
    is_usual = 2 * count > len(positive) + len(negative)
    if is_usual and min(lengths) >= FEWEST and max(lengths) <= MOST:
        return min(lengths)
    return None


def written_decimals(words: Iterable[str]) -> int | None:
    """The number of decimals to which all numbers were rounded when they were written, as by %.6f.

    None if numbers have exponents, no decimals or different numbers of decimals, and if these are
    fewer than 4. None also if the longest number has fewer than 6 significant digits (it may have
    been typed by hand) or more than 15 (it may be a double).

    >>> written_decimals(["12345.678901", "-0.001235"]), written_decimals(["1.5", "0.25"])
    (6, None)
    """
    counts = set()
    longest = 0
    for word in islice(words, SAMPLED):
        _, _, decimals = word.partition(".")
        counts.add(len(decimals))
        longest = max(longest, len(_mantissa(word)))
        if not decimals.isdecimal():  # an exponent, or a whole number
            return None
    may_be_rounded = FEWEST <= longest <= MOST  # neither typed by hand nor a double
    if may_be_rounded and len(counts) == 1 and min(counts) >= FEWEST_DECIMALS:
        return min(counts)
    return None


def _usual_length(mantissas: list[str]) -> tuple[int, int]:
    """The most frequent number of digits, and how many mantissas have it.

    0 and 0 without mantissas, or if all of that length end in two zeros.
    """
    if not mantissas:
        return 0, 0
    ((length, count),) = Counter(map(len, mantissas)).most_common(1)
    for digits in mantissas:
        if len(digits) == length and not digits.endswith("00"):
            return length, count
    return 0, 0
