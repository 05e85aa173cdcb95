"""What lies close together on a line."""

from collections.abc import Callable, Iterable
from typing import TypeVar

T = TypeVar("T")


def together(items: Iterable[T], near: float, value: Callable[[T], float]) -> list[list[T]]:
    """Items by rising value, those that are no further than `near` from the one before with it."""
    groups: list[list[T]] = []
    for one in items:
        if groups and value(one) - value(groups[-1][-1]) <= near:
            groups[-1].append(one)
        else:
            groups.append([one])
    return groups
