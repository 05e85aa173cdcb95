"""Contact by unilateral springs: at the two edges (model B1, Eqs. 4-7), or many along the face."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from squeal.model.law import FACE_STATES, NORMAL_REACTION, Signal, Touching, face_state
from squeal.model.mechanics import Coefficients, Forces, Loads, Number, Point, Pose, edges, gaps
from squeal.model.states import STATES, State

LIGHT = 1e-8  # of k_c w: a lighter touch leaves of delta's digits nothing but rounding


class Spring(NamedTuple):
    """A contact spring.

    place: along the lower face, -1 at the leading and 1 at the trailing edge; stiffness: the
    parameter that gives it, of which the spring has a share.
    """

    place: float
    stiffness: str
    share: float = 1.0


class Springs(ABC):
    """Unilateral springs along the lower face, whose points are the contact points.

    The face is straight. A spring at the place p therefore has the gap a g_l + b g_t of the gaps
    at the edges, a = (1 - p)/2 and b = (1 + p)/2, and loads the pad as the shares a and b of its
    force at the edges would. All springs together are a symmetric stiffness (2, 2) between the
    gaps of the edges and the forces there, and only that stiffness knows which of them touch.

    level_friction: friction acts at the arm h, as in Eq. (10), instead of where its edge is.
    """

    parameters: ClassVar[tuple[str, ...]]
    absolute_gap: ClassVar[bool]
    level_friction: ClassVar[bool]

    @property
    @abstractmethod
    def springs(self) -> tuple[Spring, ...]:
        """The springs, from the leading to the trailing edge."""

    @property
    def points(self) -> int:
        """How many springs there are."""
        return len(self.springs)

    @cached_property
    def _weights(self) -> tuple[tuple[float, float], ...]:
        return tuple(((1.0 - s.place) / 2.0, (1.0 + s.place) / 2.0) for s in self.springs)

    def gaps(self, c: Coefficients, at: Pose) -> tuple[Number, ...]:
        """Height of the foot of each spring over the surface."""
        gl, gt = gaps(c, at)
        return tuple(a * gl + b * gt for a, b in self._weights)

    def _stiffness(self, c: Coefficients, on: Touching) -> tuple[Number, Number, Number]:
        ll, lt, tt = 0.0, 0.0, 0.0
        for touches, spring, (a, b) in zip(on, self.springs, self._weights, strict=True):
            k = touches * (spring.share * getattr(c, spring.stiffness))
            ll, lt, tt = ll + k * (a * a), lt + k * (a * b), tt + k * (b * b)
        return ll, lt, tt

    def _edge_forces(self, c: Coefficients, at: Pose, on: Touching) -> Point:
        """The forces at the leading and the trailing edge that stand for all springs."""
        gl, gt = gaps(c, at)
        ll, lt, tt = self._stiffness(c, on)
        return -(ll * gl + lt * gt), -(lt * gl + tt * gt)

    def forces(self, c: Coefficients, at: Pose, on: Touching) -> Forces:
        """Normal and friction forces of Eqs. (4)-(6)."""
        total = Forces(0.0, 0.0, 0.0, 0.0)
        corners = (c.rlx, c.rly), (c.rtx, c.rty)
        for force, r in zip(self._edge_forces(c, at, on), corners, strict=True):
            friction = c.mu * force
            if self.level_friction:
                normal = Forces.of(r, 0.0, force)
                total += normal._replace(x=friction, moment=c.h * friction)
            else:
                total += Forces.of(r, friction, force)
        return total

    def loads(self, c: Coefficients, at: Pose, on: Touching) -> Loads:
        """The forces and their moment."""
        return self.forces(c, at, on).loads(at)

    @property
    def restoring(self) -> bool:
        """True: the springs have a potential."""
        return True

    def resultant(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Number, Number]:
        """Total normal reaction and its distance from the mass centre along x, 0/0 apart."""
        (fl, ft), (al, at_) = self._edge_forces(c, at, on), edges(c, at)
        return fl + ft, (al * fl + at_ * ft) / (fl + ft)

    def energy(self, c: Coefficients, at: Pose, on: Touching) -> Number:
        """Potential energy of the springs that touch."""
        gl, gt = gaps(c, at)
        ll, lt, tt = self._stiffness(c, on)
        return 0.5 * (ll * gl * gl + 2.0 * lt * gl * gt + tt * gt * gt)


@dataclass(frozen=True)
class PointContact(Springs):
    """Springs k3 and k4 at the two lower edges, relaxed in the initial position (model B1)."""

    parameters: ClassVar[tuple[str, ...]] = ("k3", "k4")
    absolute_gap = False
    level_friction = False
    springs = (Spring(-1.0, "k3"), Spring(1.0, "k4"))
    plotted = (
        Signal("F3", "F_n", "F_{s,3}", "leading edge", "leading-edge force"),
        Signal("F4", "F_n", "F_{s,4}", "trailing edge", "trailing-edge force"),
    )
    meanings: ClassVar[Mapping[str, str]] = {
        "1": "both edges in contact",
        "2": "separated",
        "3": "leading edge only",
        "4": "trailing edge only",
    }

    def state_name(self, state: State) -> str:
        """The article's number of a state (Fig. 3)."""
        return str(1 + STATES.index(state))

    def signals(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Number, Number]:
        """F3 and F4."""
        return self._edge_forces(c, at, on)


@dataclass(frozen=True)
class SpringContact(Springs):
    """Equal springs at equal distances along the lower face, a discrete line contact (model BN).

    N springs k_c/N at the places (2 i + 1 - N)/sqrt(N^2 - 1), i from 0 to N - 1: the middles of N
    equal parts of the face, moved outwards by 1/sqrt(1 - 1/N^2), since their mean square there is
    (1 - 1/N^2)/3 and a uniform face has 1/3. Normal stiffness k_c and rotational stiffness
    k_c w^2/3 in full contact are then exactly those of the line contact with the integral law,
    which is the limit of many springs.
    """

    count: int

    parameters = ("k_c",)
    absolute_gap = True
    level_friction = True
    plotted = NORMAL_REACTION
    meanings: ClassVar[Mapping[str, str]] = FACE_STATES
    state_name = staticmethod(face_state)

    @cached_property
    def springs(self) -> tuple[Spring, ...]:
        """The springs, from the leading to the trailing edge."""
        n = self.count
        wide = math.sqrt(n * n - 1.0)
        return tuple(Spring((2 * i + 1 - n) / wide, "k_c", 1.0 / n) for i in range(n))

    def signals(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Number, Number]:
        """Rn and delta, which is NaN as apart where the touch is too light to tell."""
        force, place = self.resultant(c, at, on)
        return force, np.where(np.less(force, LIGHT * c.k_c * c.w), np.nan, place)
