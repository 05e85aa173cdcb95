"""Error against work: integrators on a smooth motion, two of the article's cases and a stiff pad.

Work is counted in evaluations of the right-hand side, which no machine changes. A Taylor step of
order p yields p derivatives and counts as p evaluations, though it costs more. SciPy and the fixed
step get the same equations compiled by heyoka. SciPy locates contact changes by its own events; the
fixed step switches by the signs at its ends, as the article's method may. The reference solution is
a motion in quad precision.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from squeal.article.cases import title
from squeal.article.identify.ensemble import simulate_many
from squeal.article.records import Record, Result
from squeal.article.studies._heyoka import without_heyoka
from squeal.article.studies._reference import (
    Reference,
    error_against,
    precision_in_words,
    reference,
)
from squeal.article.studies._scenes import read_scenes
from squeal.article.studies.extreme import scene_of
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.contact import ContactLaw, State
from squeal.model.equations import PadModel
from squeal.simulation.hybrid import first_contact, state_of, whole_motion
from squeal.simulation.run import in_natural_units

STEMS = ("b2-d", "b1-c", "b2-c")
SMOOTH = "B2, case (d), full contact"
OFF = 0.2  # static compressions by which the smooth motion starts above its equilibrium
STIFF = 1e3  # k3, k4 over k1 of the stiff pad, over one support period
STIFF_CASE = "B1, stiff contact"
TOLERANCES = tuple(10.0**-k for k in range(4, 15, 2))  # 1e-4, 1e-6 ... 1e-14
PATIENCE = 25_000  # evaluations: an integrator that takes more gets no tighter tolerances
SEVERAL = 256  # pads of a batch
NEAR = 1e-2  # natural units: a change this near one of the reference is taken for it
MOST = 100_000  # contact changes
AIM = 1e-10  # error at which work is compared
OWN = "squeal"
FIXED = "RK4, fixed step"


class Point(Record):
    """One run: relative error of the final place (None if infinite), contact changes that it misses
    and that it makes up, steps and evaluations of the right-hand side.

    tolerance: of a fixed step h, in natural units, h^4.
    """

    case: str
    path: str
    tolerance: float
    error: float | None
    missed: int
    extra: int
    steps: int
    evaluations: int


class Accuracy(Result):
    """Points; changes: of contact by case; truth: the reference in words; stiff:
    contact over support stiffness of the stiff pad; left_out: why there is nothing."""

    points: tuple[Point, ...]
    changes: dict[str, int]
    truth: str
    stiff: float = STIFF
    aim: float = AIM
    patience: int = PATIENCE
    left_out: str = ""

    def least(self, case: str, path: str) -> int | None:
        """The least evaluations with every contact change and an error of at most `AIM`."""
        enough = [
            point.evaluations
            for point in self.points
            if (point.case, point.path) == (case, path)
            and point.error is not None
            and point.error <= AIM
            and point.missed == point.extra == 0
        ]
        return min(enough, default=None)


@dataclass(frozen=True)
class Run:
    """Position (x, y, w theta) at the end and times of the contact changes, in natural units."""

    position: np.ndarray
    times: np.ndarray
    steps: int
    evaluations: int


def order(tolerance: float) -> int:
    """Order of heyoka's Taylor series at a tolerance."""
    return math.ceil(1.0 - math.log(max(tolerance, np.finfo(float).eps)) / 2.0)


Solver = Callable[[Scene, float], Run]
"""The run of a scene at a tolerance."""


def ours(scene: Scene, tolerance: float) -> Run:
    """The default path."""
    from squeal.simulation.taylor import TaylorIntegrator

    units, model, start, stop = in_natural_units(scene)
    integrator = TaylorIntegrator(model, tolerance)
    segment = whole_motion(model, integrator, units, start, stop)
    steps = int(segment.step_count[0])
    return Run(segment.end[:3, 0], segment.changes.t, steps, steps * order(tolerance))


def batch(scene: Scene, tolerance: float) -> Run:
    """`SEVERAL` equal pads at once; the run of the first one is returned."""
    motions = simulate_many(
        scene.model,
        scene.pad,
        np.tile(scene.initial, (SEVERAL, 1)),
        scene.stop or 0.0,
        tolerance,
        scene.formulation,
        events=True,
    )
    units, *_ = in_natural_units(scene)
    position = units.to_scaled(motions["final"][0])[:3]
    steps = int(motions["steps"][0])
    times, _points = motions["events"][0].T
    evaluations = steps * order(tolerance)  # a Taylor step of order p counts as p
    return Run(position, times / units.time, steps, evaluations)


@lru_cache(maxsize=64)
def _compiled(law: ContactLaw, contact: State) -> tuple[tuple[Any, int], ...]:
    """Compiled rates and gaps of a contact state, each with how many runtime parameters it reads.

    The runtime parameters are numbers of the scaled pad in the order of `taylor.NAMES`; a function
    reads them up to the last that appears in it.
    """
    import heyoka as hy

    from squeal.simulation.taylor import NAMES, equations

    # pairs of a variable and its rate, the gaps of the contact points, and what is not needed here
    system, heights, _ = equations(law, contact)
    variables = [variable for variable, _ in system]

    def compiled(outputs: list[Any]) -> tuple[Any, int]:
        """The compiled function of some expressions, and how many parameters it reads."""
        used = hy.get_params(outputs)
        count = max((i + 1 for i in range(len(NAMES)) if hy.par[i] in used), default=0)
        return hy.cfunc(outputs, variables), count

    rates = [rate for _, rate in system]
    return compiled(rates), compiled(heights)


def functions(model: PadModel, contact: State) -> list[Any]:
    """rhs(state) -> (6,) and gaps(state) -> (2,) of a scaled pad within a contact state."""
    from squeal.simulation.taylor import NAMES

    parameters = np.array([float(getattr(model.c, name)) for name in NAMES])

    def of_this_pad(call: Any, count: int) -> Callable[[np.ndarray], Any]:
        return lambda state: call(np.ascontiguousarray(state), pars=parameters[:count])

    return [of_this_pad(call, count) for call, count in _compiled(model.law, contact)]


class Leg(NamedTuple):
    """The end of a motion within one contact state: time, state, the edge that changes there (None
    at the end of the motion), and the steps taken."""

    t: float
    state: np.ndarray
    edge: int | None
    steps: int


StateFunction = Callable[[np.ndarray], Any]
Advance = Callable[[StateFunction, StateFunction, State, float, np.ndarray, float], Leg]
"""The leg from the right-hand side, the gaps, the contact state, the time, the state and the end
of the motion."""


def hybrid(advance: Advance, scene: Scene) -> Run:
    """The run of a scene in legs of one contact state each, joined at the contact changes.

    advance: integrates one leg in natural units, from the right-hand side, the gaps, the contact
    state, the time, the state (6,) and the end of the motion.
    """
    _, model, state, stop = in_natural_units(scene)
    contact = state_of(first_contact(model, state))
    t = 0.0
    steps = 0
    times: list[float] = []  # of the contact changes
    evaluations = 0
    while t < stop and len(times) < MOST:
        compiled, gaps = functions(model, contact)

        # the default binds the function of this leg
        def rhs(state: np.ndarray, compiled: StateFunction = compiled) -> Any:
            nonlocal evaluations
            evaluations += 1
            return compiled(state)

        leg = advance(rhs, gaps, contact, t, state, stop)
        t = leg.t
        state = leg.state
        steps += leg.steps
        if leg.edge is not None:
            times.append(t)
            contact = contact.flip(leg.edge)
    return Run(np.asarray(state)[:3], np.array(times), steps, evaluations)


def with_scipy(method: str, scene: Scene, tolerance: float) -> Run:
    """A method of `solve_ivp` with terminal events, restarted after each."""
    from scipy.integrate import solve_ivp

    def advance(
        rhs: StateFunction,
        gaps: StateFunction,
        contact: State,
        t: float,
        state: np.ndarray,
        stop: float,
    ) -> Leg:
        """The leg from the time t to the first contact change of an edge, or to `stop`.

        rhs, gaps: the rates (6,) and the gaps of both edges (2,) of a state (6,), in the contact
        state.
        """
        # solve_ivp asks for each edge alone: the gaps of a state are computed once for both
        gaps_at = lru_cache(maxsize=1)(lambda state_bytes: gaps(np.frombuffer(state_bytes)))
        events = []
        for edge in (0, 1):

            def gap(t: float, s: np.ndarray, edge: int = edge) -> float:
                return float(gaps_at(s.tobytes())[edge])

            # the integration ends where the gap rises through zero of an edge in contact, or falls
            # through zero of one that is off
            gap.terminal = True  # type: ignore[attr-defined]
            gap.direction = 1.0 if contact[edge] else -1.0  # type: ignore[attr-defined]
            events.append(gap)
        solution = solve_ivp(
            lambda _t, s: rhs(s),
            (t, stop),
            state,
            method=method,
            rtol=max(tolerance, 3e-14),  # the least that SciPy accepts
            atol=tolerance,
            events=events,
        )
        changed = next((edge for edge in (0, 1) if len(solution.t_events[edge])), None)
        return Leg(float(solution.t[-1]), solution.y[:, -1], changed, len(solution.t) - 1)

    return hybrid(advance, scene)


def with_fixed_step(scene: Scene, tolerance: float) -> Run:
    """The classical Runge-Kutta method with steps of `tolerance`^(1/4) natural time units.

    A contact point changes at the end of the step in which the sign of its gap does; of two in one
    step the second changes at the end of the next one.
    """
    longest = tolerance**0.25

    def advance(
        rhs: StateFunction,
        gaps: StateFunction,
        contact: State,
        t: float,
        state: np.ndarray,
        stop: float,
    ) -> Leg:
        """The leg from the time t to the end of the first step at which the sign of a gap has
        changed, or to `stop`."""
        now = t
        s = state
        steps = 0
        while now < stop:
            h = min(longest, stop - now)
            # rates at the begin of the step, twice in its middle, and at its end (RK4)
            first = rhs(s)
            second = rhs(s + 0.5 * h * first)
            third = rhs(s + 0.5 * h * second)
            fourth = rhs(s + h * third)
            s = s + h / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
            now += h
            steps += 1
            for edge, (gap, touches) in enumerate(zip(gaps(s), contact, strict=True)):
                if (gap < 0.0) != touches:  # below zero the edge is pressed into the surface
                    return Leg(now, s, edge, steps)
        return Leg(now, s, None, steps)

    return hybrid(advance, scene)


SOLVERS: dict[str, Solver] = {
    OWN: ours,
    "squeal, batch": batch,
    "SciPy DOP853": partial(with_scipy, "DOP853"),
    "SciPy RK45": partial(with_scipy, "RK45"),
    "SciPy LSODA": partial(with_scipy, "LSODA"),
    "SciPy Radau": partial(with_scipy, "Radau"),
    FIXED: with_fixed_step,
}


def compare_times(times: np.ndarray, exact: np.ndarray) -> tuple[int, int]:
    """How many contact changes of the reference are missed, and how many are made up.

    times: the rising times of the changes of a run; exact: those of the reference. Both lists are
    gone through together: two times nearer than `NEAR` are the same change, else the earlier one
    has no partner.
    """
    missed = 0
    extra = 0
    i = 0
    j = 0
    while i < len(times) and j < len(exact):
        difference = float(times[i] - exact[j])
        if abs(difference) <= NEAR:
            i += 1
            j += 1
        elif difference < 0.0:
            extra += 1
            i += 1
        else:
            missed += 1
            j += 1
    return missed + len(exact) - j, extra + len(times) - i


def points_of(
    case: str, scene: Scene, exact: Reference, path: str, solver: Solver, patience: int = PATIENCE
) -> list[Point]:
    """The points of one solver, `path` its name, over all `TOLERANCES`, loosest first.

    The list ends after the first run that takes more than `patience` evaluations.
    """
    points = []
    for tolerance in TOLERANCES:
        try:
            run = solver(scene, tolerance)
        except (ComputationError, ArithmeticError, ValueError, RuntimeError):
            continue  # some fail at the loosest or the tightest tolerances: no point
        error = error_against(run.position, exact.position)
        missed, extra = compare_times(run.times, exact.times)
        points.append(
            Point(
                case=case,
                path=path,
                tolerance=tolerance,
                error=error if math.isfinite(error) else None,
                missed=missed,
                extra=extra,
                steps=run.steps,
                evaluations=run.evaluations,
            )
        )
        if run.evaluations > patience:
            break
    return points


def smooth(scene: Scene) -> Scene:
    """The scene from rest near its equilibrium, so that contact stays full."""
    model = scene.pad_model
    equilibrium, why = sliding_equilibrium(model)
    if equilibrium is None:
        raise ComputationError(why)
    x, y, angle = equilibrium.q
    above = OFF * scene.pad.F_n / (scene.pad.k1 + scene.pad.k2)
    return replace(scene, initial=(x, y + above, angle, 0.0, 0.0, 0.0))


def cases_of(files: Sequence[Path]) -> dict[str, Scene]:
    """A smooth motion of case (d) of the line, the other scenes, and a stiff pad, by title."""
    scenes = read_scenes(files, STEMS)
    cases = {SMOOTH: smooth(scenes["b2-d"])}
    for name, scene in scenes.items():
        if name != "b2-d":
            cases[title(name)] = scene
    cases[STIFF_CASE] = scene_of("B1", 2.0 * math.pi, k3=STIFF, k4=STIFF)
    return {name: replace(scene, outputs=()) for name, scene in cases.items()}


def why_not() -> str:
    """Why there is nothing to compare, empty where there is."""
    return without_heyoka("nothing else compiles the equations for all integrators.")


def study(files: Sequence[Path]) -> Accuracy:
    """Measure all paths on the scenes given, or those of `STEMS`, and on a stiff pad."""
    if why := why_not():
        return Accuracy((), {}, precision_in_words(), left_out=why)
    cases = cases_of(files)
    exact = {case: reference(scene) for case, scene in cases.items()}
    points: list[Point] = []
    for case, scene in cases.items():
        for path, solver in SOLVERS.items():
            points += points_of(case, scene, exact[case], path, solver)
    changes = {case: len(motion.times) for case, motion in exact.items()}
    return Accuracy(tuple(points), changes, precision_in_words())


def sentences(record: Accuracy) -> dict[str, bool]:
    """What the paper says of error against work."""
    if record.left_out:
        return {}
    others = [path for path in SOLVERS if not path.startswith(OWN)]

    def needs_fewest(case: str) -> bool:
        """Whether no other integrator reaches the error of a case with as few evaluations."""
        by_squeal = record.least(case, OWN)
        counts = [record.least(case, path) for path in others]
        if by_squeal is None:
            return False
        return all(count is None or count > by_squeal for count in counts)

    with_impacts = [p for p in record.points if record.changes[p.case]]
    fixed = [p.error for p in with_impacts if p.path == FIXED and p.error is not None]
    loose = [p for p in with_impacts if p.path == "SciPy DOP853" and p.tolerance == 1e-4]
    return {
        "taylor-needs-fewest-evaluations": all(needs_fewest(case) for case in record.changes),
        "fixed-step-stays-above-1e-6": min(fixed, default=0.0) > 1e-6,
        "loose-tolerances-lose-contact-changes": all(p.missed + p.extra > 0 for p in loose),
    }
