"""How far numbers move when sensitive motions are repeated from starts that differ by rounding.

A long motion through many impacts forgets its start: another processor, which rounds otherwise,
computes another one, and what is counted or averaged moves. A study repeats such motions and says
in its result how far each number went. Tables and the text print that beside the number, sentences
must hold at both ends, and other machines must come to numbers within reach.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from squeal.article.records import Moved, Result, from_dict, to_dict

R = TypeVar("R", bound=Result)
SIZE = 1e-10  # of the disturbance of a start, relative
SAME = 1e-6  # numbers that lie nearer, relative to their size, do not count as moved


def disturbed(states: np.ndarray, repeat: int) -> np.ndarray:
    """States (n, 6) changed relatively by up to `SIZE`, otherwise for each repeat; 0 changes
    nothing."""
    if repeat == 0:
        return states
    draws = np.random.default_rng(repeat).uniform(-1.0, 1.0, states.shape)
    return states * (1.0 + SIZE * draws)


def numbers(value: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """The numbers of a record, each with its path: keys and indices, dots between.

    path: of the value itself.
    """
    plain = to_dict(value)
    if isinstance(plain, Mapping):
        entries = [*plain.items()]
    elif isinstance(plain, list):
        entries = [*enumerate(plain)]
    else:
        if isinstance(plain, (int, float)) and not isinstance(plain, bool):
            yield path, plain
        return  # text, None, or a bool have no numbers
    for key, entry in entries:
        yield from numbers(entry, f"{path}.{key}" if path else str(key))


def moved(key: str, repeats: Sequence[Any]) -> tuple[Moved, ...]:
    """The numbers that differ between repeats of a record, with their least and greatest values.

    key: the path of the record in its result.
    """
    by_path = [dict(numbers(record, key)) for record in repeats]
    differing: list[Moved] = []
    for path in by_path[0]:
        values = [of_repeat[path] for of_repeat in by_path if path in of_repeat]
        low = min(values)
        high = max(values)
        if high - low > SAME * max(abs(low), abs(high)):
            differing.append(Moved(path, low, high))
    return tuple(differing)


def at_ends(result: R) -> tuple[R, ...]:
    """The result as it is, with all numbers that moved at their low ends, and at their high ones.

    Raises KeyError or IndexError where the spread names a number that is not there.
    """
    if not result.spread:
        return (result,)
    low = {entry.key: entry.low for entry in result.spread}
    high = {entry.key: entry.high for entry in result.spread}
    return (result, _with_numbers(result, low), _with_numbers(result, high))


def _with_numbers(result: R, changes: Mapping[str, float]) -> R:
    """The result with other numbers at some paths, as `numbers` writes them."""
    plain = to_dict(result)
    for path, value in changes.items():
        *parents, last = path.split(".")
        entry: Any = plain
        for part in parents:
            entry = entry[_index(entry, part)]
        entry[_index(entry, last)] = value
    return from_dict(type(result), plain)


def _index(entry: Any, part: str) -> int | str:
    """A part of a path as a list or a mapping takes it."""
    return int(part) if isinstance(entry, list) else part
