"""How contact states look: one colour each, and a label."""

from squeal.model.contact import contact_law
from squeal.model.pad import Model
from squeal.model.states import LEAD, STATES, TRAIL

STATE_COLOURS = dict(zip(STATES, ("#3498DB", "#000000", "#6A1B7B", "#C8380E"), strict=True))
"""Colours of the states 1 to 4, told apart in normal and in colour-deficient vision."""


def colours(model: Model) -> dict[str, str]:
    """Colour of each state name of a model; B2's partial contact takes that of state 3."""
    found: dict[str, str] = {}
    for state in STATES:
        found.setdefault(contact_law(model).state_name(state), STATE_COLOURS[state])
    return found


def sided(model: Model) -> str | None:
    """The state that names partial contact at either edge, None where each edge has its own."""
    law = contact_law(model)
    name = law.state_name(LEAD)
    return name if name == law.state_name(TRAIL) else None


def state_label(state: str) -> str:
    """The name of a contact state, with a word before a mere number."""
    return f"state {state}" if state.isdigit() else state
