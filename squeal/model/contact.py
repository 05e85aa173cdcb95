"""Contact states, contact laws (springs along the lower face, line contact), and the models.

A contact law watches points of the lower face: its two edges, or more. A point separates when its
gap passes zero upwards and touches when it passes zero downwards, so every transition flips one
point (Tables 1 and 2, Figs. 3, 8). The line contact (model B2, Eqs. 8-20) rests on the gaps of the
two lower edges, never on the contact-loss point of Eq. (12), which is singular for a level pad.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from typing import Any, ClassVar, Literal, NamedTuple, get_args

import numpy as np

from squeal.model.pad import PARAMETERS, Coefficients, Loads, Number, Point, Pose, edges, gaps
from squeal.schema import Group, Key, Place, Whole, Word

LineForce = Literal["integral", "mean"]
DeltaFrom = Literal["centre", "frame"]
DeltaMoment = Literal["+", "-"]
Touching = Sequence[Number] | np.ndarray
"""A contact state as factors 1 and 0, one for each contact point: a `State` (bools), or numbers,
arrays or symbols, so that one formula serves all states."""
LEADING = 0
TRAILING = 1


class State(tuple[bool, ...]):
    """Which contact points touch, from the leading edge to the trailing: State(True, False)."""

    __slots__ = ()

    def __new__(cls, *touching: bool) -> State:
        return super().__new__(cls, touching)

    def __getnewargs__(self) -> tuple[bool, ...]:
        return tuple(self)

    def flip(self, point: int) -> State:
        """The state after a contact point (its index) has separated or touched."""
        return State(*(touches ^ (i == point) for i, touches in enumerate(self)))


def states(points: int) -> tuple[State, ...]:
    """The states of a straight face with that many contact points: all touch, none, or those on
    the leading or on the trailing side."""
    leading = []
    for touching in range(points - 1, 0, -1):
        leading.append(State(*(point < touching for point in range(points))))
    trailing = [State(*reversed(state)) for state in leading]
    return State(*[True] * points), State(*[False] * points), *leading, *trailing


STATES = states(2)
FULL, NONE, LEAD, TRAIL = STATES


class Signal(NamedTuple):
    """A quantity that is plotted and whose range is given, over a scale.

    over: the parameter that it is divided by, F_n for a force and w for a position; symbol: as TeX;
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


NORMAL_REACTION = (
    Signal("Rn", "F_n", "R_n", "normal reaction", "normal reaction"),
    Signal("delta", "w", r"\delta", "position of the reaction", "position of the reaction"),
)
FACE_STATES = {"FC": "full contact", "PC": "partial contact", "SS": "surface separation"}


def face_state(state: State) -> str:
    """The article's name of a face's contact (Fig. 8)."""
    if all(state):
        return "FC"
    return "PC" if any(state) else "SS"


class ContactLaw(ABC):
    """Loads on the pad from unilateral contact at points of its lower face.

    Pure formulas over generic numbers: c are the pad's coefficients, `on` is 1 for each contact
    point that touches and 0 for each other one. A law is hashable and holds no state. The face is
    straight, so that two normal forces at its edges stand for any pressure along it.

    parameters: names of the stiffnesses of `Pad` that it uses; absolute_gap: the surface lies at
    y = -h and y0, theta0 open a gap, instead of contact that is relaxed in the initial position;
    plotted: its signals; meanings: name and meaning of each contact state.
    """

    parameters: ClassVar[tuple[str, ...]] = ("k_c",)
    absolute_gap: ClassVar[bool] = True
    plotted: ClassVar[tuple[Signal, Signal]] = NORMAL_REACTION
    meanings: ClassVar[Mapping[str, str]] = FACE_STATES

    @property
    @abstractmethod
    def points(self) -> int:
        """How many contact points there are, in order from the leading edge to the trailing."""

    @property
    def sign(self) -> float:
        """Of the moment of Rn: with 1 it turns the pad back, so that without friction a pad has one
        equilibrium near the initial position."""
        return 1.0

    def state_name(self, state: State) -> str:
        """The name of a contact state, one of `meanings`."""
        return face_state(state)

    @abstractmethod
    def gaps(self, c: Coefficients, pose: Pose) -> tuple[Number, ...]:
        """Height of each contact point over the surface; contact changes where it passes zero."""

    @abstractmethod
    def edge_forces(self, c: Coefficients, pose: Pose, on: Touching) -> Point:
        """Normal forces at the leading and the trailing edge, zero where nothing touches."""

    @abstractmethod
    def energy(self, c: Coefficients, pose: Pose, on: Touching) -> Number:
        """Potential energy of the contact."""

    def normal(self, c: Coefficients, pose: Pose, on: Touching) -> tuple[Number, Number]:
        """Total normal reaction Rn and its moment."""
        f1, f2 = self.edge_forces(c, pose, on)
        x1, x2 = edges(c, pose)
        return f1 + f2, x1 * f1 + x2 * f2

    def loads(self, c: Coefficients, pose: Pose, on: Touching) -> Loads:
        """Normal and friction forces, Eqs. (8)-(10), friction at the constant arm h."""
        Rn, moment = self.normal(c, pose, on)
        Rf = c.mu * Rn
        return Loads(Rf, Rn, self.sign * moment + c.h * Rf)

    def resultant(self, c: Coefficients, pose: Pose, on: Touching) -> tuple[Number, Number]:
        """Rn and its distance from the mass centre along x, 0/0 where nothing touches."""
        Rn, moment = self.normal(c, pose, on)
        return Rn, moment / Rn

    def signals(self, c: Coefficients, pose: Pose, on: Touching) -> tuple[Number, Number]:
        """The signals `plotted`, in units of force and length; a position is 0/0 (NaN) where
        nothing touches."""
        return self.resultant(c, pose, on)


class Spring(NamedTuple):
    """A contact spring.

    position: along the lower face, -1 at the leading and 1 at the trailing edge; stiffness: the
    parameter of the pad of whose value the spring has a share.
    """

    position: float
    stiffness: str
    share: float = 1.0


class Springs(ContactLaw):
    """Unilateral springs along the lower face, whose points are the contact points.

    A spring at the position p has the gap a g_l + b g_t of the gaps at both edges, a = (1 - p)/2
    and b = (1 + p)/2, and its force loads the edges with the shares a and b. The springs that touch
    together are a symmetric stiffness (2, 2) of the edges.
    """

    @property
    @abstractmethod
    def springs(self) -> tuple[Spring, ...]:
        """The springs, from the leading to the trailing edge."""

    @property
    def points(self) -> int:
        return len(self.springs)

    @cached_property
    def _weights(self) -> tuple[tuple[float, float], ...]:
        """The factors a and b of each spring."""
        return tuple(((1.0 - s.position) / 2.0, (1.0 + s.position) / 2.0) for s in self.springs)

    def gaps(self, c: Coefficients, pose: Pose) -> tuple[Number, ...]:
        gl, gt = gaps(c, pose)
        return tuple(a * gl + b * gt for a, b in self._weights)

    def _stiffness(self, c: Coefficients, on: Touching) -> tuple[Number, Number, Number]:
        """Entries of the symmetric stiffness of the edges: leading, coupling, trailing."""
        ll = lt = tt = 0.0
        for touches, spring, (a, b) in zip(on, self.springs, self._weights, strict=True):
            k = touches * (spring.share * getattr(c, spring.stiffness))
            ll = ll + k * (a * a)
            lt = lt + k * (a * b)
            tt = tt + k * (b * b)
        return ll, lt, tt

    def edge_forces(self, c: Coefficients, pose: Pose, on: Touching) -> Point:
        gl, gt = gaps(c, pose)
        ll, lt, tt = self._stiffness(c, on)
        return -(ll * gl + lt * gt), -(lt * gl + tt * gt)

    def energy(self, c: Coefficients, pose: Pose, on: Touching) -> Number:
        gl, gt = gaps(c, pose)
        ll, lt, tt = self._stiffness(c, on)
        return 0.5 * (ll * gl * gl + 2.0 * lt * gl * gt + tt * gt * gt)


@dataclass(frozen=True)
class PointContact(Springs):
    """Springs k3 and k4 at the two lower edges, relaxed in the initial position (model B1)."""

    parameters: ClassVar[tuple[str, ...]] = ("k3", "k4")
    absolute_gap = False
    gaps = staticmethod(gaps)  # those of `Springs`, whose weights are 1 and 0
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

    def loads(self, c: Coefficients, pose: Pose, on: Touching) -> Loads:
        """Normal and friction forces of Eqs. (4)-(6), friction where its edge is."""
        f1, f2 = self.edge_forces(c, pose, on)
        leading = Loads.of(pose, (c.rlx, c.rly), c.mu * f1, f1)
        return leading + Loads.of(pose, (c.rtx, c.rty), c.mu * f2, f2)

    def signals(self, c: Coefficients, pose: Pose, on: Touching) -> tuple[Number, Number]:
        return self.edge_forces(c, pose, on)


@dataclass(frozen=True)
class SpringContact(Springs):
    """Equal springs at equal distances along the lower face, a discrete line contact (model BN).

    N springs k_c/N at the positions (2 i + 1 - N)/sqrt(N^2 - 1), i from 0 to N - 1: the middles of
    N equal parts of the face, moved outwards by 1/sqrt(1 - 1/N^2), since their mean square there is
    (1 - 1/N^2)/3 and a uniform face has 1/3. Normal stiffness k_c and rotational stiffness
    k_c w^2/3 in full contact are then exactly those of the line contact, the limit of many springs.
    """

    count: int

    @cached_property
    def springs(self) -> tuple[Spring, ...]:
        n = self.count
        width = math.sqrt(n * n - 1.0)
        return tuple(Spring((2 * i + 1 - n) / width, "k_c", share=1.0 / n) for i in range(n))

    def signals(self, c: Coefficients, pose: Pose, on: Touching) -> tuple[Number, Number]:
        """Rn and delta; delta is NaN where nothing touches, or too lightly for its digits."""
        force, delta = self.resultant(c, pose, on)
        least = 1e-8 * c.k_c * c.w  # a lighter touch leaves of delta nothing but rounding
        return force, np.where(np.less(force, least), np.nan, delta)


@dataclass(frozen=True)
class LineContact(ContactLaw):
    """Distributed stiffness along the lower face, in the variants of `Formulation`.

    With pl, pt the penetrations of the leading and trailing edge, the pressure varies linearly
    between them. In full contact both line-force laws give Rn = k_c (pl + pt)/2. In partial
    contact, p being the penetration of the touching edge, the contact length over 2w is
    p/|pl - pt|, and the integral law weighs Rn = k_c p/2 (the printed mean) with it.
    """

    line_force: LineForce = "integral"
    delta_from: DeltaFrom = "centre"
    delta_moment: DeltaMoment = "+"

    points: ClassVar = 2
    gaps = staticmethod(gaps)

    @property
    def sign(self) -> float:
        """-1 as in Eq. (21), which turns the pad ever further."""
        return 1.0 if self.delta_moment == "+" else -1.0

    def _partial(self, gl: Number, gt: Number, on: Touching) -> tuple[Number, Number]:
        """Penetration of the edge that touches alone and contact length over 2 w, else zeros.

        By factors 1 and 0 instead of branches, since `on` may hold arrays or symbols.
        """
        leading, trailing = on
        side = trailing - leading  # -1 where the leading edge touches alone, 1 the trailing
        partial = side * side  # 1 in partial contact, else 0
        p = -partial * (leading * gl + trailing * gt)
        difference = side * (gl - gt)  # the penetration at this edge less that at the other
        return p, p / (difference + (1.0 - partial))  # outside of partial contact 0 / 1

    def edge_forces(self, c: Coefficients, pose: Pose, on: Touching, unit: bool = False) -> Point:
        """See `ContactLaw`; `unit`: as if Rn were 1 in partial contact, where it may vanish.

        In full contact the forces of partial contact are zero, and conversely: factors 0 and 1 in
        place of branches, as in `_partial`.
        """
        gl, gt = gaps(c, pose)
        leading, trailing = on
        p, length_share = self._partial(gl, gt, on)
        if unit:
            Rn = (trailing - leading) * (trailing - leading)  # 1 where one edge touches alone
        elif self.line_force == "integral":
            Rn = 0.5 * c.k_c * p * length_share
        else:
            Rn = 0.5 * c.k_c * p
        # in partial contact the pressure is a triangle, whose centroid lies at a third of the
        # contact length from the edge that touches
        at_touching_edge = Rn * (1.0 - length_share / 3.0)
        at_other_edge = Rn * (length_share / 3.0)
        # in full contact it is a trapezoid: k_c (2 pl + pt)/6 at the leading edge and k_c (pl + 2
        # pt)/6 at the trailing one, with pl = -gl and pt = -gt
        full = leading * trailing * (c.k_c / 6.0)
        f1 = leading * at_touching_edge + trailing * at_other_edge - full * (2.0 * gl + gt)
        f2 = trailing * at_touching_edge + leading * at_other_edge - full * (gl + 2.0 * gt)
        return f1, f2

    def normal(
        self, c: Coefficients, pose: Pose, on: Touching, unit: bool = False
    ) -> tuple[Number, Number]:
        f1, f2 = self.edge_forces(c, pose, on, unit)
        x1, x2 = edges(c, pose)
        origin = c.x0 + pose.x if self.delta_from == "frame" else 0.0
        return f1 + f2, (origin + x1) * f1 + (origin + x2) * f2

    def resultant(self, c: Coefficients, pose: Pose, on: Touching) -> tuple[Number, Number]:
        """Rn and delta, Eqs. (13)-(20); where contact is lost delta has its limit, the edge.

        delta is moment over force for a force of 1, which stays defined where Rn vanishes.
        """
        unit_force, unit_moment = self.normal(c, pose, on, unit=True)
        return self.normal(c, pose, on)[0], unit_moment / unit_force

    def energy(self, c: Coefficients, pose: Pose, on: Touching) -> Number:
        """(k_c/4w) x integral of the squared penetration: the potential of the integral law."""
        gl, gt = gaps(c, pose)
        p, length_share = self._partial(gl, gt, on)
        full = on[0] * on[1] * ((gl + gt) ** 2 / 8.0 + (gl - gt) ** 2 / 24.0)
        return c.k_c * (p * p * length_share / 6.0 + full)


@dataclass(frozen=True)
class Formulation:
    """Choices that the models leave open; `ContactModel.choices` says which model has which.

    line_force: "integral" = (k_c/2w) x integral of the penetration, "mean" = Eq. (13) as printed.
    delta_from: "centre" of mass (needed by Eq. 10), or the fixed "frame" as in Eqs. (17)-(20).
    delta_moment: "+" as in Eq. (10), "-" as in Eq. (21).
    springs: how many there are along the face. Raises InputError for anything else.

    Examples
    --------
    >>> Formulation(line_force="mean", delta_from="frame").delta_moment
    '+'
    """

    line_force: LineForce = "integral"
    delta_from: DeltaFrom = "centre"
    delta_moment: DeltaMoment = "+"
    springs: int = 16

    def __post_init__(self) -> None:
        FORMULATION.read(vars(self), Place("Formulation"))

    def to_dict(self) -> dict[str, Any]:
        """The formulation as it stands in a scene file, defaults left out.

        Examples
        --------
        >>> Formulation(line_force="mean").to_dict()
        {'line_force': 'mean'}
        """
        given = {}
        for choice in fields(self):
            value = getattr(self, choice.name)
            if value != choice.default:
                given[choice.name] = value
        return given


# fmt: off
FORMULATION = Group({
    "line_force": Key(
        "integral: (k_c / 2w) x integral of the penetration; mean: Eq. (13) as printed",
        Word(get_args(LineForce)), default="integral"),
    "delta_from": Key(
        "where delta is counted from: the centre of mass, or the frame as in Eqs. (17)-(20)",
        Word(get_args(DeltaFrom)), default="centre"),
    "delta_moment": Key(
        "sign of the moment of Rn: + as in Eq. (10), - as in Eq. (21)",
        Word(get_args(DeltaMoment)), default="+"),
    "springs": Key(
        "how many springs the lower face has, at w (2 i + 1 - N)/sqrt(N^2 - 1) from its middle",
        Whole(2, 1000), default="16"),
})
# fmt: on
FORMULATION_CHOICES: dict[str, tuple[str, ...]] = {
    name: key.kind.choices for name, key in FORMULATION.keys.items() if isinstance(key.kind, Word)
}
CONSISTENT = Formulation()


@dataclass(frozen=True)
class ContactModel:
    """A contact model as scenes name it.

    words: what it is; law: its contact law, made of `choices`, the keys of `Formulation` that it
    reads; linear: it is the linearisation about the origin in full contact, without any motion.
    """

    name: str
    words: str
    law: type[ContactLaw]
    choices: tuple[str, ...] = ()
    linear: bool = False

    def uses(self, parameter: str) -> bool:
        """True if a parameter of `Pad` means anything in this model."""
        if any(parameter in model.law.parameters for model in MODELS.values()):
            return parameter in self.law.parameters
        return PARAMETERS[parameter].common or not self.linear

    @cached_property
    def needs(self) -> tuple[str, ...]:
        """The parameters of `Pad` that it has to know."""
        return tuple(name for name, p in PARAMETERS.items() if p.required and self.uses(name))


_LINE = ("line_force", "delta_from", "delta_moment")
MODELS: dict[str, ContactModel] = {
    model.name: model
    for model in (
        ContactModel("B1", "point contacts at the two edges", PointContact),
        ContactModel("B2", "line contact", LineContact, _LINE),
        ContactModel("B3", "line contact, linearised", LineContact, _LINE, linear=True),
        ContactModel("BN", "equal springs along the lower face", SpringContact, ("springs",)),
    )
}
CONTACT_MODELS = tuple(name for name, model in MODELS.items() if not model.linear)


def contact_model(name: str, at: Place | None = None) -> ContactModel:
    """A model by its name. Raises InputError if there is none of that name."""
    return MODELS.get(name) or MODELS[Word(tuple(MODELS)).read(name, at or Place("model"))]


def models_with(parameter: str) -> tuple[str, ...]:
    """Names of the models in which a parameter of `Pad` means anything."""
    return tuple(name for name, model in MODELS.items() if model.uses(parameter))


@lru_cache(maxsize=256)
def contact_law(name: str, formulation: Formulation = CONSISTENT) -> ContactLaw:
    """The contact law of a model, always the same object for the same choices."""
    model = contact_model(name)
    return model.law(*(getattr(formulation, choice) for choice in model.choices))
