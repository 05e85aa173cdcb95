"""One pad: the eigenvalues about its equilibrium, its modes over the friction, its thresholds."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from squeal.analysis.answers import (
    MISSED,
    Eigenvalues,
    ModeShape,
    Step,
    Sweep,
    Thresholds,
    numbered,
    shape_rows,
)
from squeal.equilibrium import Equilibrium, Path, sliding_equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.equilibrium.statics import excursion
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.io.writing import number
from squeal.linear import (
    GROWING,
    CriticalPoint,
    Crossing,
    Judgement,
    Matrices,
    Spectrum,
    SystemFunction,
    UnstableMode,
    thresholds,
    unstable_modes,
)
from squeal.linear.continuation import ContinuationOptions
from squeal.linear.eigen import ACCEPTED, STIFF, decide, hidden, spectrum_of
from squeal.linear.matrices import EPS, checked, reduce
from squeal.linear.paths import Loss, continued
from squeal.model.contact import State, contact_law
from squeal.model.equations import Linearisation, PadModel, about_origin, linearise
from squeal.schema import NOT_NEGATIVE, Number, Place, Several

MATRIX_DIGITS = "12 digits"  # to which those of an equilibrium are taken to be known
MU_MAX = Number(low=0.0, high=1000.0)
MUS = Several(NOT_NEGATIVE, "a sequence of numbers of at least 0")
SAMPLES = 201  # values of mu at which modes are drawn
if TYPE_CHECKING:  # pads start without the referee
    from squeal.analysis.ranges import RangeStatement

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


def roots_and_verdict(
    M: ArrayLike, C: ArrayLike | None, K: ArrayLike
) -> tuple[Spectrum, Judgement]:
    """All eigenvalues of matrices (n, n) and the verdict on them.

    Raises ComputationError where rounding of a stiffness or damping hides the slow ones.
    """
    M, C, K = checked(M, C, K)
    reduced = reduce(M, C, K)
    squares = np.abs(np.diag(reduced.A))  # of the frequencies of each coordinate alone
    # upright springs hold nothing along the surface: (k cos^2) of a rounded angle is no slow mode
    if squares.min() > EPS**2 * squares.max() and hidden(reduced, C, K):
        raise ComputationError(f"no eigenvalue can be given: {STIFF}")
    spectrum = spectrum_of(reduced)
    return spectrum, decide(spectrum.values, spectrum.rounding)


def branch_system(scene: Scene, high: float) -> tuple[SystemFunction, Path | None]:
    """mu -> (M, C, K) about the equilibrium on the branch from mu = 0, and the branch's path.

    B3 is linearised about the origin at every mu and has no path. Raises ComputationError if
    there is no equilibrium without friction.
    """
    model = damped_model(scene)
    if model.linear:
        return lambda mu: about_origin(model.replace(mu=mu)), None
    path = Path.of(model, high)
    return path, path


def _growing(scene: Scene, analysis: Analysis) -> tuple[UnstableMode, ...]:
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


def mode_shapes(spectrum: Spectrum, levers: ArrayLike = 1.0) -> tuple[ModeShape, ...]:
    """The shape of each mode: of a pair of eigenvalues, and of half of the real ones.

    levers (n,): lengths that make the coordinates comparable, (1, 1, w) of a pad; 1 if left out.
    Of the real eigenvalues those that grow faster are taken.
    """
    shapes = []
    real = [e for e in spectrum.eigenvalues if e.value.imag == 0.0]
    pairs = [e for e in spectrum.eigenvalues if e.value.imag > 0.0]
    real.sort(key=lambda e: -e.growth_rate)
    for k, e in enumerate([*real[: (len(real) + 1) // 2], *pairs], 1):
        scaled = np.asarray(levers) * e.right
        shape = e.right / scaled[int(np.argmax(np.abs(scaled)))]
        shapes.append(ModeShape(k, e.frequency_hz, e.growth_rate, shape))
    return tuple(shapes)


def eigenvalues(scene: Scene, at: float | None = None, prove: bool = True) -> Eigenvalues:
    """The eigenvalues about the sliding equilibrium at a friction, the scene's own if left out.

    With `prove` the referee judges them, the matrices taken for known to 12 digits: those of an
    equilibrium are computed numbers.
    """
    scene = scene if at is None else scene.replace(mu=at)
    analysis = analyse(scene)
    names, units = ("x", "y", "theta"), ("m", "m", "rad")
    place = dict(zip(names, analysis.q, strict=True))
    contact, spectrum = analysis.contact, analysis.spectrum
    details = {
        "model": analysis.model,
        "equilibrium": place | {"R_n": analysis.R_n, "contact": contact},
        "how": analysis.how,
        **{name: X.tolist() for name, X in zip("MCK", analysis.matrices, strict=True)},
        "basis": None,
    }
    places = zip(names, analysis.q, units, strict=True)
    where = ", ".join(f"{name} = {number(value)} {unit}" for name, value, unit in places)
    reaction = "" if analysis.R_n is None else f", R_n = {number(analysis.R_n)} N"
    note = f"model {analysis.model}: {where}, contact {contact}{reaction}\n({analysis.how})"
    shapes = mode_shapes(spectrum, (1.0, 1.0, scene.pad.w))
    rows = shape_rows(shapes, names, "largest of x, y, w theta 1 m")
    judgement = analysis.judgement
    words: tuple[str | None, str] = judgement.verdict, str(judgement)
    roots = tuple(spectrum.eigenvalues)
    proven = all(root.residual <= ACCEPTED for root in roots)
    proof: dict[str, Any] = {}
    if prove:
        from squeal.analysis.systems.proofs import Data, refereed  # no other question needs it

        roots, words, statement = refereed(analysis.matrices, roots, words, Data(MATRIX_DIGITS))
        proven = statement.status == "proved"
        proof = {"proof": statement.to_dict(), "proof_line": statement.words}
    head = scene.model, "mu", scene.pad.mu, roots, *words
    count = len(roots)  # M is regular: all roots of the characteristic polynomial
    more: Any = ("", rows, details, (note,), "", analysis.warnings, (scene, analysis))
    return Eigenvalues(*head, _growing(scene, analysis), proven, count, *more, **proof)


def sweep(scene: Scene, values: Sequence[float]) -> Sweep:
    """The eigenvalues at each mu along the branch from mu = 0."""
    values = MUS.read(values, Place("sweep", "values"))
    model, steps = damped_model(scene), []
    system, path = branch_system(scene, max(values))
    for mu in values:
        if path is None:
            at = _about_origin(model.replace(mu=mu))
        elif (e := path.equilibrium(mu)) is not None:
            at = _about(model, e, "on the branch continued from mu = 0")
        else:
            steps.append(Step(mu, None, None, None, None, False))
            continue
        known, verdict = at.spectrum, at.judgement.verdict
        errors = np.array([root.residual for root in known.eigenvalues])
        last = at.contact, at.admissible, 0, known.rounding
        steps.append(Step(mu, known.values, errors, verdict, *last))
    reached = {step.value: step for step in steps if step.roots is not None}
    losses, own, every = tuple[Loss, ...](), None, sorted(reached)
    if every:
        rows, alone = [reached[mu] for mu in every], len(every) == 1  # it spans no range
        at_mu = None if alone else continued(system, every).at
        rows, losses, own = numbered(rows, at_mu, scene.pad.mu)
        reached = dict(zip(every, rows, strict=True))
    steps = [reached.get(step.value, step) for step in steps]
    return Sweep(scene.model, "mu", tuple(steps), losses, own, source=scene)


def critical_friction(scene: Scene, high: float = 2.0, prove: bool | None = False) -> Thresholds:
    """Thresholds of the scene's pad along the branch from mu = 0 (B3: about the origin).

    The branch is followed up to its first fold, where the equilibrium ceases; the fold is then
    the last entry. With `prove`, or None, the referee judges the list; `proof` says up to where,
    and thresholds there get the intervals in which they are proved. What it refutes is searched
    again, with the place in question as one that is looked at.

    Raises InputError for a friction that is not `MU_MAX`, ComputationError if there is no
    equilibrium without friction.
    """
    high = MU_MAX.read(high, Place("thresholds", "high"))
    system, path = branch_system(scene, high)
    if path is not None and path.mu_end <= 0.0:
        raise ComputationError(f"no threshold can be given: {path.end}")
    M, C, K = checked(*system(0.0))
    if path is not None and hidden(reduce(M, C, K), C, K):
        raise ComputationError(f"no threshold can be given: {STIFF}")
    answer = _listed(scene, high, system, path)
    if prove is False:
        return answer
    fastest = math.sqrt(float(np.linalg.norm(np.linalg.solve(M, K), 2)))
    proved, refuted = _proved(answer, fastest)
    if refuted is not None:
        again, still = _proved(_listed(scene, high, system, path, [refuted]), fastest)
        return proved if still is not None else again
    return proved


def _listed(
    scene: Scene,
    high: float,
    system: SystemFunction,
    path: Path | None,
    looked_at: Sequence[float] = (),
) -> Thresholds:
    """The thresholds without a proof; `looked_at` are values of friction at which steps end."""
    at_zero = roots_and_verdict(*checked(*system(0.0)))[1].verdict
    end = high if path is None else path.mu_end
    fold, reach = None if path is None else path.fold, end
    if path is not None and fold is not None:
        # nearer to it rounding makes thresholds, and at it the contact may have changed
        reach = max(fold * (1 - 1e-9) - path.error(fold), fold / 2)
    breakpoints = [*(path.breakpoints if path else ()), *looked_at]
    located = thresholds(system, reach, breakpoints)
    points, crossings = located.points, located.crossings
    words, admissible_to, warnings = f"mu = {high:g} is reached", end, list[str]()
    if path is not None:
        words = path.end
        if fold is not None:
            points.append(CriticalPoint(fold, "fold", 0.0, (fold, fold), True))
        points = [_widened(point, path) for point in points]
        crossings = [_widened(one, path) for one in crossings]
        admissible_to, warnings = _admissible(path)
        if fold is not None and fold < scene.pad.mu <= high:
            warnings.append(
                f"the scene's mu = {scene.pad.mu:g} lies beyond a fold: the branch from mu = 0 "
                f"turns back at mu = {fold:.9g}"
            )
    events = tuple(points), tuple(crossings), words, located.certified, tuple(warnings)
    details = {"admissible_to": min(admissible_to, end)}
    head = scene.model, "mu", 0.0, end, at_zero
    return Thresholds(*head, *events, details=details, source=(scene, path))


def _proved(answer: Thresholds, fastest: float) -> tuple[Thresholds, float | None]:
    """The answer with what the referee says of it, and the friction at which it is refuted.

    fastest: the fastest root without friction, rad/s.
    """
    from squeal.analysis.ranges import pad_statement  # here, since few answers need it

    scene, path = answer.source
    start = np.zeros(3) if path is None else np.array(path.equilibrium(0.0).q)
    losses = [point.mu for point in answer.points if point.kind in GROWING]
    statement, places = pad_statement(
        damped_model(scene),
        start,
        answer.crossings,
        answer.high,
        losses[0] if losses else None,
        fastest,
        None if path is None else path.fold,
    )
    return with_places(answer, statement, places), statement.refuted_at


def with_places(
    answer: Thresholds, statement: "RangeStatement", places: Sequence[tuple[float, float]]
) -> Thresholds:
    """The answer with what the referee says of it, and the intervals in which it is proved."""

    def widened(one: Located) -> Located:
        holding = [(a, b) for a, b in places if a <= one.mu <= b]
        return replace(one, interval=holding[0]) if holding else one

    proved = statement.status == "proved"
    notes = [words for words in answer.notes if not (proved and words.endswith(MISSED))]
    details = {**answer.details}
    if "doubts" in details:
        details["doubts"] = [] if proved else [statement.reason]
    return replace(
        answer,
        notes=tuple(notes),
        details=details,
        points=tuple(map(widened, answer.points)),
        crossings=tuple(map(widened, answer.crossings)),
        certified=proved,
        proof=statement.to_dict(),
        proof_line=statement.words,
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


def _admissible(path: Path) -> tuple[float, list[str]]:
    """The mu from which on equilibria exceed a limit, to nine digits, and which limit that is."""

    def beyond(z: np.ndarray, touching: np.ndarray) -> np.ndarray:
        at = excursion(path.statics, z, touching)
        return np.flatnonzero(at.beyond().any(axis=0) & (at.reaction > 0.0))

    outside = beyond(path.branch.z, path.branch.touching)
    if not outside.size:
        return path.mu_end, []
    low, high = path.branch.z[3, [max(outside[0] - 1, 0), outside[0]]].tolist()
    while high - low > 1e-9 * high:
        middle = (low + high) / 2
        low, high = (low, middle) if beyond(*path.places([middle])).size else (middle, high)
    at = path.equilibrium(high)
    assert at is not None
    return low, [f"from mu = {high:.6g} on {words}" for words in at.excesses]


def along(found: Thresholds, low: float, high: float) -> Sweep:
    """The eigenvalues over a range of the friction whose thresholds are known, for a figure.

    Raises ComputationError if the branch of equilibria ends before `low`.
    """
    share, stop, seen = np.linspace(0.0, 1.0, SAMPLES), min(found.high, high), found.points
    if found.high <= low:
        raise ComputationError(f"no equilibrium at mu = {low:.9g}: {found.end}")
    if any(point.kind == "fold" for point in seen):
        # a frequency falls there as a fourth root: the values crowd
        share, stop = 1.0 - (1.0 - share) ** 2, stop * (1.0 - 1e-9)
    values = [*(low + (stop - low) * share), *(point.mu for point in seen)]
    return sweep(found.source[0], np.unique(np.clip(values, low, stop)).tolist())
