"""Equations of motion of models B1 (Eqs. 4-6) and B2 (Eqs. 8-10), and their linearisation.

A motion is integrated in units in which it is of order one, whatever the units of its file: its
state is (x, y, w theta) and their rates. The same pad in other units is then the same computation.
"""

from __future__ import annotations

import dataclasses
import operator
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial, reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import InputError
from squeal.model.contact import (
    CONSISTENT,
    ContactLaw,
    Formulation,
    State,
    Touching,
    contact_law,
    contact_model,
    states,
)
from squeal.model.pad import (
    PARAMETERS,
    Coefficients,
    Loads,
    Model,
    Number,
    Operations,
    Pad,
    at_speed,
    coefficients,
    pose_of,
    spring_energy,
    springs,
)
from squeal.numerics.differentiation import complex_step
from squeal.schema import Place


def term_count(terms: tuple[str, ...]) -> int:
    """How many numbers the terms with velocities have, see `PadModel.terms`."""
    if "falling" in terms:
        return 12
    return 9 if terms else 0


def net_loads(ops: Operations, c: Coefficients, law: ContactLaw, q: Number, on: Touching) -> Loads:
    """Right-hand sides of Eqs. (4)-(6) or (8)-(10) in a contact state (m and I not divided out)."""
    pose = pose_of(ops, q)
    total = springs(ops, c, pose) + law.loads(c, pose, on)
    return total._replace(y=total.y - c.F_n)


@dataclass(frozen=True)
class PadModel:
    """A pad under one of the contact models; positions are q = (x, y, theta).

    `damping` holds the rows of a damping matrix C (3, 3) in (x, y, theta), None without. Raises
    InputError for an unknown model or a pad without a parameter that the model needs.
    """

    name: Model
    pad: Pad
    formulation: Formulation = CONSISTENT
    damping: tuple[tuple[float, ...], ...] | None = None

    def __post_init__(self) -> None:
        at = Place("PadModel")
        for name in contact_model(self.name, at / "name").needs:
            if getattr(self.pad, name) is None:
                raise PARAMETERS[name].missing(at / name, f"model {self.name}")

    @property
    def linear(self) -> bool:
        """True if only its linearisation about the origin counts, see `ContactModel`."""
        return contact_model(self.name).linear

    def replace(self, **changes: Number) -> PadModel:
        """The model with some parameters of its pad changed."""
        return dataclasses.replace(self, pad=self.pad.replace(**changes))

    @cached_property
    def law(self) -> ContactLaw:
        """The contact law in use."""
        return contact_law(self.name, self.formulation)

    @cached_property
    def c(self) -> Coefficients:
        """Coefficients of the equations as plain numbers."""
        return coefficients(np, self.pad, self.law.absolute_gap)

    def loads(self, q: Number, state: Touching, rates: Number = None) -> np.ndarray:
        """Net force and moment (Fx, Fy, M) in a contact state; q (3, ...), real or complex.

        The state does not follow the gaps at q, so that the result is smooth in q; it is the
        physical load where `state_at(q)` is that state. rates (3, ...): the velocities of (x, y,
        theta), on which damping and falling friction depend; left out the pad is at rest.
        """
        if rates is None:
            return np.array(np.broadcast_arrays(*net_loads(np, self.c, self.law, tuple(q), state)))
        c = at_speed(np, self.c, self.pad.fall, rates[0])
        loads = net_loads(np, c, self.law, tuple(q), state)
        if self.damping is not None:
            drag = [sum(map(operator.mul, row, rates)) for row in self.damping]
            loads = Loads(loads.x - drag[0], loads.y - drag[1], loads.moment - drag[2])
        return np.array(np.broadcast_arrays(*loads))

    def gaps(self, q: Number) -> np.ndarray:
        """Gaps of the contact points (the two edges in B1 and B2), shape (points, ...)."""
        return np.array(self.law.gaps(self.c, pose_of(np, tuple(q))))

    def state_at(self, q: Number) -> State:
        """Contact state at q (3,): a point touches where its gap is negative."""
        return State(*(self.gaps(q) < 0.0).tolist())

    @property
    def terms(self) -> tuple[str, ...]:
        """Which terms with velocities the equations have, by name."""
        terms = []
        if self.damping is not None:
            terms.append("damping")
        if self.pad.mu_s is not None:
            terms.append("falling")
        return tuple(terms)

    @property
    def term_values(self) -> np.ndarray:
        """The numbers (`term_count`, ...) of these terms: `decay` D, then `Pad.fall` and V."""
        if not self.terms:
            return np.empty(0)
        numbers = [*self.decay.reshape(9, *self.decay.shape[2:])]  # D row by row
        if self.pad.fall is not None:
            numbers += [*self.pad.fall, self.pad.V]
        return np.array(np.broadcast_arrays(*numbers))

    @property
    def decay(self) -> np.ndarray:
        """D (3, 3, ...) = M^-1 C in (x, y, w theta), whose velocities v damping changes by -D v."""
        if self.damping is None:
            return np.zeros((3, 3))
        # C acts on (x, y, theta) = (x, y, w theta) / lever: D_ij = lever_i C_ij / (mass_i lever_j)
        lever = np.array(np.broadcast_arrays(1.0, 1.0, self.pad.w))
        mass = np.array(np.broadcast_arrays(self.pad.m, self.pad.m, self.pad.I))
        return np.asarray(np.array(self.damping) * lever[:, None] / (mass[:, None] * lever))

    def energy(self, q: Number, rates: Number, state: Touching) -> Number:
        """Kinetic plus potential energy, shape of q[0]; F_n is a dead load."""
        pose = pose_of(np, tuple(q))
        c = self.c
        kinetic = 0.5 * (c.m * (rates[0] ** 2 + rates[1] ** 2) + c.I * rates[2] ** 2)
        return (
            kinetic + spring_energy(np, c, pose) + self.law.energy(c, pose, state) + c.F_n * pose.y
        )

    @property
    def states(self) -> tuple[State, ...]:
        """The contact states that the model knows: full contact, none, and those between."""
        return states(self.law.points)

    @property
    def full(self) -> State:
        """Full contact: all points touch."""
        return self.states[0]

    @property
    def none(self) -> State:
        """No contact: no point touches."""
        return self.states[1]

    def state_name(self, state: State) -> str:
        """The name of a contact state: "1" to "4" (Fig. 3), or "FC", "PC", "SS" (Fig. 8)."""
        return self.law.state_name(state)


class Linearisation(NamedTuple):
    """M q'' + C q' + K q = 0 about an equilibrium, each matrix (3, 3), SI units, unwritable.

    About n equilibria C and K are stacks (3, 3, n).
    """

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray


def linearise(model: PadModel, q: Number, state: Touching) -> Linearisation:
    """Matrices about q = (x, y, theta) in a contact state, contact and friction included.

    K and C are minus the derivatives of the loads of Eqs. (4)-(6) or (8)-(10) by q and by its
    velocity, exact to rounding; about several equilibria q (3, n) they are stacks (3, 3, n).
    """
    pad = model.pad
    C = np.zeros((3, *np.shape(q)))
    if model.terms:  # the loads depend on velocities
        C = -complex_step(lambda rates: model.loads(q, state, rates), np.zeros(np.shape(q)))
    M = np.diag([pad.m, pad.m, pad.I]).astype(float)
    K = -complex_step(partial(model.loads, state=state), q)
    matrices = Linearisation(M, C, K)
    for X in matrices:
        X.flags.writeable = False
    return matrices


def about_origin(model: PadModel) -> Linearisation:
    """Matrices in full contact about the origin; of B3, the article's with its right-hand side
    linearised too."""
    return linearise(model, np.zeros(3), model.full)


@dataclass(frozen=True)
class Units:
    """Mass in kg, length in m, time in s, and the lever (m) that turns rotation into length.

    Of many pads each may be an array (n,).
    """

    mass: float
    length: float
    time: float
    lever: float

    @property
    def velocity(self) -> float:
        """In m/s."""
        return self.length / self.time

    @property
    def force(self) -> float:
        """In N."""
        return self.mass * self.length / self.time**2

    @property
    def energy(self) -> float:
        """In J."""
        return self.force * self.length

    def scaled(self, model: PadModel) -> PadModel:
        """A model in SI units measured in these."""
        pad = model.pad.scaled(self.mass, self.length, self.time)
        if model.damping is None:
            return dataclasses.replace(model, pad=pad)
        C = self.scaled_damping(model.damping)
        return dataclasses.replace(model, pad=pad, damping=tuple(map(tuple, C)))

    def scaled_damping(self, damping: ArrayLike) -> np.ndarray:
        """A damping matrix (3, 3) of x, y (m) and theta (rad) in these units.

        An entry of x and y is in mass / time; a row and a column of theta bring a length each.
        """
        lengths = np.array(np.broadcast_arrays(1.0, 1.0, self.length))
        return np.array(damping) * (self.time / self.mass) / (lengths[:, None] * lengths)

    def to_scaled(self, state: np.ndarray) -> np.ndarray:
        """(x, y, theta, rates) in SI units to the integrated state (x, y, w theta, rates)."""
        return np.asarray(state, dtype=float) / self._factors

    def to_si(self, state: np.ndarray) -> np.ndarray:
        """The integrated state (..., 6) to SI units."""
        return np.asarray(state, dtype=float) * self._factors

    @property
    def _factors(self) -> np.ndarray:
        of_q = np.array([self.length, self.length, self.length / self.lever])  # w theta to theta
        return np.concatenate([of_q, of_q / self.time])


def natural_units(model: PadModel, initial: Sequence[Number] | np.ndarray = (0.0,) * 6) -> Units:
    """Units from the pad's stiffness and mass, and from the size of its load and first state.

    The units of mass and time are the pad's mass m and sqrt(m / the sum of its stiffnesses), the
    unit of length is the largest of the first displacements and of F_n / that sum.

    initial: the first state (x, y, theta, rates) in SI units, numbers or arrays (n,); left out the
    pad is at rest in the initial position, where the load alone makes the unit of length. Raises
    InputError for a pad without any stiffness, which has no time of its own.
    """
    pad = model.pad
    stiffness = sum(getattr(pad, name) for name in ("k1", "k2", *model.law.parameters))
    if not np.all(stiffness > 0.0):
        raise InputError("Pad: no stiffness above 0; motion without any spring has no unit of time")
    time = np.sqrt(pad.m / stiffness)
    x, y, theta, x_dot, y_dot, theta_dot = initial
    height = pad.y0 + y if model.law.absolute_gap else y
    moved_by_velocity = time * np.hypot(np.hypot(x_dot, y_dot), pad.w * theta_dot)
    lengths = (x, height, pad.w * theta, moved_by_velocity, pad.F_n / stiffness)
    largest = reduce(np.maximum, map(np.abs, lengths))
    return Units(
        mass=_plain(pad.m),
        length=_plain(np.where(largest > 0.0, largest, pad.w)),
        time=_plain(time),
        lever=_plain(pad.w),
    )


def _plain(value: Number) -> Number:
    """A plain number, which is faster than one of NumPy, or an array as it is."""
    array = np.asarray(value)
    return array.item() if array.ndim == 0 else array
