"""One pad: the eigenvalues about its equilibrium, its modes over the friction, its thresholds."""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from squeal.analysis.answers import ModeShape, Thresholds
from squeal.equilibrium import Equilibrium, Path, find_all, sliding_equilibrium
from squeal.equilibrium.find import damped_model
from squeal.equilibrium.statics import excursion
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene
from squeal.linear import (
    Batched,
    CriticalPoint,
    Crossing,
    Judgement,
    Matrices,
    Spectrum,
    System,
    UnstableMode,
    judge,
    thresholds,
    track,
    unstable_modes,
    verdict,
)
from squeal.linear.continuation import ContinuationOptions
from squeal.linear.eigen import STIFF, decide, hidden, ordered, spectrum_of
from squeal.linear.matrices import EPS, checked, reduce, scaled_rank
from squeal.model.contact import State, contact_law, contact_model
from squeal.model.equations import Linearisation, PadModel, about_origin, linearise
from squeal.schema import NOT_NEGATIVE, Number, Place, Several

LOST = 0.03  # of an eigenvalue: rounding of K that leaves no digit of it
MU_MAX = Number(low=0.0, high=1000.0)
MUS = Several(NOT_NEGATIVE, "a sequence of numbers of at least 0")
PAD_COORDINATES = ("x", "y", "theta")
SAMPLES = 201  # values of mu that a sweep looks at
Located = TypeVar("Located", CriticalPoint, Crossing)


@dataclass(frozen=True)
class Analysis:
    """One equilibrium, the linearisation about it, its six eigenvalues and the verdict.

    q = (x, y, theta) in SI units; R_n is None for B3, which is linearised about the origin.
    on_branch: the equilibrium is reached from the one without friction; warnings: a sentence for
    each reason why it is none that the model means.
    """

    model: str
    q: tuple[float, float, float]
    R_n: float | None
    state: State
    how: str
    matrices: Linearisation = field(repr=False)
    spectrum: Spectrum = field(repr=False)
    judgement: Judgement
    on_branch: bool = True
    warnings: tuple[str, ...] = ()

    @property
    def admissible(self) -> bool:
        """True if nothing speaks against the equilibrium."""
        return not self.warnings

    @property
    def frequencies_hz(self) -> np.ndarray:
        """Frequencies of the three modes in Hz."""
        return self.spectrum.frequencies_hz

    @property
    def contact(self) -> str:
        """Name of the contact state."""
        return contact_law(self.model).state_name(self.state)


def at_equilibrium(model: PadModel, e: Equilibrium) -> Linearisation:
    """The linearisation of a model about one of its equilibria."""
    return linearise(model, np.array(e.q), e.state)


def analyse(scene: Scene) -> Analysis:
    """Complex eigenvalue analysis of the scene's sliding equilibrium (B3: about the origin).

    Raises ComputationError, with the reason, if no steady sliding exists.
    """
    model = damped_model(scene)
    if model.linear:
        return _about_origin(model)
    equilibrium, how = sliding_equilibrium(model)
    if equilibrium is None:
        raise ComputationError(how)
    return _about(model, equilibrium, how)


def _about_origin(model: PadModel) -> Analysis:
    at, how = about_origin(model), "about the origin, full contact"
    return Analysis(model.name, (0.0,) * 3, None, model.full, how, at, *roots_and_verdict(*at))


def _about(model: PadModel, e: Equilibrium, how: str) -> Analysis:
    at = at_equilibrium(model.replace(mu=e.mu), e)
    result = (*roots_and_verdict(*at), e.on_branch, e.warnings)
    return Analysis(model.name, e.q, e.R_n, e.state, how, at, *result)


def held_system(scene: Scene, at: Analysis | Equilibrium) -> System:
    """mu -> (M, C, K) of the scene's pad with the equilibrium held where it is."""
    own, q = damped_model(scene), np.array(at.q)
    return lambda mu: linearise(own.replace(mu=mu), q, at.state)


def sweep_mu(scene: Scene, mus: Iterable[float]) -> list[tuple[float, Analysis | None]]:
    """The analysis at each mu along the branch from mu = 0; None where the branch does not reach.

    Raises InputError for no mu at all or one below 0, ComputationError if there is no equilibrium
    without friction.
    """
    mus = MUS.read(mus, Place("sweep", "values"))
    model = damped_model(scene)
    if model.linear:
        return [(mu, _about_origin(model.replace(mu=mu))) for mu in mus]
    path = Path.of(model, max(mus))
    how = "on the branch continued from mu = 0"
    places = [(mu, path.equilibrium(mu)) for mu in mus]
    return [(mu, None if e is None else _about(model, e, how)) for mu, e in places]


def judged_equilibria(scene: Scene) -> list[tuple[Equilibrium, Judgement]]:
    """All sliding equilibria at the scene's mu with the verdict on each, least potential first.

    The one that `analyse` takes is that `on_branch`, or the first if the branch from mu = 0 does
    not reach the scene's mu; where it does not rise up to there, all of them lie beyond. Raises
    InputError for a linear model, which has none of its own.
    """
    if contact_model(scene.model).linear:
        raise Place("judged_equilibria").refuse(
            f"{scene.model} is not allowed; a linearisation has no equilibria of its own"
        )
    model, lever = damped_model(scene), np.array([1.0, 1.0, scene.pad.w])
    each, taken = find_all(model), sliding_equilibrium(model)[0]
    if taken is not None:  # it stands for that of the list which is the same, and all lie alike

        def other(e: Equilibrium) -> bool:
            step, size = np.subtract(e.q, taken.q) * lever, np.multiply(taken.q, lever)
            return bool(np.abs(step).max() > 1e-6 * np.abs(size).max())

        others = [replace(e, beyond=taken.beyond) for e in each if other(e)]
        each = sorted([*others, taken], key=lambda e: e.potential)
    return [(e, judge(*at_equilibrium(model, e))) for e in each]


def roots_and_verdict(
    M: ArrayLike, C: ArrayLike | None, K: ArrayLike
) -> tuple[Spectrum, Judgement]:
    """All eigenvalues of matrices (n, n) and the verdict on them.

    Where the standard form hides slow roots they come from the pencil, each with the error that
    rounding of M, C and K may bring. Raises ComputationError if that leaves one no digit, and
    OverflowError where one is beyond double precision.
    """
    M, C, K = checked(M, C, K)
    reduced = reduce(M, C, K)
    squares = np.abs(np.diag(reduced.A))  # of the frequencies of each coordinate alone
    # upright springs hold nothing along the surface: (k cos^2) of a rounded angle is no slow mode
    free = squares.min() <= EPS**2 * squares.max()
    if free or not hidden(reduced, C, K):
        spectrum = spectrum_of(reduced)
        return spectrum, decide(spectrum.values, spectrum.rounding)
    from squeal.sparse.dense import dense_spectrum  # a tenth of a query's time
    from squeal.sparse.quadratic import ROUNDING

    roots = dense_spectrum(M, C, K)
    if len(roots) < 2 * len(M):  # a pad has no motion without mass
        raise OverflowError("the eigenvalues are beyond double precision")
    regular = scaled_rank(K) == len(K)  # else roots may be exactly zero
    errors = [max(e.residual, ROUNDING) * e.condition if e.value or regular else 0.0 for e in roots]
    if not all(error <= LOST for error in errors):
        raise ComputationError(f"no eigenvalue can be given: {STIFF}")
    values = np.array([e.value for e in roots])
    order = ordered(values)
    judgement = decide(values, np.abs(values) * np.array(errors))
    return Spectrum(tuple(roots[k] for k in order)), judgement


def branch_system(scene: Scene, mu_max: float) -> tuple[System, Path | None]:
    """mu -> (M, C, K) about the equilibrium on the branch from mu = 0, and the branch's path.

    B3 is linearised about the origin at every mu and has no path. Raises ComputationError if
    there is no equilibrium without friction.
    """
    model = damped_model(scene)
    if model.linear:
        return lambda mu: about_origin(model.replace(mu=mu)), None
    path = Path.of(model, mu_max)
    return Batched(path.linearisation, path.linearisations), path


def growing_modes(scene: Scene, analysis: Analysis) -> tuple[UnstableMode, ...]:
    """The modes of an analysed scene that grow, the fastest first.

    An onset is None where the mode grows without friction, or where the equilibrium does not lie
    on the branch that begins there, or lies beyond a fold of it.
    """
    own, mu = analysis.matrices, scene.pad.mu
    grow = unstable_modes(lambda _: own, mu)
    if not grow or mu == 0.0 or not analysis.on_branch:
        return grow
    system, path = branch_system(scene, mu)
    if path is not None and path.mu_end < mu:
        return grow

    def along(at: float) -> Matrices:
        return own if at == mu else system(at)

    return unstable_modes(along, mu, thresholds(along, mu, path.breakpoints if path else ()))


def mode_shapes(spectrum: Spectrum, levers: Sequence[float] = ()) -> tuple[ModeShape, ...]:
    """The shape of each mode: of a pair of eigenvalues, and of half of the real ones.

    levers (n,): lengths that make the coordinates comparable, (1, 1, w) of a pad; 1 if left out.
    Of the real eigenvalues those that grow faster are taken.
    """
    size, shapes = np.asarray(levers) if len(levers) else 1.0, []
    real = [e for e in spectrum.eigenvalues if e.value.imag == 0.0]
    pairs = [e for e in spectrum.eigenvalues if e.value.imag > 0.0]
    real.sort(key=lambda e: -e.growth_rate)
    for number, e in enumerate([*real[: (len(real) + 1) // 2], *pairs], 1):
        scaled = size * e.right
        shape = e.right / scaled[int(np.argmax(np.abs(scaled)))]
        shapes.append(ModeShape(number, e.frequency_hz, e.growth_rate, shape))
    return tuple(shapes)


def shapes_of_pad(analysis: Analysis, w: float) -> tuple[ModeShape, ...]:
    """Mode shapes (x, y, theta) of a pad of half length w, the largest of x, y, w theta 1 m."""
    return mode_shapes(analysis.spectrum, (1.0, 1.0, w))


@dataclass(frozen=True, eq=False)
class ModeSweep:
    """Modes followed over the friction from low to high, and what happens on the way.

    mus (k,); values (k, 2n) rad/s, of which columns 2j and 2j + 1 are a mode and its conjugate, by
    rising frequency at the start; spans: (from, to, verdict) between the thresholds; crossings of
    the imaginary axis; contacts: (mu, state) where the contact changes; end: how far the branch
    reaches.
    """

    low: float
    high: float
    end: float
    mus: np.ndarray = field(repr=False)
    values: np.ndarray = field(repr=False)
    spans: tuple[tuple[float, float, str], ...]
    crossings: tuple[Crossing, ...]
    contacts: tuple[tuple[float, str], ...]


def sweep_modes(scene: Scene, low: float, high: float) -> ModeSweep:
    """Follow the modes of a scene along its branch from mu = low to high.

    Raises InputError unless 0 <= low < high, ComputationError if there is no equilibrium without
    friction, or the branch ends before `low`.
    """
    if not 0.0 <= low < high < math.inf:
        raise InputError(f"sweep_modes: low {low:g}: it must be 0 <= low < high, which is {high:g}")
    return modes_along(*branch_system(scene, high), low, high)


def modes_along(system: System, path: Path | None, low: float, high: float) -> ModeSweep:
    """Follow the modes of a system, that of the path if there is one."""
    end, stop = high, high
    contacts: tuple[tuple[float, str], ...] = ()
    if path is not None:
        end = min(high, path.mu_end)
        if end <= low:
            path.at(low)  # raises, with the reason
        stop = end * (1.0 - 1e-9) if path.fold == end else end
        inside = [mu for mu in path.breakpoints if low < mu < end]
        contacts = tuple((mu, path.model.state_name(path.at(mu)[1])) for mu in inside)
    events = thresholds(system, stop, [mu for mu, _ in contacts], low)
    edges = [low, *(p.mu for p in events.points if low < p.mu < stop), stop]
    spans = [(a, b, verdict(*system((a + b) / 2))) for a, b in itertools.pairwise(edges) if b > a]
    marked = [*edges, *(c.mu for c in events.crossings)]
    modes = track(system, values_of_mu(path, low, stop, marked, SAMPLES))
    crossings = tuple(events.crossings)
    return ModeSweep(low, high, end, modes.mus, modes.values, tuple(spans), crossings, contacts)


def values_of_mu(
    path: Path | None, low: float, high: float, marked: Sequence[float], count: int
) -> np.ndarray:
    """Where modes are looked at: `count` values from low to high, and marked values among them.

    Towards a fold the values crowd, since a frequency falls there as a fourth root; the fold
    itself, where the linearisation is singular, is left out by 1e-9. A contact change is looked at
    from both sides.
    """
    share, breaks = np.linspace(0.0, 1.0, count), path.breakpoints if path else []
    if path is not None and path.fold is not None and path.fold <= high * (1.0 + 1e-8):
        share, high = (1.0 - (1.0 - share) ** 2) * (1.0 - 1e-9), path.fold
    grid = low + (high - low) * share
    before = [math.nextafter(mu, 0.0) for mu in breaks]
    extra = [mu for mu in [*marked, *breaks, *before] if low <= mu <= grid[-1]]
    return np.unique(np.concatenate([grid, extra]))


def critical_friction(scene: Scene, mu_max: float = 2.0) -> Thresholds:
    """Thresholds of the scene's pad along the branch from mu = 0 (B3: about the origin).

    The branch is followed up to its first fold, where the equilibrium ceases; the fold is then
    the last entry. Raises InputError for a mu_max that is not `MU_MAX`, ComputationError if there
    is no equilibrium without friction.
    """
    mu_max = MU_MAX.read(mu_max, Place("thresholds", "high"))
    system, path = branch_system(scene, mu_max)
    if path is None:
        return replace(critical_parameter(system, mu_max), name=scene.model, source=(scene,))
    if path.mu_end <= 0.0:
        raise ComputationError(f"no threshold can be given: {path.end}")
    M, C, K = checked(*system(0.0))
    at_zero = roots_and_verdict(M, C, K)[1].verdict
    if hidden(reduce(M, C, K), C, K):
        raise ComputationError(f"no threshold can be given: {STIFF}")
    located, fold = thresholds(system, path.mu_end, path.breakpoints), path.fold
    end = math.inf if fold is None else fold * (1 - 1e-9) - path.error(fold)
    points = [_widened(point, path) for point in located.points if point.mu < end]
    crossings = [_widened(one, path) for one in located.crossings if one.mu < end]
    admissible_to, warnings = _admissible(path)
    if fold is not None:
        points.append(_widened(CriticalPoint(fold, "fold", 0.0, (fold, fold), True), path))
        if fold < scene.pad.mu <= mu_max:
            warnings += (
                f"the scene's mu = {scene.pad.mu:g} lies beyond a fold: the branch from mu = 0 "
                f"turns back at mu = {fold:.9g}",
            )
    return Thresholds(
        scene.model,
        "mu",
        0.0,
        path.mu_end,
        at_zero,
        tuple(points),
        tuple(crossings),
        path.end,
        located.certified,
        warnings,
        details={"admissible_to": min(admissible_to, path.mu_end)},
        source=(scene,),
    )


def _widened(at: Located, path: Path) -> Located:
    """A fold or a change of contact with the interval in which rounding leaves it."""
    error = path.error(at.mu)
    if not error:
        return at
    wide = (at.mu - error, at.mu + error)
    if isinstance(at, Crossing):
        return replace(at, interval=wide)
    return replace(at, interval=wide, converged=2 * error <= ContinuationOptions.same * at.mu)


def critical_parameter(system: System, high: float, name: str = "mu") -> Thresholds:
    """The same for a system of matrices along its parameter from 0 to `high`."""
    located, end = thresholds(system, high), f"{name} = {high:g} is reached"
    at_zero = roots_and_verdict(*system(0.0))[1].verdict
    events = tuple(located.points), tuple(located.crossings), end, located.certified
    return Thresholds("", name, 0.0, high, at_zero, *events, details={"admissible_to": high})


def _admissible(path: Path) -> tuple[float, tuple[str, ...]]:
    """The mu from which on equilibria exceed a limit, to nine digits, and which limit that is."""

    def beyond(z: np.ndarray, touching: np.ndarray) -> np.ndarray:
        at = excursion(path.statics, z, touching)
        return np.asarray(at.beyond().any(axis=0) & (at.reaction > 0.0))

    branch = path.branch
    outside = beyond(branch.z, branch.touching)
    if not outside.any():
        return path.mu_end, ()
    first = int(np.argmax(outside))
    low, high = branch.z[3, [max(first - 1, 0), first]].tolist()
    while high - low > 1e-9 * high:
        values = np.linspace(low, high, 17)
        first = int(np.argmax([*beyond(*path.places(values[1:-1].tolist())), True]))
        low, high = values[first : first + 2].tolist()
    at = path.equilibrium(high)
    assert at is not None
    return low, tuple(f"from mu = {high:.6g} on {words}" for words in at.excesses)
