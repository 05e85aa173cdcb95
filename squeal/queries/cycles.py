"""The verb `cycles`: periodic motions of a pad over a parameter, and where sliding is stable."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from operator import attrgetter
from typing import Any

import numpy as np

from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import COORDINATES, Scene, check_simulation
from squeal.io.writing import Answer, Column, Mark, Panel, Table, number
from squeal.model.contact import ContactLaw
from squeal.model.equations import PadModel, net_loads
from squeal.model.pad import PARAMETERS, Coefficients, at_speed
from squeal.queries.pads.equilibrium import analyse
from squeal.schema import Place, public
from squeal.simulation.cycles import CLOSED_CURVE, RESTS, Cycle, Shooting
from squeal.simulation.observers import Extrema, Grid, SignalFunction, face_speed, plotted
from squeal.simulation.run import in_natural_units

WINDOWS = 40  # times the observation time of the scene in which its motion may settle
STEP = 0.2  # length of a step along the branch, in natural units
MOST = 80  # cycles of the branch to each side of the first
SLIDING = 41  # values at which the stability of sliding is computed
IN_DOUBT = "unknown"  # stands for a verdict that rounding hides
LOCATED = 1e-10  # of the range: how closely a change of that stability is located
READINGS = 16  # points in each time step of a cycle for quadrature and extrema: to rounding


@dataclass(frozen=True)
class Orbit:
    """A periodic motion in SI units.

    Attributes
    ----------
    value : float
        The value of the parameter.
    period : float
        The period in s.
    amplitude : tuple of 3 float
        Half of the range of x, y (m) and theta (rad).
    velocity : float
        Root mean square of the normal velocity (m/s), which radiates the sound.
    extrema : dict
        Least and greatest value of each plotted signal, forces over F_n and delta over w; None
        without contact.
    peak : float
        Greatest sum of the contact forces over F_n, of both edges in B1; 0 without contact.
    contacts : tuple of str
        The contact state after each change of contact, in order; empty where contact never changes.
    multipliers : tuple of 5 complex
        Floquet multipliers, the largest first, without that of a shift in time, which is 1.
    stable : bool or None
        Whether small deviations decay; None where the multipliers do not decide.
    friction, damping : float
        Work of friction on the pad, and energy that damping takes, in J per period.
    face : float or None
        Greatest speed of the lower face while it touches, over V; None without V.
    start : tuple of 6 float
        A state of the motion: x, y, theta and their rates.
    turn : str
        What happens here on the branch, such as a fold or a period doubling, see
        `squeal.simulation.cycles.Cycle`; empty for nothing.
    """

    value: float
    period: float
    amplitude: tuple[float, ...]
    velocity: float
    extrema: dict[str, tuple[float, float] | None]
    peak: float
    contacts: tuple[str, ...]
    multipliers: tuple[complex, ...]
    stable: bool | None
    friction: float
    damping: float
    face: float | None
    start: tuple[float, ...]
    turn: str = ""

    @property
    def sliding_holds(self) -> bool | None:
        """Whether the surface stays faster than what rubs on it, as the equations assume."""
        return None if self.face is None else self.face < 1.0

    @property
    def frequency_hz(self) -> float:
        """1 / period."""
        return 1.0 / self.period

    @property
    def multiplier(self) -> float:
        """The greatest absolute value of the multipliers."""
        return abs(self.multipliers[0])

    def to_dict(self) -> dict[str, Any]:
        """The JSON object of a cycle."""
        return vars(self) | {
            "frequency_hz": self.frequency_hz,
            "amplitude": dict(zip(COORDINATES[:3], self.amplitude, strict=True)),
            "multipliers": [{"real": m.real, "imag": m.imag} for m in self.multipliers],
            "sliding_holds": self.sliding_holds,
            "start": dict(zip(COORDINATES, self.start, strict=True)),
            "turn": self.turn or None,
        }


STABLE_WORDS = {True: "yes", False: "no", None: "?"}
COLUMNS = (
    Column("period", "s"),
    Column("frequency_hz"),
    Column("amplitude_x", "m", lambda orbit: orbit.amplitude[0], hidden=True),
    Column("amplitude_y", "m", lambda orbit: orbit.amplitude[1]),
    Column("amplitude_theta", "rad", lambda orbit: orbit.amplitude[2], hidden=True),
    Column("velocity", "m/s"),
    Column("peak", "F_n"),
    Column("multiplier"),
    Column("stable", shown=lambda orbit: STABLE_WORDS[orbit.stable]),
    Column("friction", "J", hidden=True),
    Column("damping", "J", hidden=True),
    Column("face", "V"),
    Column("turn"),
    Column("contacts", value=lambda orbit: " ".join(orbit.contacts)),
)


@dataclass(frozen=True, eq=False, repr=False)
class Cycles(Answer):
    """A branch of periodic motions over a parameter.

    Attributes
    ----------
    model, parameter : str
        Of the scene, and what is varied.
    orbits : tuple of Orbit
        The motions in their order along the branch; empty where there is none, with the `reason`.
    own : int
        Index of the motion at the scene's own value of the parameter.
    ends : (str, str)
        Why the branch ends at its first and at its last motion; empty at the end of the range.
    sliding : tuple of (float, str or None)
        Values of the parameter, each with the verdict on the sliding equilibrium, `IN_DOUBT` where
        rounding hides it, None where there is no equilibrium.
    critical : tuple of (float, str or None)
        Values at which that verdict changes, each with the verdict from there on.
    source : (Shooting, Cycle) or None
        What the motions were computed with, and the first of them in natural units.

    Examples
    --------
    >>> import squeal
    >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8,
    ...                  L2=0.8, alpha1=1.57, alpha2=3.14, mu=0.1, F_n=4500.0)
    >>> scene = squeal.Scene("B1", pad, stop=1e-2, samples=2, start="equilibrium",
    ...                      damping=squeal.Damping(ratios=(0.05, 0.05, 0.05)))
    >>> squeal.cycles(scene).to_records()  # the motion comes to rest
    []
    """

    panel = Panel(0, "amplitude_y", Mark.LINES)

    model: str
    parameter: str
    orbits: tuple[Orbit, ...] = ()
    own: int = 0
    reason: str = ""
    ends: tuple[str, str] = ("", "")
    sliding: tuple[tuple[float, str | None], ...] = ()
    critical: tuple[tuple[float, str | None], ...] = ()
    source: tuple[Shooting, Cycle] | None = field(default=None, repr=False)

    @property
    def at_scene(self) -> Orbit | None:
        """The motion at the scene's own value of the parameter; None where there is no motion."""
        return self.orbits[self.own] if self.orbits else None

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """Where the branch ends within the range, and how many cycles reach the surface's speed."""
        warnings = []
        for i, reason in zip((0, -1), self.ends, strict=True):  # the first and the last motion
            if reason not in ("", CLOSED_CURVE):
                at = f"{self.parameter} = {number(self.orbits[i].value)}"
                warnings.append(f"the branch ends at {at}: {reason}")
        too_fast = sum(orbit.sliding_holds is False for orbit in self.orbits)
        if too_fast:
            warnings.append(
                f"in {too_fast} of {len(self.orbits)} cycles the lower face reaches the speed V of "
                "the surface, beyond which the equations do not hold"
            )
        return tuple(warnings)

    def table(self) -> Table:
        """A row for each cycle.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8,
        ...                  L2=0.8, alpha1=1.57, alpha2=3.14, mu=0.1, F_n=4500.0)
        >>> damping = squeal.Damping(ratios=(0.05, 0.05, 0.05))
        >>> scene = squeal.Scene("B1", pad, stop=1e-2, samples=2, damping=damping)
        >>> found = squeal.cycles(scene)  # the motion comes to rest
        >>> len(found.table().rows)
        0
        """
        parameter = Column(self.parameter, value=attrgetter("value"))
        nothing = f"no periodic motion: {self.reason}"
        return Table([parameter, *COLUMNS], self.orbits, nothing=nothing)

    def parts(self) -> Sequence[str | Table]:
        """The cycles and where sliding is stable.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8,
        ...                  L2=0.8, alpha1=1.57, alpha2=3.14, mu=0.1, F_n=4500.0)
        >>> damping = squeal.Damping(ratios=(0.05, 0.05, 0.05))
        >>> scene = squeal.Scene("B1", pad, stop=1e-2, samples=2, damping=damping)
        >>> found = squeal.cycles(scene)  # the motion comes to rest
        >>> found.parts()[-1]
        'sliding at mu = 0.1: stable'
        """
        sliding = {}  # a sentence by value
        for value, verdict in self.sliding:
            verdict_in_words = verdict or "no equilibrium"
            sliding[value] = f"sliding at {self.parameter} = {number(value)}: {verdict_in_words}"
        at_scene = self.at_scene
        if at_scene is None:
            return [self.table(), *sliding.values()]
        parts: list[str | Table] = [
            self.table(),
            f"friction does {number(at_scene.friction)} J of work in a period, damping takes "
            f"{number(at_scene.damping)} J",
        ]
        if CLOSED_CURVE in self.ends:
            parts.append(self.ends[0])
        if at_scene.value in sliding:
            parts.append(sliding[at_scene.value])
        for value, verdict in self.critical:
            verdict_in_words = verdict or "no equilibrium"
            parts.append(f"sliding from {self.parameter} = {number(value)} on: {verdict_in_words}")
        return parts

    def to_dict(self) -> dict[str, Any]:
        """The JSON object of `squeal cycles`.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8,
        ...                  L2=0.8, alpha1=1.57, alpha2=3.14, mu=0.1, F_n=4500.0)
        >>> damping = squeal.Damping(ratios=(0.05, 0.05, 0.05))
        >>> scene = squeal.Scene("B1", pad, stop=1e-2, samples=2, damping=damping)
        >>> found = squeal.cycles(scene)  # the motion comes to rest
        >>> found.to_dict()["cycles"]
        []
        """
        turns = [orbit for orbit in self.orbits if orbit.turn]
        changes = [{"value": value, "verdict": verdict} for value, verdict in self.critical]
        return {
            "model": self.model,
            "parameter": self.parameter,
            "cycles": [orbit.to_dict() for orbit in self.orbits],
            "own": self.own if self.orbits else None,
            "reason": self.reason or None,
            "ends": [reason or None for reason in self.ends],
            "turning_points": [{"kind": orbit.turn, "value": orbit.value} for orbit in turns],
            "sliding": [{"value": value, "verdict": verdict} for value, verdict in self.sliding],
            "sliding_changes": changes,
        }


def _parameter_range(
    scene: Scene, over: tuple[str, float, float] | None
) -> tuple[str, float, float]:
    """Check the parameter and its range, which must hold the scene's value.

    Without `over` the parameter is mu, and the range its value alone. Raises InputError for an
    unknown parameter, and for values that it may not take.
    """
    values = scene.pad.given()  # of the parameters that the pad has, by name
    at = Place("cycles") / "over"
    name, low, high = over or ("mu", scene.pad.mu, scene.pad.mu)
    if name not in values:
        raise at.must_be(name, f"one of {', '.join(values)}")
    if not low <= values[name] <= high:
        allowed = (
            f"a range that holds {values[name]:g}, the scene's value, where the first cycle is"
        )
        raise at.must_be(f"{name}:{low:g}:{high:g}", allowed)
    for end in (low, high):
        scene.replace(**{name: end})  # refuses a value that the parameter may not take
    return name, low, high


def _scale_of(name: str, low: float, high: float) -> float:
    """What a parameter of this range is divided by for the continuation, which needs a value of the
    order of one: 1 for mu and angles, which have such values."""
    if name == "mu" or PARAMETERS[name].angle:
        return 1.0
    # a power of 2, so that value / scale * scale is the scene's own value to the last digit
    _, exponent = math.frexp(max(abs(low), abs(high)))
    return math.ldexp(1.0, exponent)


def _orbit(shooting: Shooting, cycle: Cycle, scale: float) -> Orbit:
    """Integrate and observe a cycle over its period, and return it in SI units.

    The cycle and its model are in natural units, the speed V of the surface among them.

    scale: `cycle.value` times it is the parameter in SI units.
    """
    model = shooting.model(cycle.value)
    units = shooting.units
    extrema = Extrema(model)
    extrema.observe(cycle.segment)
    grid = Grid(cycle.segment, count=READINGS)
    friction, damping, squared_velocity = _integrals(model, grid)
    # `grid.ranges` has a row (least, greatest) for each motion of a grid: [0] is the only one here
    ranges = [grid.ranges(_coordinate(i))[0] for i in range(3)]  # of x, y and w theta
    # `to_si` converts states of six: three zeros stand for the rates, which are dropped after it
    half_ranges = np.append(np.ptp(ranges, axis=1) / 2.0, np.zeros(3))
    # speed of the face along the surface: -inf if it never touches, negative if it only moves
    # against the surface while it touches
    _, fastest = grid.ranges(face_speed)[0]
    face = max(float(fastest), 0.0)
    return Orbit(
        value=float(cycle.value * scale),
        period=float(cycle.period * units.time),
        amplitude=tuple(units.to_si(half_ranges)[:3].tolist()),
        velocity=float(np.sqrt(squared_velocity / cycle.period) * units.velocity),
        extrema=extrema.result(),
        peak=_greatest_contact_force(model.law, grid),
        contacts=tuple(model.state_name(state) for state in cycle.contacts),
        multipliers=tuple(cycle.multipliers.tolist()),
        stable=cycle.stable,
        friction=friction * units.energy,
        damping=damping * units.energy,
        face=None if model.pad.V is None else face / model.pad.V,
        start=tuple(units.to_si(cycle.state).tolist()),
        turn=cycle.turn,
    )


def _greatest_contact_force(law: ContactLaw, grid: Grid) -> float:
    """Greatest sum of all contact forces over F_n in a grid of one motion, 0 without contact."""
    is_force = np.array([signal.is_force for signal in law.plotted])
    signals = plotted(law)

    def whole_force(c: Coefficients, states: np.ndarray, on: np.ndarray) -> np.ndarray:
        return np.asarray(signals(c, states, on)[is_force].sum(axis=0))

    _, greatest = grid.ranges(whole_force)[0]  # least and greatest of the only motion
    return max(float(greatest), 0.0)


def _integrals(model: PadModel, grid: Grid) -> tuple[float, float, float]:
    """The work of friction on the pad, the energy that damping takes, and the integral of the
    squared normal velocity, each over one motion, in natural units.

    The forces of friction are the loads with friction less those without it in the same state.
    Their work is positive if it feeds the motion.
    """
    c = model.c
    # grid.states (6, points, steps) are x, y, w theta and their rates, at some points in each time
    # step; `xy_theta` divides w theta, or its rate, by w
    q = c.xy_theta(grid.states[:3])
    velocity = np.array(c.xy_theta(grid.states[3:]))
    # (contacts, 1, steps): all points of a step have the same contact state
    contact = grid.steps.on[:, None]
    c_at_speed = at_speed(np, c, model.pad.fall, velocity[0])  # mu falls with the sliding speed
    with_friction = net_loads(np, c_at_speed, model.law, q, contact)
    without_friction = net_loads(np, c._replace(mu=0.0), model.law, q, contact)
    friction = np.subtract(with_friction, without_friction)
    C = np.zeros((3, 3)) if model.damping is None else model.damping
    drag = np.tensordot(C, velocity, 1)
    power_of_friction = (friction * velocity).sum(axis=0)
    power_of_damping = (drag * velocity).sum(axis=0)
    squared_normal_velocity = grid.states[4] ** 2  # the rate of y
    integrands = np.array([power_of_friction, power_of_damping, squared_normal_velocity])
    weighted = integrands * grid.weights[:, None] * grid.steps.h  # quadrature over each step
    work_of_friction, energy_of_damping, squared_velocity = weighted.sum(axis=(1, 2)).tolist()
    return work_of_friction, energy_of_damping, squared_velocity


def _coordinate(i: int) -> SignalFunction:
    """The signal of number i of a state: 0 of x, 1 of y, 2 of w theta."""
    return lambda _c, states, _on: states[i]


def _changes_of_sliding(
    sliding: Sequence[tuple[float, str | None]], verdict_at: Callable[[float], str | None]
) -> list[tuple[float, str | None]]:
    """Locate by bisection where the verdict on sliding changes between neighbouring values.

    A verdict that changes and changes back between two neighbours is not seen.

    Parameters
    ----------
    sliding : sequence of (float, str or None)
        Rising values of the parameter with their verdicts, None without an equilibrium.
    verdict_at : callable
        Gives the verdict at a value.

    Returns
    -------
    list of (float, str or None)
        The values of the changes, and the verdicts just after them.
    """
    lowest, _ = sliding[0]
    highest, _ = sliding[-1]
    rounding = 2.0 * float(np.spacing(max(abs(lowest), abs(highest))))  # no halving is finer
    tolerance = max(LOCATED * (highest - lowest), rounding)
    changes = []
    for (start, before), (end, after) in itertools.pairwise(sliding):
        low = start
        verdict = before
        # a bisection finds one change. With a third verdict between start and end it may be the
        # change to this third one: the next bisection then goes on from there
        while verdict != after:
            high = end
            verdict_beyond = after
            while high - low > tolerance:
                middle = 0.5 * (low + high)
                verdict_at_middle = verdict_at(middle)
                if verdict_at_middle == verdict:
                    low = middle
                else:
                    high = middle
                    verdict_beyond = verdict_at_middle
            changes.append((high, verdict_beyond))
            low = high
            verdict = verdict_beyond
    return changes


@public
def cycles(
    scene: Scene, over: tuple[str, float, float] | None = None, windows: int = WINDOWS
) -> Cycles:
    """Find the periodic motion to which a scene settles, and follow it over a parameter.

    The scene is simulated until its contact changes repeat; shooting then gives the cycle and its
    Floquet multipliers, and continuation by arc length follows it through folds.

    Parameters
    ----------
    scene : Scene
        A scene of a nonlinear model, with a time.
    over : (str, float, float), optional
        A parameter and its range, which holds the scene's value, such as ("mu", 0.1, 0.6).
    windows : int
        How many times the observation time of the scene its motion may take to settle.

    Returns
    -------
    Cycles
        The branch; without cycles and with a reason where the motion comes to rest or does not
        repeat itself.

    Raises
    ------
    ComputationError
        Where the model ends.
    InputError
        For a scene that cannot be simulated, an unknown parameter or a range without its value.

    Examples
    --------
    >>> import squeal
    >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8,
    ...                  L2=0.8, alpha1=1.57, alpha2=3.14, mu=0.1, F_n=4500.0)
    >>> scene = squeal.Scene("B1", pad, stop=1e-2, samples=2, start="equilibrium",
    ...                      damping=squeal.Damping(ratios=(0.05, 0.05, 0.05)))
    >>> squeal.cycles(scene)
    no periodic motion: the motion comes to rest
    <BLANKLINE>
    sliding at mu = 0.1: stable
    """
    check_simulation(scene)
    name, low, high = _parameter_range(scene, over)
    # the simulation runs in natural units: `start` and `stop`, and the models that `model_at` makes
    units, _, start, stop = in_natural_units(scene)
    value = getattr(scene.pad, name)
    scale = _scale_of(name, low, high)  # of the parameter in the continuation

    @lru_cache(maxsize=8)
    def model_at(scaled: float) -> PadModel:
        return units.scaled(damped_model(scene.replace(**{name: scaled * scale})))

    def verdict_at(parameter: float) -> str | None:
        """The verdict on the sliding equilibrium, None if there is none."""
        try:
            return analyse(scene.replace(**{name: parameter})).verdict or IN_DOUBT
        except ComputationError:
            return None

    shooting = Shooting(model_at, units)
    try:
        first, reason = shooting.settle(start, window=stop, value=value / scale, windows=windows)
    except ComputationError as error:
        if scene.damping is not None:
            raise
        hint = "nothing damps the pad; try `damping: {ratios: [0.02, 0.02, 0.02]}`"
        raise ComputationError(f"{error}; {hint}") from None
    if first is None:
        verdict = verdict_at(value)
        if reason == RESTS and verdict in ("flutter", "divergence"):
            reason += f" where sliding is not stable ({verdict}); other initial conditions leave it"
        return Cycles(scene.model, name, reason=reason, sliding=((value, verdict),))
    # the branch in two halves: cycles from the first one towards smaller, and towards larger values
    below: list[Cycle] = []
    above: list[Cycle] = []
    end_below = end_above = ""
    values_of_sliding = {value}
    if over:
        follow = partial(
            shooting.branch, first, ends=(low / scale, high / scale), longest_step=STEP, most=MOST
        )
        # each half with the reason why it ends
        below, end_below = follow(towards=-1.0)
        end_above = end_below  # of a closed curve, which is followed once: `below` has all of it
        if end_below != CLOSED_CURVE:
            above, end_above = follow(towards=1.0)
        values_of_sliding |= set(np.linspace(low, high, SLIDING).tolist())
    branch = (*reversed(below), first, *above)
    rising = sorted(values_of_sliding)
    sliding = tuple(zip(rising, map(verdict_at, rising), strict=True))
    return Cycles(
        model=scene.model,
        parameter=name,
        orbits=tuple(_orbit(shooting, cycle, scale) for cycle in branch),
        own=len(below),  # the index of `first`
        ends=(end_below, end_above),
        sliding=sliding,
        critical=tuple(_changes_of_sliding(sliding, verdict_at)),
        source=(shooting, first),
    )
