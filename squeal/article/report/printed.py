"""Whether two printed texts say the same.

Numbers with a spread agree where the two ranges meet. "Less than" a number stands for all from zero
on: bounds of rounding are another on each processor.
"""

import re
from itertools import zip_longest

Range = tuple[float, float]
_NUMBER = r"\$?(-?\d+(?:\.\d+)?)(?: \\times 10\^\{(-?\d+)\})?\$?"
_PRINTED = re.compile(rf"(less than |\$<\$ ?)?{_NUMBER}(?: \({_NUMBER}--{_NUMBER}\))?")


def split(text: str) -> tuple[list[str], list[str]]:
    """The text between the numbers, and the numbers as they are printed, with their spread."""
    between = []
    found = []
    end = 0
    for match in _PRINTED.finditer(text):
        between.append(text[end : match.start()])
        found.append(match[0])
        end = match.end()
    return [*between, text[end:]], found


def range_of(printed: str) -> Range:
    """The range that a printed number stands for, of one value where it has no spread."""
    match = _PRINTED.fullmatch(printed)
    if match is None:
        raise ValueError(f"{printed} is no printed number")
    value = _value(match[2], match[3])
    if match[1] is not None:
        return 0.0, value
    low = value if match[4] is None else _value(match[4], match[5])
    high = value if match[6] is None else _value(match[6], match[7])
    return low, high


def _value(digits: str, exponent: str | None) -> float:
    return float(f"{digits}e{exponent or 0}")


def meet(one: Range, other: Range) -> bool:
    """Whether two ranges have a value in common."""
    return one[0] <= other[1] and other[0] <= one[1]


def same(one: str, other: str) -> bool:
    """Whether two texts say the same."""
    if one == other:
        return True
    between, numbers = split(one)
    other_between, other_numbers = split(other)
    if between != other_between:
        return False
    pairs = zip(numbers, other_numbers, strict=True)
    return all(meet(range_of(a), range_of(b)) for a, b in pairs)


def differences(before: str, after: str) -> list[str]:
    """The lines in which two texts do not say the same, as "before -> after"."""
    pairs = zip_longest(before.splitlines(), after.splitlines(), fillvalue="nothing")
    return [f"{one} -> {other}" for one, other in pairs if not same(one, other)]
