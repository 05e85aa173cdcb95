"""The transitions between contact states that the article counts (Tables 1 and 2, Figs. 3, 8)."""

from typing import NamedTuple

from squeal.model.contact import FULL, LEADING, NONE, STATES, TRAILING, State

EDGE_NAMES = ("leading", "trailing")


class Transition(NamedTuple):
    """One contact point changes: `rising` means that its gap passes zero upwards."""

    source: State
    target: State
    point: int
    rising: bool


def transitions() -> list[Transition]:
    """The eight transitions that flip one edge, two out of each state in turn."""
    return [
        Transition(state, state.flip(edge), edge, rising=state[edge])
        for state in STATES
        for edge in (LEADING, TRAILING)
    ]


class Condition(NamedTuple):
    """A row group of Table 1: a change of state and the edges that must pass at once.

    edges: pairs (edge, rising), where rising means that the edge separates.
    """

    source: State
    target: State
    edges: tuple[tuple[int, bool], ...]

    @property
    def codimension(self) -> int:
        """How many gaps must vanish together; two is not met by a generic motion."""
        return len(self.edges)


def conditions() -> list[Condition]:
    """Table 1: the single transitions, and 1-2 and 2-1 in which both edges pass at once."""
    both = [
        Condition(a, b, tuple((edge, a[edge]) for edge in (LEADING, TRAILING)))
        for a, b in ((FULL, NONE), (NONE, FULL))
    ]
    single = [Condition(t.source, t.target, ((t.point, t.rising),)) for t in transitions()]
    number = STATES.index  # as the article counts them
    return sorted(
        both + single,
        key=lambda c: (sorted((number(c.source), number(c.target))), number(c.source)),
    )
