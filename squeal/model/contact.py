"""Contact states, contact laws (springs along the lower face, line contact), and the models.

A contact law watches some points of the lower face: its two edges, or more. A point separates when
its gap passes zero upwards and touches when it passes zero downwards, so every transition flips
one point (Tables 1 and 2, Figs. 3, 8).

Everything else asks the law and never the model's name. The line contact (model B2, Eqs. 8-20)
rests on the gaps of the two lower edges, never on the contact-loss point of Eq. (12), which is
singular for a level pad.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache, cached_property, lru_cache
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from squeal.model.pad import (
    PARAMETERS,
    Coefficients,
    Forces,
    Loads,
    Number,
    Pad,
    Point,
    Pose,
    edges,
    gaps,
)
from squeal.schema import Group, Key, Place, Whole, Word

LineForce = Literal["integral", "mean"]
DeltaFrom = Literal["centre", "frame"]
DeltaMoment = Literal["+", "-"]
Touching = Sequence[Number] | np.ndarray
"""A contact state as factors 1 and 0, one for each contact point: a `State` (bools), or numbers,
arrays or symbols, so that one formula serves all states."""
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


@lru_cache(maxsize=1024)  # needed at every contact change
def _flipped(state: State, point: int) -> State:
    return State(*(touches ^ (i == point) for i, touches in enumerate(state)))


def states(points: int) -> tuple[State, ...]:
    """The states of a straight face with that many contact points: all touch, none, or those on
    the leading or on the trailing side."""
    sizes = range(points - 1, 0, -1)
    return (
        State(*[True] * points),
        State(*[False] * points),
        *(State(*(i < n for i in range(points))) for n in sizes),
        *(State(*(i >= points - n for i in range(points))) for n in sizes),
    )


STATES = states(2)
FULL, NONE, LEAD, TRAIL = STATES


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


NORMAL_REACTION = (
    Signal("Rn", "F_n", "R_n", "normal reaction", "normal reaction"),
    Signal("delta", "w", r"\delta", "position of the reaction", "position of the reaction"),
)
FACE_STATES = {"FC": "full contact", "PC": "partial contact", "SS": "surface separation"}


def face_state(state: State) -> str:
    """The article's name of a face's contact (Fig. 8)."""
    return "FC" if all(state) else "PC" if any(state) else "SS"


class ContactLaw(ABC):
    """Loads on the pad from unilateral contact at points of its lower face.

    Pure formulas over generic numbers: c are the pad's coefficients, `at` its pose, `on` says
    which contact points touch. A law is hashable and holds no state.

    parameters: names of the stiffnesses of `Pad` that it uses; absolute_gap: the surface lies at
    y = -h and y0, theta0 open a gap, instead of contact that is relaxed in the initial position;
    plotted: its signals; meanings: name and meaning of each contact state, as the article or the
    field counts them.
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
    def restoring(self) -> bool:
        """True if its moment turns the pad back, so that without friction a pad rests in one place
        near the initial one."""
        return True

    def state_name(self, state: State) -> str:
        """The name of a contact state, one of `meanings`."""
        return face_state(state)

    @abstractmethod
    def gaps(self, c: Coefficients, at: Pose) -> tuple[Number, ...]:
        """Height of each contact point over the surface; contact changes where it passes zero."""

    @abstractmethod
    def forces(self, c: Coefficients, at: Pose, on: Touching) -> Forces:
        """Normal and friction forces; zero where nothing touches."""

    def loads(self, c: Coefficients, at: Pose, on: Touching) -> Loads:
        """These forces and their moment."""
        return self.forces(c, at, on).loads(at)

    @abstractmethod
    def signals(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Number, Number]:
        """The signals `plotted`, in units of force and length; a place is 0/0 apart: NaN in
        arrays."""

    @abstractmethod
    def resultant(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Number, Number]:
        """Total normal reaction and its distance from the mass centre along x, 0/0 apart."""

    @abstractmethod
    def energy(self, c: Coefficients, at: Pose, on: Touching) -> Number:
        """Potential energy of the contact."""


class Spring(NamedTuple):
    """A contact spring.

    place: along the lower face, -1 at the leading and 1 at the trailing edge; stiffness: the
    parameter that gives it, of which the spring has a share.
    """

    place: float
    stiffness: str
    share: float = 1.0


class Springs(ContactLaw):
    """Unilateral springs along the lower face, whose points are the contact points.

    The face is straight. A spring at the place p therefore has the gap a g_l + b g_t of the gaps
    at the edges, a = (1 - p)/2 and b = (1 + p)/2, and loads the pad as the shares a and b of its
    force at the edges would. All springs together are a symmetric stiffness (2, 2) between the
    gaps of the edges and the forces there, and only that stiffness knows which of them touch.

    level_friction: friction acts at the arm h, as in Eq. (10), instead of where its edge is.
    """

    level_friction: ClassVar[bool] = True

    @property
    @abstractmethod
    def springs(self) -> tuple[Spring, ...]:
        """The springs, from the leading to the trailing edge."""

    @property
    def points(self) -> int:
        return len(self.springs)

    @cached_property
    def _weights(self) -> tuple[tuple[float, float], ...]:
        return tuple(((1.0 - s.place) / 2.0, (1.0 + s.place) / 2.0) for s in self.springs)

    def gaps(self, c: Coefficients, at: Pose) -> tuple[Number, ...]:
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

    def resultant(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Number, Number]:
        (fl, ft), (al, at_) = self._edge_forces(c, at, on), edges(c, at)
        return fl + ft, (al * fl + at_ * ft) / (fl + ft)

    def energy(self, c: Coefficients, at: Pose, on: Touching) -> Number:
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

    @cached_property
    def springs(self) -> tuple[Spring, ...]:
        n = self.count
        wide = math.sqrt(n * n - 1.0)
        return tuple(Spring((2 * i + 1 - n) / wide, "k_c", 1.0 / n) for i in range(n))

    def signals(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Number, Number]:
        """Rn and delta, which is NaN as apart where the touch is too light to tell."""
        force, place = self.resultant(c, at, on)
        light = 1e-8 * c.k_c * c.w  # leaves of the place nothing but rounding
        return force, np.where(np.less(force, light), np.nan, place)


def _partial(
    c: Coefficients, gl: Number, gt: Number, on: Touching
) -> tuple[Number, Number, Number]:
    """Partial contact; zeros, without 0/0, where both edges touch or none.

    Penetration of the edge that touches, contact length over 2 w, and the centroid of the pressure
    from the middle of the lower face.
    """
    leading, trailing = on
    side = trailing - leading  # 1 on the trailing edge alone, -1 on the leading edge alone
    one = side * side
    p = -one * (leading * gl + trailing * gt)
    part = p / (side * (gl - gt) + (1.0 - one))
    return p, part, side * c.w * (1.0 - part * (2.0 / 3.0))


@dataclass(frozen=True)
class LineContact(ContactLaw):
    """Distributed stiffness along the lower face.

    With pl, pt the penetrations of the leading and trailing edge, the pressure varies linearly
    between them. In full contact both line-force laws give Rn = k_c (pl + pt)/2. In partial
    contact, p being the penetration of the touching edge, the contact length over 2w is
    p/|pl - pt|, and the integral law weighs Rn = k_c p/2 (the printed mean) with it.

    The choices are those of `squeal.model.contact.Formulation`.
    """

    line_force: LineForce = "integral"
    delta_from: DeltaFrom = "centre"
    delta_moment: DeltaMoment = "+"

    points: ClassVar = 2
    gaps = staticmethod(gaps)

    @property
    def restoring(self) -> bool:
        """False with the sign of Eq. (21), which turns the pad ever further."""
        return self.delta_moment == "+"

    def _reaction(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Point, Point, Number]:
        """Partial and full contact, one of which is zero, and the centroid of the partial one.

        Each is Rn with its moment about the middle of the lower face.
        """
        gl, gt = gaps(c, at)
        p, part, aside = _partial(c, gl, gt, on)
        Rn = 0.5 * c.k_c * p
        if self.line_force == "integral":
            Rn = Rn * part
        full = on[0] * on[1] * c.k_c
        return (
            (Rn, Rn * aside),
            (full * (-0.5 * (gl + gt)), full * (c.w * (gl - gt) / 6.0)),
            aside,
        )

    def _middle(self, c: Coefficients, at: Pose) -> tuple[Number, Number]:
        """cos(theta0 + theta), and where the middle of the face lies, as delta is counted."""
        leading, trailing = edges(c, at)
        cos_phi, middle = (trailing - leading) / (2.0 * c.w), (leading + trailing) / 2.0
        return cos_phi, middle if self.delta_from == "centre" else middle + c.x0 + at.x

    def forces(self, c: Coefficients, at: Pose, on: Touching) -> Forces:
        """Rn and Rf = mu Rn, Eqs. (8)-(10) (friction at the constant arm h)."""
        partial, full, _ = self._reaction(c, at, on)
        Rn, along = partial[0] + full[0], partial[1] + full[1]
        Rf, sign = c.mu * Rn, 1.0 if self.delta_moment == "+" else -1.0
        # sums of the coordinates of the points where Rn acts, each times its part
        aside, down = (
            sign * (0.5 * (t + l) * Rn + (t - l) / (2.0 * c.w) * along)
            for l, t in ((c.rlx, c.rtx), (c.rly, c.rty))
        )
        moment = c.h * Rf
        if self.delta_from == "frame":
            moment = moment + sign * ((c.x0 + at.x) * Rn)
        return Forces(Rf, Rn, aside, down, moment)

    def signals(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Number, Number]:
        """Rn (in units of force) and delta (of length), Eqs. (13)-(20); delta is 0/0 apart."""
        (partial, _), (full, along), aside = self._reaction(c, at, on)
        cos_phi, middle = self._middle(c, at)
        both = on[0] * on[1]
        place = aside + along / (full + (1.0 - both))
        touching = on[0] + on[1] - both
        return partial + full, (cos_phi * place + middle) * touching / touching

    resultant = signals

    def energy(self, c: Coefficients, at: Pose, on: Touching) -> Number:
        """(k_c/4w) x integral of the squared penetration: the potential of the integral law."""
        gl, gt = gaps(c, at)
        p, part, _ = _partial(c, gl, gt, on)
        full = on[0] * on[1] * ((gl + gt) ** 2 / 8.0 + (gl - gt) ** 2 / 24.0)
        return c.k_c * (p * p * part / 6.0 + full)


@dataclass(frozen=True)
class Formulation:
    """Choices that the models leave open; `ContactModel.choices` says which model has which.

    line_force: "integral" = (k_c/2w) x integral of the penetration, "mean" = Eq. (13) as printed.
    delta_from: "centre" of mass (needed by Eq. 10), or the fixed "frame" as in Eqs. (17)-(20).
    delta_moment: "+" as in Eq. (10), "-" as in Eq. (21).
    springs: how many there are along the face. Raises InputError for anything else.
    """

    line_force: LineForce = "integral"
    delta_from: DeltaFrom = "centre"
    delta_moment: DeltaMoment = "+"
    springs: int = 16

    def __post_init__(self) -> None:
        FORMULATION.read(vars(self), Place("Formulation"))

    def to_dict(self) -> dict[str, Any]:
        """As it stands in a scene file, defaults left out."""
        return {f.name: v for f in fields(self) if (v := getattr(self, f.name)) != f.default}


# fmt: off
FORMULATION = Group({
    "line_force": Key(
        "integral: (k_c / 2w) x integral of the penetration; mean: Eq. (13) as printed",
        Word(("integral", "mean")), default="integral"),
    "delta_from": Key(
        "where delta is counted from: the centre of mass, or the frame as in Eqs. (17)-(20)",
        Word(("centre", "frame")), default="centre"),
    "delta_moment": Key(
        "sign of the moment of Rn: + as in Eq. (10), - as in Eq. (21)",
        Word(("+", "-")), default="+"),
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

    words: what it is; law: its contact law; choices: the keys of `Formulation` that it reads;
    linear: it is its law's linearisation about the origin in full contact, which has no motion,
    load or sliding equilibrium of its own.
    """

    name: str
    words: str
    law: Callable[[Formulation], ContactLaw]
    choices: tuple[str, ...] = ()
    linear: bool = False

    def uses(self, parameter: str) -> bool:
        """True if a parameter of `Pad` means anything in this model."""
        if any(parameter in model.stiffnesses for model in MODELS.values()):
            return parameter in self.stiffnesses
        return not (self.linear and parameter in _OF_MOTION)

    @property
    def stiffnesses(self) -> tuple[str, ...]:
        """The contact stiffnesses that it needs."""
        return self.law(CONSISTENT).parameters


def _line(f: Formulation) -> ContactLaw:
    return LineContact(f.line_force, f.delta_from, f.delta_moment)


MODEL = Place("model")
_LINE = ("line_force", "delta_from", "delta_moment")
_OF_MOTION = ("L1", "L2", "F_n", "V", "mu_s", "mu_k", "v_ref", "x0", "y0")
MODELS: dict[str, ContactModel] = {
    model.name: model
    for model in (
        ContactModel("B1", "point contacts at the two edges", lambda _: PointContact()),
        ContactModel("B2", "line contact", _line, _LINE),
        ContactModel("B3", "line contact, linearised", _line, _LINE, linear=True),
        ContactModel(
            "BN",
            "equal springs along the lower face",
            lambda f: SpringContact(f.springs),
            ("springs",),
        ),
    )
}


CONTACT_MODELS = tuple(name for name, model in MODELS.items() if not model.linear)


def contact_model(name: str, at: Place = MODEL) -> ContactModel:
    """A model by its name. Raises InputError if there is none of that name."""
    return MODELS.get(name) or MODELS[Word(tuple(MODELS)).read(name, at)]


@cache
def models_with(parameter: str) -> tuple[str, ...]:
    """Names of the models in which a parameter of `Pad` means anything."""
    return tuple(name for name, model in MODELS.items() if model.uses(parameter))


@cache
def _needed(name: str) -> tuple[str, ...]:
    return tuple(n for n, p in PARAMETERS.items() if p.required and name in models_with(n))


def check_pad(name: str, pad: Pad, at: Place) -> None:
    """Refuse an unknown model, or a pad without a parameter that it needs. Raises InputError."""
    contact_model(name, at / "name")
    for parameter in _needed(name):
        if getattr(pad, parameter) is None:
            raise PARAMETERS[parameter].missing(at / parameter, f"model {name}")


@lru_cache(maxsize=256)
def contact_law(name: str, formulation: Formulation = CONSISTENT) -> ContactLaw:
    """The contact law of a model, always the same object for the same choices."""
    return contact_model(name).law(formulation)
