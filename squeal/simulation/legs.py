"""What an integrator hands over: a leg of motion within one contact state."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from squeal.model.states import State

# Where the model ends: what has happened when a limit is reached.
LIMITS = (
    "the pad has turned past 90 degrees",
    "spring 1 has collapsed to zero length",
    "spring 2 has collapsed to zero length",
    "the pad has reached the speed V of the surface, beyond which friction that falls with speed "
    "means nothing,",
)
# Share of its free length at which a spring counts as collapsed: the direction of its force, and
# with it the motion, jumps at zero.
COLLAPSED = 1e-6


class Leg(NamedTuple):
    """Smooth motion from t0 to t1 in one contact state, in natural units.

    `point` is the contact point whose gap ended the leg (0 leading edge, 1 trailing edge in B1 and
    B2), None where the leg ended at the wanted time or because it grew long; `limit` is the entry
    of `LIMITS` at which the model ends there. `dense(t)` gives the state (len(t), 6) and `nodes`
    the step times from t0 to t1; both are None unless dense output was asked for.
    """

    contact: State
    t0: float
    t1: float
    end: np.ndarray
    point: int | None
    steps: int
    limit: str | None = None
    nodes: np.ndarray | None = None
    dense: Callable[[np.ndarray], np.ndarray] | None = None


class Integrator(Protocol):
    """Carries the motion on, at the tolerance that it keeps to."""

    method: str
    tolerance: float

    def legs(
        self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool
    ) -> list[Leg]:
        """Legs from (t, state) on; each but the last ends by the change of its point alone, all
        others being clear of the surface.

        Integrators that stop at each change return one leg.
        """
        return [self.advance(contact, t, state, stop, dense)]

    def advance(self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool) -> Leg:
        """Integrate from (t, state) until a point's gap passes zero in the direction that ends
        `contact`, until `stop`, or for a bounded number of steps."""
