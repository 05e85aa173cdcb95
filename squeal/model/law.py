"""What a contact law declares; everything else asks the law and never the model's name."""

from collections.abc import Hashable, Mapping, Sequence
from typing import Literal, NamedTuple, Protocol

import numpy as np

from squeal.model.mechanics import Coefficients, Forces, Loads, Number, Pose
from squeal.model.states import State

Touching = Sequence[Number] | np.ndarray
"""A contact state as factors 1 and 0, one for each contact point: a `State` (bools), or numbers,
arrays or symbols, so that one formula serves all states."""


class Signal(NamedTuple):
    """A quantity that is plotted and whose range is given, over a scale.

    over: the parameter that it is divided by, F_n for a force and w for a place; symbol: as TeX;
    title: short, for a panel; words: in a sentence.
    """

    name: str
    over: Literal["F_n", "w"]
    symbol: str
    title: str
    words: str

    @property
    def is_force(self) -> bool:
        """True for a force, which is nowhere negative and zero while the surfaces are apart."""
        return self.over == "F_n"


class ContactLaw(Hashable, Protocol):
    """Loads on the pad from unilateral contact at points of its lower face.

    Pure formulas over generic numbers: c are the pad's coefficients, `at` its pose, `on` says
    which contact points touch. A law is hashable and holds no state.

    parameters: names of the stiffnesses of `Pad` that it uses; absolute_gap: the surface lies at
    y = -h and y0, theta0 open a gap, instead of contact that is relaxed in the initial position;
    restoring: its moment turns the pad back, so that without friction a pad rests in one place
    near the initial one; plotted: its signals; meanings: name and meaning of each contact
    state, as the article or the field counts them.
    """

    @property
    def parameters(self) -> tuple[str, ...]: ...

    @property
    def absolute_gap(self) -> bool: ...

    @property
    def restoring(self) -> bool: ...

    @property
    def plotted(self) -> tuple[Signal, ...]: ...

    @property
    def meanings(self) -> Mapping[str, str]: ...

    @property
    def points(self) -> int:
        """How many contact points there are, in order from the leading edge to the trailing."""

    def state_name(self, state: State) -> str:
        """The name of a contact state, one of `meanings`."""

    def gaps(self, c: Coefficients, at: Pose) -> tuple[Number, ...]:
        """Height of each contact point over the surface; contact changes where it passes zero."""

    def forces(self, c: Coefficients, at: Pose, on: Touching) -> Forces:
        """Normal and friction forces; zero where nothing touches."""

    def loads(self, c: Coefficients, at: Pose, on: Touching) -> Loads:
        """These forces and their moment."""

    def signals(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Number, ...]:
        """The signals `plotted`, in units of force and length; a place is 0/0 apart: NaN in
        arrays."""

    def resultant(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Number, Number]:
        """Total normal reaction and its distance from the mass centre along x, 0/0 apart."""

    def energy(self, c: Coefficients, at: Pose, on: Touching) -> Number:
        """Potential energy of the contact."""


NORMAL_REACTION = (
    Signal("Rn", "F_n", "R_n", "normal reaction", "normal reaction"),
    Signal("delta", "w", r"\delta", "place of the reaction", "place of the reaction"),
)
FACE_STATES = {"FC": "full contact", "PC": "partial contact", "SS": "surface separation"}


def face_state(state: State) -> str:
    """The article's name of a face's contact (Fig. 8)."""
    return "FC" if all(state) else "PC" if any(state) else "SS"
