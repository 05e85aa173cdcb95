"""Contact states of models B1 and B2 and the transitions between them (Tables 1 and 2, Figs. 3, 8).

Both models are told apart by the same two facts: does the leading edge touch, does the trailing
edge touch. An edge separates when its gap passes zero upwards and touches when it passes zero
downwards, so every transition flips one edge. The integrator, the tables and the flow charts all
read `STATES` and `transitions`.
"""

from __future__ import annotations

from typing import NamedTuple

from squeal.model.pad import Model

LEADING, TRAILING = 0, 1
EDGE_NAMES = ("leading", "trailing")


class State(NamedTuple):
    """Which edges of the lower face are in contact."""

    leading: bool
    trailing: bool

    def flip(self, edge: int) -> State:
        """The state after the given edge (0 leading, 1 trailing) has separated or touched."""
        return State(self.leading ^ (edge == LEADING), self.trailing ^ (edge == TRAILING))


FULL, NONE = State(True, True), State(False, False)
LEAD, TRAIL = State(True, False), State(False, True)
STATES = (FULL, NONE, LEAD, TRAIL)

_NAMES: dict[str, dict[State, str]] = {
    "B1": {FULL: "1", NONE: "2", LEAD: "3", TRAIL: "4"},
    "B2": {FULL: "FC", NONE: "SS", LEAD: "PC", TRAIL: "PC"},
}
MEANINGS: dict[str, dict[str, str]] = {
    "B1": {
        "1": "both edges in contact",
        "2": "separated",
        "3": "leading edge only",
        "4": "trailing edge only",
    },
    "B2": {"FC": "full contact", "PC": "partial contact", "SS": "surface separation"},
}


def name(model: Model, state: State) -> str:
    """The article's name of a state: "1" to "4" (Fig. 3) or "SS", "PC", "FC" (Fig. 8)."""
    return _NAMES[model][state]


def names(model: Model) -> list[str]:
    """All state names of a model, in the article's order."""
    return list(MEANINGS[model])


class Transition(NamedTuple):
    """One edge changes: `rising` means that its gap passes zero upwards (contact is lost)."""

    source: State
    target: State
    edge: int
    rising: bool


def transitions() -> list[Transition]:
    """The eight transitions that flip one edge, out of each state in turn."""
    return [
        Transition(state, state.flip(edge), edge, rising=state[edge])
        for state in STATES
        for edge in (LEADING, TRAILING)
    ]


class Condition(NamedTuple):
    """A row group of Table 1: a named change of state and the edges that must pass at once."""

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
    single = [Condition(t.source, t.target, ((t.edge, t.rising),)) for t in transitions()]
    number = {state: int(text) for state, text in _NAMES["B1"].items()}
    return sorted(
        both + single,
        key=lambda c: (sorted((number[c.source], number[c.target])), number[c.source]),
    )


def observed(leading_touches: bool, trailing_touches: bool) -> State:
    """The state told by the sign of the two penetrations (Table 2 without Eq. 12)."""
    return State(bool(leading_touches), bool(trailing_touches))
