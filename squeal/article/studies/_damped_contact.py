"""Models B1 and B2 with damping in the contact, and their periodic motions over two dampings.

Hunt and Crossley's law: where the surface is penetrated by p, the contact bears k p (1 + a p'),
k being a spring's stiffness on points and that of a unit of length on the line. In addition all
modes of the frictionless equilibrium have the same damping ratio zeta. The force vanishes with p,
so that the saltation matrix of a contact change is the identity. Where 1 + a p' < 0 the law gives
tension, which a contact does not bear. A motion that reaches this is marked: the law does not hold
for it.

Units: the state is (x, y, w theta) and rates, in static compressions of the contact F_n/k and in
times sqrt(m/k1).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import root

from squeal.article.identify.space import compression
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.linear import complex_eigenvalues
from squeal.model.contact import ContactLaw, LineContact, Touching
from squeal.model.pad import (
    Coefficients,
    Loads,
    Number,
    Point,
    Pose,
    coefficients,
    edges,
    gaps,
    pose_of,
    springs,
)
from squeal.numerics.differentiation import complex_step
from squeal.simulation.run import heyoka

# of one motion and its derivatives, and of many motions side by side
TOLERANCE = 1e-13  # of a step of a single motion
BATCH_TOLERANCE = 1e-9  # of a step of several side by side
PARAMETERS = ("a", "zeta", "mu")
"""What a cycle may be continued over, in the order of `Flow` columns."""
GAUSS = 1.0 / math.sqrt(3.0)  # two points integrate the cubic p (1 + a p') times its arm exactly

# indices of the runtime parameters of the compiled equations, after the pad's coefficients
_NAMES = Coefficients._fields
_ON = len(_NAMES)  # two: 1 where the leading and the trailing edge touch, else 0
_DECAY = _ON + 2  # nine: the matrix of modal damping by rows
_A = _DECAY + 9
_ZETA = _DECAY + 10
_MU = _NAMES.index("mu")
_V = _ZETA + 1  # speed of the surface
_COUNT = _V + 1  # of all runtime parameters


def gap_rates(c: Coefficients, at: Pose, v: Number, turning: Number) -> Point:
    """Rates of the gaps of the leading and the trailing lower edge; `turning` is theta'."""
    return v + turning * at.x_offset(c.rlx, c.rly), v + turning * at.x_offset(c.rtx, c.rty)


def touching_part(gl: Number, gt: Number, on: Touching) -> tuple[Number, Number]:
    """Middle and half length of the part of the line that touches, the face being (-1, 1).

    The gap is linear along the face, from gl at the leading edge (-1) to gt at the trailing one. If
    one edge alone touches, the part reaches from that edge to where the gap is zero: its half
    length is g/(g - g_other), g being the gap of that edge. If both touch, the part is the whole
    face; if none does, its half length is 0. Since heyoka compiles one formula for all contact
    states, the cases are told apart by the factors `on` (1 or 0) instead of by branches.

    With gaps -1 and 3, the leading edge alone touches on a quarter of the face, (-1, -0.5):

    >>> touching_part(-1.0, 3.0, (1.0, 0.0))
    (-0.75, 0.25)
    """
    side = on[1] - on[0]  # -1 or 1: the one edge that touches; 0 where none or both do
    one_edge = side * side
    full = on[0] * on[1]
    penetration = -one_edge * (on[0] * gl + on[1] * gt)
    # side * (gl - gt) is g_other - g; 1 - one_edge keeps the divisor from zero where none or both
    # touch and penetration is 0
    half = full + penetration / (side * (gl - gt) + (1.0 - one_edge))
    return side * (1.0 - half), half


def edge_forces(
    law: ContactLaw, c: Coefficients, g: Point, rates: Point, on: Touching, a: Number
) -> Point:
    """Normal forces at both edges that have the resultant and the moment of the contact.

    On points the force is k p (1 + a p') at each edge, the penetration p being minus the gap. On
    the line there is the pressure k_c p (1 + a p') over the part that touches. Each share of it is
    divided between the edges as on a lever: an edge that is lifted gets a share, too. Under the
    article's printed law ("mean", its Eq. (13)) the size of the force is that of the mean pressure
    on the whole face, its line of action that of the part.

    Parameters
    ----------
    g, rates : gaps of the edges and their rates
    on : factors 1 and 0 of the edges that touch, which stay the same between contact changes
    a : size of the damping, a time over a length, in the units of c

    Returns
    -------
    leading, trailing : forces, positive where they press
    """
    if not isinstance(law, LineContact):
        leading = -on[0] * c.k3 * g[0] * (1.0 - a * rates[0])
        return leading, -on[1] * c.k4 * g[1] * (1.0 - a * rates[1])
    middle, half = touching_part(g[0], g[1], on)
    share_of_face = half  # the share that touches, as the half length of the face is 1
    if law.line_force == "mean":
        share_of_face = on[0] + on[1] - on[0] * on[1]  # 1 where anything touches
    leading = 0.0
    trailing = 0.0
    for node in (-GAUSS, GAUSS):
        position = middle + node * half  # on the face, from -1 to 1
        share_l = 0.5 * (1.0 - position)  # of a force there, borne by the leading edge
        share_t = 0.5 * (1.0 + position)
        gap = share_l * g[0] + share_t * g[1]
        rate = share_l * rates[0] + share_t * rates[1]
        # k_c is the stiffness of the whole face, which two nodes of weight 1/2 share
        force = -0.5 * c.k_c * share_of_face * gap * (1.0 - a * rate)
        leading = leading + share_l * force
        trailing = trailing + share_t * force
    return leading, trailing


def least_factors(
    law: ContactLaw, g: Point, rates: Point, on: Touching, a: Number
) -> tuple[Number, Number]:
    """1 + a p' at both ends of what touches (line) or at both points, 1 where nothing does."""
    if not isinstance(law, LineContact):
        return 1.0 - on[0] * a * rates[0], 1.0 - on[1] * a * rates[1]
    middle, half = touching_part(g[0], g[1], on)
    any_touches = on[0] + on[1] - on[0] * on[1]

    def factor(position: Number) -> Number:
        rate = 0.5 * (1.0 - position) * rates[0] + 0.5 * (1.0 + position) * rates[1]
        return 1.0 - any_touches * a * rate

    return factor(middle - half), factor(middle + half)


def contact_loads(law: ContactLaw, c: Coefficients, at: Pose, forces: Point) -> Loads:
    """Normal forces at the edges and friction, on points where the edge is, on the line at h."""
    f1, f2 = forces
    if not isinstance(law, LineContact):
        leading = Loads.of(at, (c.rlx, c.rly), c.mu * f1, f1)
        return leading + Loads.of(at, (c.rtx, c.rty), c.mu * f2, f2)
    x1, x2 = edges(c, at)
    friction = c.mu * (f1 + f2)
    return Loads(friction, f1 + f2, x1 * f1 + x2 * f2 + c.h * friction)


class Motion(NamedTuple):
    """Accelerations (of x, y, w theta), gaps of the edges, factors 1 + a p', forces at the edges,
    and the speed of the lower face."""

    rates: tuple[Number, Number, Number]
    gaps: Point
    factors: tuple[Number, Number]
    forces: Point
    face: Number


def motion(
    ops: Any,
    law: ContactLaw,
    c: Coefficients,
    decay: Sequence[Number],
    a: Number,
    zeta: Number,
    state: Sequence[Number],
    on: Touching,
) -> Motion:
    """The equations of motion over generic arithmetic, see `squeal.model.pad`.

    Parameters
    ----------
    ops : the module of the arithmetic, NumPy or heyoka
    decay : nine numbers by rows, the matrix M^-1 C at the modal damping ratio 1; zeta times this
        matrix times the velocities is subtracted from the accelerations
    a, zeta : contact damping in the units of the motion, and modal damping ratio
    state : x, y, s = w theta and their rates u, v, r
    on : factors 1 and 0 of the edges that touch
    """
    x, y, s, u, v, r = state
    at = pose_of(ops, (x, y, s / c.w))
    g = gaps(c, at)
    rates = gap_rates(c, at, v, r / c.w)
    forces = edge_forces(law, c, g, rates, on, a)
    total = springs(ops, c, at) + contact_loads(law, c, at, forces)
    driving = (total.x / c.m, (total.y - c.F_n) / c.m, c.w * total.moment / c.I)
    accelerations = []
    for i in range(3):
        # row i of the matrix times the velocities
        drag = decay[3 * i] * u + decay[3 * i + 1] * v + decay[3 * i + 2] * r
        accelerations.append(driving[i] - zeta * drag)
    ax, ay, turning = accelerations
    # of the middle of the lower face, at -(rly + rty)/2 below the mass centre, by theta' = r/w
    face = u - r / c.w * 0.5 * (c.rly + c.rty)
    return Motion((ax, ay, turning), g, least_factors(law, g, rates, on, a), forces, face)


@dataclass(frozen=True, eq=False)
class DampedContact:
    """A pad of a scene with both dampings.

    a: of the contact, s/m; zeta: the modal damping ratio; mu: friction.
    """

    scene: Scene
    a: float
    zeta: float
    mu: float

    @classmethod
    def of(cls, scene: Scene, a: float, zeta: float) -> DampedContact:
        """At the scene's friction."""
        return cls(scene, a, zeta, float(scene.pad.mu))

    def replace(self, **changes: float) -> DampedContact:
        """The pad with other values of `PARAMETERS`."""
        values = {"a": self.a, "zeta": self.zeta, "mu": self.mu} | changes
        other = DampedContact(self.scene, **values)
        for name in ("length", "time", "_decay"):  # of the scene alone: not computed again
            if name in vars(self):
                vars(other)[name] = vars(self)[name]
        return other

    @property
    def law(self) -> ContactLaw:
        """The law without damping."""
        return self.scene.pad_model.law

    @cached_property
    def length(self) -> float:
        """Unit of length in m, the static compression."""
        return float(compression(self.scene.pad))

    @cached_property
    def time(self) -> float:
        """Unit of time in s."""
        return math.sqrt(self.scene.pad.m / self.scene.pad.k1)

    @cached_property
    def _decay(self) -> np.ndarray:
        """The matrix (9,) of `motion`, from that at a small ratio, to which it is proportional."""
        ratio = 0.01
        scene = dataclasses.replace(self.scene, damping=Damping(ratios=(ratio,) * 3))
        return damped_model(scene).decay.ravel() * self.time / ratio

    @cached_property
    def c(self) -> Coefficients:
        """Coefficients in the units of the motion."""
        pad = self.scene.pad.replace(mu=self.mu)
        scaled = pad.scaled(float(pad.m), self.length, self.time)
        return coefficients(np, scaled, self.law.absolute_gap)

    @property
    def surface_speed(self) -> float:
        """Speed of the surface in the units of the motion, infinite where the scene has none."""
        speed = self.scene.pad.V
        return math.inf if speed is None else speed * self.time / self.length

    @property
    def size(self) -> float:
        """`a` in the units of the motion."""
        return self.a * self.length / self.time

    @cached_property
    def numbers(self) -> np.ndarray:
        """The runtime parameters of `Flow`, no edge touching."""
        parameters = np.zeros(_COUNT)
        parameters[:_ON] = self.c
        parameters[_DECAY:_A] = self._decay
        parameters[_A] = self.size
        parameters[_ZETA] = self.zeta
        parameters[_V] = self.surface_speed
        return parameters

    def at(self, state: Any, on: Touching | None = None) -> Motion:
        """The equations at a state (6, ...), in the contact state there if none is given."""
        if on is None:
            g = gaps(self.c, pose_of(np, (state[0], state[1], state[2] / self.c.w)))
            on = (1.0 * (np.real(g[0]) < 0.0), 1.0 * (np.real(g[1]) < 0.0))
        return motion(np, self.law, self.c, self._decay.tolist(), self.size, self.zeta, state, on)

    def gap_rates(self, state: np.ndarray) -> Point:
        """Rates of the gaps of both edges at a state (6, ...)."""
        c = self.c
        at = pose_of(np, (state[0], state[1], state[2] / c.w))
        return gap_rates(c, at, state[4], state[5] / c.w)

    def rates(self, state: Any) -> np.ndarray:
        """Time derivative (6, ...) of a state."""
        return np.array([*state[3:], *self.at(state).rates])

    @cached_property
    def sliding(self) -> np.ndarray:
        """The state (6,) of steady sliding. Raises ComputationError where there is none."""

        def at_rest(pose_at_rest: np.ndarray) -> np.ndarray:
            return np.append(pose_at_rest, np.zeros(3))

        pressed_in = [0.0, -1.0, 0.0]  # the static compression
        solution = root(lambda q: self.at(at_rest(q)).rates, pressed_in, tol=1e-13)
        if not solution.success and np.abs(solution.fun).max() > 1e-9:
            raise ComputationError("no steady sliding")
        return at_rest(solution.x)

    @property
    def sliding_matrix(self) -> np.ndarray:
        """The matrix (6, 6) of small motions about steady sliding."""
        return np.asarray(complex_step(self.rates, self.sliding))

    @property
    def growth(self) -> float:
        """Greatest growth rate about steady sliding, 1/s."""
        matrix = self.sliding_matrix
        spectrum = complex_eigenvalues(np.eye(3), -matrix[3:, 3:], -matrix[3:, :3])
        return float(spectrum.dominant.value.real) / self.time


class Passage(NamedTuple):
    """A contact change: time, edge (0 leading, 1 trailing), whether it touches from then on."""

    t: float
    edge: int
    touches: bool


class Arc(NamedTuple):
    """A motion over some time from a state.

    end (6,); matrix (6, 9): derivatives of the end by the start and by `PARAMETERS` (a in the units
    of the motion); passages; invalid: the law gave tension, or the lower face became as fast as the
    surface.
    """

    end: np.ndarray
    matrix: np.ndarray
    passages: tuple[Passage, ...]
    invalid: bool


class _Equations(NamedTuple):
    """Heyoka's expressions of a law: each state variable with its rate, the motion, and the factors
    of the edges that touch, which are runtime parameters."""

    system: list[tuple[Any, Number]]
    motion: Motion
    on: tuple[Any, Any]


def _equations(law: ContactLaw) -> _Equations:
    """Heyoka's expressions of the equations of a law."""
    hy = heyoka().hy
    c = Coefficients(*(hy.par[i] for i in range(_ON)))
    on = (hy.par[_ON], hy.par[_ON + 1])
    decay = [hy.par[_DECAY + i] for i in range(9)]
    state = hy.make_vars("x", "y", "s", "u", "v", "r")
    expressions = motion(hy, law, c, decay, hy.par[_A], hy.par[_ZETA], state, on)
    rates = (*state[3:], *expressions.rates)
    return _Equations(list(zip(state, rates, strict=True)), expressions, on)


def limits(expressions: Motion) -> list[Any]:
    """Expressions that are positive as long as the equations hold: no tension, and a lower face
    slower than the surface."""
    taylor = heyoka()
    # so faint that the step does not depend on it
    slower = taylor.FAINT * (taylor.hy.par[_V] - expressions.face)
    return [*expressions.factors, slower]


class Flow:
    """A compiled integrator of a law with its variational equations, for every pad.

    A contact change is a terminal event that switches the edge; the end of the equations' validity
    is an event that only marks the motion.
    """

    def __init__(self, law: ContactLaw) -> None:
        """Compile the equations with their derivatives by the state and by `PARAMETERS`."""
        hy = heyoka().hy
        equations = _equations(law)
        state = [variable for variable, _ in equations.system]
        parameters = [hy.par[_A], hy.par[_ZETA], hy.par[_MU]]
        # of the present run, filled by the events: contact changes, and the times at which the
        # equations ceased to hold
        self._passages: list[Passage] = []
        self._times_invalid: list[float] = []
        upwards = hy.event_direction.positive
        downwards = hy.event_direction.negative
        # terminal events: expressions that pass zero upwards where the contact of an edge changes;
        # without a cooldown, since the same gap may pass zero again, the other way, at once
        changes = []
        for edge, expression in enumerate(heyoka().rising(equations.motion.gaps, equations.on)):
            switch = self._switch_contact(edge)
            changes.append(hy.t_event(expression, direction=upwards, callback=switch, cooldown=0.0))
        # events that do not stop a motion: expressions that pass zero downwards where the
        # equations no longer hold
        ends_of_validity = [
            hy.nt_event(limit, self._mark_invalid(), direction=downwards)
            for limit in limits(equations.motion)
        ]
        self.ta = hy.taylor_adaptive(
            hy.var_ode_sys(equations.system, state + parameters),
            tol=TOLERANCE,
            t_events=changes,
            nt_events=ends_of_validity,
            compact_mode=True,
            pars=np.zeros(_COUNT),
            state=np.zeros(6),
        )
        # derivatives of the first state by itself (the identity) and by the three parameters (zero)
        self._first_derivatives = np.zeros((6, 9))
        self._first_derivatives[:, :6] = np.eye(6)

    def _switch_contact(self, edge: int) -> Callable[[Any, int], bool]:
        """What heyoka calls where the contact of an edge changes."""
        passages = self._passages

        def switch(ta: Any, _sign: int) -> bool:
            touches = ta.pars[_ON + edge] == 0.0
            ta.pars[_ON + edge] = 1.0 if touches else 0.0
            passages.append(Passage(ta.time, edge, touches))
            return True  # the motion goes on

        return switch

    def _mark_invalid(self) -> Callable[[Any, float, int], None]:
        """What heyoka calls where the equations cease to hold."""
        times = self._times_invalid
        return lambda _ta, t, _sign: times.append(t)

    def run(self, pad: DampedContact, state: np.ndarray, time: float) -> Arc:
        """The motion from a state (6,) over a time, both in the units of the motion.

        Raises ComputationError where it is not finite.
        """
        ta = self.ta
        self._passages.clear()
        self._times_invalid.clear()
        ta.pars[:] = pad.numbers
        ta.pars[_ON : _ON + 2] = np.array(pad.at(state).gaps) < 0.0  # which edges touch
        ta.time = 0.0
        # the state is followed by its derivatives, 1 by the start and 0 by the parameters
        ta.state[:6] = state
        ta.state[6:] = self._first_derivatives.ravel()
        ta.reset_cooldowns()  # else events soon after one of the last motion would be ignored
        outcome, *_ = ta.propagate_until(time)
        if outcome != heyoka().hy.taylor_outcome.time_limit:
            raise ComputationError("the motion is not finite")
        return Arc(
            end=ta.state[:6].copy(),
            matrix=ta.state[6:].reshape(6, 9).copy(),
            passages=tuple(self._passages),
            invalid=bool(self._times_invalid),
        )


@lru_cache
def flow(law: ContactLaw) -> Flow:
    """The integrator of a law."""
    return Flow(law)


LANES = 4  # motions that heyoka integrates at once
RESTS = 60.0  # units of time, some six periods of a cycle: without a contact change a motion rests


class Fate(NamedTuple):
    """What becomes of many motions of a pad.

    ends (n, 6): states at the end; lasts (n,): contact still changes; invalid (n,): on the way the
    law gave tension, or the lower face became as fast as the surface.
    """

    ends: np.ndarray
    lasts: np.ndarray
    invalid: np.ndarray


class Ensemble:
    """A compiled integrator of a law for many motions side by side."""

    def __init__(self, law: ContactLaw) -> None:
        """Compile the equations for `LANES` motions side by side."""
        hy = heyoka().hy
        equations = _equations(law)
        # of each lane, filled by the events: how often contact has changed since the counts were
        # set to 0, and whether the equations ceased to hold
        self._change_counts = [0] * LANES
        self._invalid = [False] * LANES
        upwards = hy.event_direction.positive
        downwards = hy.event_direction.negative
        # terminal events: expressions that pass zero upwards where the contact of an edge changes;
        # without a cooldown, since the same gap may pass zero again, the other way, at once
        changes = []
        for edge, expression in enumerate(heyoka().rising(equations.motion.gaps, equations.on)):
            switch = self._switch_contact(edge)
            changes.append(
                hy.t_event_batch(expression, direction=upwards, callback=switch, cooldown=0.0)
            )
        # events that do not stop a motion: expressions that pass zero downwards where the
        # equations no longer hold
        ends_of_validity = [
            hy.nt_event_batch(limit, self._mark_invalid(), direction=downwards)
            for limit in limits(equations.motion)
        ]
        self.ta = hy.taylor_adaptive_batch(
            equations.system,
            np.zeros((6, LANES)),
            tol=BATCH_TOLERANCE,
            t_events=changes,
            nt_events=ends_of_validity,
            pars=np.zeros((_COUNT, LANES)),
        )

    def _switch_contact(self, edge: int) -> Callable[[Any, int, int], bool]:
        """What heyoka calls where the contact of an edge changes in a lane."""
        counts = self._change_counts

        def switch(ta: Any, _sign: int, lane: int) -> bool:
            ta.pars[_ON + edge, lane] = 1.0 - ta.pars[_ON + edge, lane]
            counts[lane] += 1
            return True  # the motion goes on

        return switch

    def _mark_invalid(self) -> Callable[[Any, float, int, int], None]:
        """What heyoka calls where the equations cease to hold in a lane."""
        invalid = self._invalid

        def mark(_ta: Any, _t: float, _sign: int, lane: int) -> None:
            invalid[lane] = True

        return mark

    def fate(self, pad: DampedContact, states: np.ndarray, longest: float) -> Fate:
        """What becomes of motions from states (n, 6).

        A motion has come to rest once contact has not changed for the time `RESTS`; it lasts if
        contact has changed in each interval `RESTS` up to the time `longest` (rounded up to a
        multiple of `RESTS`).

        Raises ComputationError where one of them is not finite.
        """
        count = len(states)
        ends = np.array(states)
        lasts = np.zeros(count, dtype=bool)
        invalid = np.zeros(count, dtype=bool)
        for first in range(0, count, LANES):
            # the last batch fills its spare lanes with the last motion once more
            index = np.minimum(np.arange(first, first + LANES), count - 1)
            self._start(pad, ends[index])
            still_changing = np.ones(LANES, dtype=bool)
            end = 0.0
            while still_changing.any() and end < longest:
                end += RESTS
                self._change_counts[:] = [0] * LANES
                self._advance(end)
                still_changing &= np.array(self._change_counts) > 0
            ends[index] = self.ta.state.T
            lasts[index] = still_changing
            invalid[index] = self._invalid
        return Fate(ends, lasts, invalid)

    def _start(self, pad: DampedContact, states: np.ndarray) -> None:
        """Put the motions of all lanes to their states (lanes, 6) at time 0."""
        ta = self.ta
        self._invalid[:] = [False] * LANES
        ta.pars[:] = pad.numbers[:, None]
        ta.pars[_ON : _ON + 2] = np.array(pad.at(states.T).gaps) < 0.0
        ta.state[:] = states.T
        ta.set_time(0.0)
        ta.reset_cooldowns()

    def _advance(self, end: float) -> None:
        """Move all lanes on to a time. Raises ComputationError where a motion is not finite."""
        self.ta.propagate_until([end] * LANES)
        # where one lane is not finite, heyoka stops the others as well
        if np.any(self.ta.time < end):
            raise ComputationError("a motion is not finite")


@lru_cache
def ensemble(law: ContactLaw) -> Ensemble:
    """The integrator of many motions of a law."""
    return Ensemble(law)
