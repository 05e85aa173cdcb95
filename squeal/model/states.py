"""Contact states and the transitions between them (Tables 1 and 2, Figs. 3, 8).

A contact law watches some points of the lower face: its two edges, or more. A point separates when
its gap passes zero upwards and touches when it passes zero downwards, so every transition flips
one point. The integrators, the tables and the flow charts all read `states` and `transitions`.
"""

from __future__ import annotations

from functools import lru_cache

LEADING, TRAILING = 0, 1


class State(tuple[bool, ...]):
    """Which contact points touch, from the leading edge to the trailing edge: State(True, False).

    Its entries are the factors 1 and 0 of the contact laws' formulas.
    """

    __slots__ = ()

    def __new__(cls, *touching: bool) -> State:
        return super().__new__(cls, touching)

    def __getnewargs__(self) -> tuple[bool, ...]:
        return tuple(self)

    @property
    def leading(self) -> bool:
        """True if the point nearest to the leading edge touches."""
        return self[0]

    @property
    def trailing(self) -> bool:
        """True if the point nearest to the trailing edge touches."""
        return self[-1]

    def flip(self, point: int) -> State:
        """The state after a contact point (its index) has separated or touched."""
        return _flipped(self, point)


@lru_cache(maxsize=1024)  # asked at every contact change
def _flipped(state: State, point: int) -> State:
    return State(*(touches ^ (i == point) for i, touches in enumerate(state)))


FULL, NONE = State(True, True), State(False, False)
LEAD, TRAIL = State(True, False), State(False, True)


def states(points: int) -> tuple[State, ...]:
    """The states of a straight face with that many contact points: all touch, none, or those on
    the leading or on the trailing side."""
    some = range(points - 1, 0, -1)
    return (
        State(*[True] * points),
        State(*[False] * points),
        *(State(*(i < n for i in range(points))) for n in some),
        *(State(*(i >= points - n for i in range(points))) for n in some),
    )


STATES = states(2)
