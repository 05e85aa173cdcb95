"""Which roots of a system are wanted, and the roots: all, those of a region, the lowest; on the
system itself or on a reduced one."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.analysis.answers import OPEN
from squeal.analysis.systems.matrices import ALL_ROWS
from squeal.analysis.systems.proofs import (
    NO_MOTION,
    Data,
    Statement,
    counted,
    exact_spectrum,
    refereed,
)
from squeal.errors import ComputationError, InputError, InputWarning
from squeal.io.processes import one_thread
from squeal.io.writing import picked
from squeal.linear import GROWING
from squeal.linear.continuation import form_of
from squeal.linear.eigen import (
    ACCEPTED,
    STIFF,
    Eigenvalue,
    assumed_rounding,
    decide,
    growing,
    hidden,
    ordered,
    roots_of,
    spectrum_of,
)
from squeal.linear.matrices import (
    SingularTogetherError,
    checked,
    rank_of,
    reduce,
    unit_diagonal,
)
from squeal.linear.system import Matrix, TermSystem
from squeal.schema import Place, row
from squeal.sparse.argument_principle import Disc, Rectangle, band, count_roots, disc_around
from squeal.sparse.dense import dense_spectrum, dense_values
from squeal.sparse.dispersive import frequencies, modes_at_own_frequencies
from squeal.sparse.eigensolver import OPTIONS as SOLVER
from squeal.sparse.eigensolver import lowest_modes, modes_in
from squeal.sparse.first_look import FirstLook
from squeal.sparse.quadratic import ScaledSystem, quadratic
from squeal.sparse.reduction import TOLERANCE, Reduction, reduce_system

LOOSE = 0.1  # of the end of a region: errors above are no estimate of where a root may lie
ROUGH = 1e-3  # of |lambda|: what roots that were seen on the way may be off
MODES = 20  # of a larger system where nothing else is wanted
NO_ROOT = "no root"  # the verdict on a band or region without one
NO_BAND = (
    "band: is missing, such as --band 500:5000 (Hz); systems of more than 400 rows, complex "
    "matrices, matrices that follow the frequency, and the methods reduced and modal need one"
)
Changes = Mapping[str, float]
Known = tuple[Eigenvalue, ...]


@dataclass(frozen=True)
class Wanted:
    """Roots of a band (Hz) or of a region, or the lowest ones; of a band the lowest `modes`.

    Raises InputError when made with a band and a region, or with what is none.
    """

    band: tuple[float, float] | None = None
    region: Rectangle | None = None
    modes: int | None = None

    def __post_init__(self) -> None:
        if self.band is not None and self.region is not None:
            raise InputError("band, region: one of them is allowed")
        if self.band is not None:
            band(*row(2).read(self.band, Place("band")))

    @property
    def rectangle(self) -> Rectangle | None:
        """The region, or that of the band; None if neither is given.

        What begins or ends on the real axis holds it.
        """
        region = self.region if self.band is None else band(*self.band)
        if region is None or (region.low_imag and region.high_imag):
            return region
        edge = 1e-6 * max(region.high_imag, -region.low_imag)
        low, high = region.low_imag or -edge, region.high_imag or edge
        return replace(region, low_imag=low, high_imag=high)

    def words(self, count: int | None = None) -> str:
        """The same in words, for people; of the lowest modes the `count` that were found."""
        if self.band is not None:
            return f"{self.band[0]:g} to {self.band[1]:g} Hz"
        if self.region is not None:
            r = self.region
            return f"{r.low_real:g} < Re < {r.high_real:g}, {r.low_imag:g} < Im < {r.high_imag:g}"
        modes = self.modes or MODES
        return f"the lowest {modes if count is None else min(count, modes)} modes"


def is_small(system: TermSystem) -> bool:
    """True if all roots of a system are computed."""
    return system.n <= ALL_ROWS and not system.follows


def check_memory(system: TermSystem, limit: float | None = None) -> None:
    """Refuse what does not fit into `limit` bytes (left out: what the machine has free).

    One factorisation and one subspace, as measured on three-dimensional solids; a full matrix
    takes what its entries need. Raises ComputationError.
    """
    entries = max(int(getattr(t.matrix, "nnz", t.matrix.size)) for t in system.terms)
    factor = min(16.0 * system.n**2, 12.0 * entries * system.n ** (1 / 3))
    needed, free = factor + 16 * 2 * 180 * system.n, math.inf if limit is None else limit
    if limit is None:
        with suppress(OSError, StopIteration):  # another machine than Linux does not say
            lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
            free = 1e3 * float(next(x for x in lines if x.startswith("MemAvailable:")).split()[1])
    if needed > free:
        raise ComputationError(
            f"{system.n} rows need about {needed / 1e9:.2g} GB for a factorisation, and "
            f"{free / 1e9:.2g} GB are free; --memory GB allows more, fewer rows need less"
        )


@dataclass(frozen=True, eq=False)
class SystemRoots:
    """Roots of a system, by rising frequency, what proves them complete, and the verdict on it.

    The verdict is of what was proven: where only some roots are known it is the kind of the
    fastest growing one, None if none of them grows; `criterion` says what was looked at. A root
    with a backward error above 1e-6 decides nothing.
    """

    eigenvalues: Known = field(repr=False)
    region: Rectangle | Disc | None  # None is the whole plane
    count: int | None  # None if the number could not be settled
    verdict: str | None
    criterion: str
    others: Known = field(default=(), repr=False)  # found, counted and judged beside the lowest
    growth_limit: float | None = None  # 1/s: of a band faster growth was not looked for
    outside: tuple[complex, ...] | None = None  # what grows outside the region, if known or seen
    notes: tuple[str, ...] = ()
    judged_by: Statement | None = None  # what the referee says of all roots, None if not asked
    doubts: tuple[str, ...] = ()  # why a root of the region may be missing, or one too many

    @property
    def every(self) -> Known:
        """All roots that were found and counted."""
        return self.eigenvalues + self.others

    @property
    def certified(self) -> bool:
        """True if the referee proves the list; where it was not asked, if the count says that no
        root of the region is missing, and each one solves the equations."""
        if self.doubts:
            return False
        if self.judged_by is not None:
            return self.judged_by.status == "proved"
        return self.count == len(self.every) and all(e.residual <= ACCEPTED for e in self.every)

    @property
    def statement(self) -> Statement:
        """What is known of the list."""
        return self.judged_by or counted(self.certified)

    def lowest(self, modes: int | None) -> SystemRoots:
        """The first of them, which the count still proves to be the first."""
        return replace(self, eigenvalues=self.eigenvalues[:modes], others=self.eigenvalues[modes:])


def system_roots(
    system: TermSystem,
    wanted: Wanted | None = None,
    changes: Changes | None = None,
    bounded: Callable[[Known], Known] = tuple,
    data: Data | None = None,
) -> SystemRoots:
    """The roots of a system at its parameters, some of them changed.

    Up to 400 rows all roots are computed and the wanted ones picked; of a larger system those of
    the band or region, or the lowest.
    `bounded` gives roots the error of a reduction or of the digits of data; those whose error
    reaches over an end of the region are listed. With what is assumed of the `data` the referee is
    asked of all roots of a small system. Raises InputError and ComputationError.
    """
    wanted = wanted or Wanted()
    if is_small(system):
        roots = _of_all(system.arrays(changes), wanted, bounded, data)
        return roots if wanted.modes is None else roots.lowest(wanted.modes)
    if system.follows:
        return _at_own_frequencies(system, wanted, changes or {})
    problem, limit, modes = ScaledSystem(system).at(changes), None, wanted.modes
    if wanted.rectangle is None:
        modes = modes or MODES
    try:
        if wanted.rectangle is None:
            solution = lowest_modes(problem, modes or MODES)
        else:
            solution = modes_in(problem, _searched(wanted.rectangle, bounded))
            limit = None if wanted.band is None else wanted.rectangle.high_real
    except ComputationError:
        if system.n > SOLVER.dense:
            raise
        return _of_all(system.arrays(changes), replace(wanted, modes=modes), bounded).lowest(modes)
    values, count = solution.eigenvalues, solution.count
    if wanted.rectangle is None:
        values, count = _upper(values, count, problem.real)
    values = bounded(values)
    region: Any = solution.region
    doubts: tuple[str, ...] = ()
    outside = None
    if wanted.rectangle is not None:
        region = wanted.rectangle
        beyond = sum(not region.contains(np.array(e.value)) for e in values)
        count = None if count is None else count - beyond
        doubts = _doubts_at_ends(values, region)
        # errors of roots that were not looked at are like those of the upper ones
        upper = [e for e in values if e.value.imag > region.high_imag / 2]
        farthest = max((e.error or 0.0 for e in upper), default=0.0)
        if farthest > ROUGH * region.high_imag:
            doubts += (f"errors reach up to {farthest / math.tau:.2g} Hz over the ends",)
        values = tuple(e for e in values if _may_lie_in(e, region))
        outside = _beside(solution.seen, region)
    words = judged(values, complete=False)
    known = values, region, count
    roots = SystemRoots(*known, *words, growth_limit=limit, outside=outside, doubts=doubts)
    return roots if modes is None else roots.lowest(modes)


def _searched(region: Rectangle, bounded: Callable[[Known], Known]) -> Rectangle:
    """The region with what lies closely beyond its ends in frequency, where roots have an error."""
    if bounded is tuple:
        return region
    low = region.low_imag
    return replace(
        region,
        low_imag=low * (1 - ROUGH) if low > 0.0 else low,
        high_imag=region.high_imag * (1 + ROUGH),
    )


def _may_lie_in(root: Eigenvalue, region: Rectangle) -> bool:
    """True if a root lies in a region, or no further from it than its error.

    Of a root that is known to a tenth of the region only, where it was computed decides.
    """
    error = root.error or 0.0
    if error > LOOSE * region.high_imag or (region.low_imag >= 0.0 and root.value.imag < 0.0):
        error = 0.0
    wide = Rectangle(
        region.low_real - error,
        region.high_real + error,
        region.low_imag - (error if region.low_imag > 0.0 else 0.0),  # else its mirror image does
        region.high_imag + error,
    )
    return bool(wide.contains(np.array(root.value)))


def _doubts_at_ends(roots: Known, region: Rectangle) -> tuple[str, ...]:
    """Which roots may lie on either side of an end of a region, by their errors, in words."""
    doubts = []
    for root in roots:
        error = root.error or 0.0
        real, imag = root.value.real, root.value.imag
        ends = [real - region.low_real, real - region.high_real, imag - region.high_imag]
        if region.low_imag > 0.0:
            ends.append(imag - region.low_imag)
        if _may_lie_in(root, region) and min(map(abs, ends)) <= error:
            hertz, known_to = root.frequency_hz, error / math.tau
            doubts.append(
                f"the root at {hertz:.6g} Hz, known to {known_to:.2g} Hz, may lie within or not"
            )
    return tuple(doubts)


def _beside(seen: Sequence[complex], region: Rectangle) -> tuple[complex, ...] | None:
    """What grows outside a region by more than rough roots may be off, the fastest first; one root
    may have been seen several times."""
    wide, found = region.widened(ROUGH), list[complex]()
    for z in sorted(seen, key=lambda z: -z.real):
        off = ROUGH * abs(z)
        new = z.real > off and z.imag >= -off and not wide.contains(np.array(z))
        if new and all(abs(z - other) > off for other in found):
            found.append(z)
    return tuple(found) or None


def _at_own_frequencies(system: TermSystem, wanted: Wanted, changes: Changes) -> SystemRoots:
    """The roots of a band of matrices that depend on the frequency of each; nothing counts them."""
    reduction = reduced_for(system, wanted, [changes])
    values, unsure = modes_at_own_frequencies(reduction, changes)
    frozen = len(frequencies(system, reduction.region))
    note = f"each root at its own frequency, found from matrices frozen at {frozen} frequencies"
    if unsure:
        note += f"; {unsure} of {len(values)} roots were met from one side only"
    limit = None if wanted.band is None else reduction.region.high_real
    words = judged(values, complete=False)
    region = wanted.rectangle
    roots = SystemRoots(values, region, None, *words, growth_limit=limit, notes=(note,))
    return roots if wanted.modes is None else roots.lowest(wanted.modes)


def judged(
    values: Known, complete: bool = True, conservative: bool = False
) -> tuple[str | None, str]:
    """Verdict on roots and what decided it; unless they are `complete` only growth is proven.

    It is open where rounding leaves a root on either side of the axis. A conservative system has
    roots on it, and others in fours, so that what rounding leaves there is marginal.
    """
    solved = [e for e in values if e.residual <= ACCEPTED and e.rounding < math.inf]
    if not solved:
        return None, f"{NO_ROOT} was found that solves the equations"
    verdict = decide([e.value for e in solved], [e.rounding for e in solved])
    if verdict.verdict in GROWING:
        return verdict.verdict, str(verdict)
    if complete and len(solved) == len(values):
        unsure = [e for e in solved if 0.0 < abs(e.value.real) <= e.rounding]
        if not unsure or conservative:
            return verdict.verdict, str(verdict)
        one = max(unsure, key=lambda e: e.rounding)
        words = f"a root at {one.frequency_hz:.6g} Hz on either side of the axis"
        return None, f"{OPEN}rounding ({one.rounding:.2g} 1/s) leaves {words}"
    rate = f"largest Re lambda = {verdict.value:.6g}"
    return None, f"none of {len(solved)} roots grows: {rate}; the others are not known"


def _of_all(
    matrices: tuple[Matrix, Matrix | None, Matrix],
    wanted: Wanted,
    bounded: Callable[[Known], Known],
    data: Data | None = None,
) -> SystemRoots:
    """All roots of a small system, those of the band or region, or the upper ones."""
    M, C, K = matrices
    problem = quadratic(M, C, K)
    words: tuple[str | None, str] | None = None
    if problem.real:
        with suppress(InputError):  # M is singular or not symmetric: the pencil is solved
            reduced = reduce(M, C, K)
            roots = roots_of(reduced)
            if not hidden(reduced, C, K, roots):
                every = spectrum_of(reduced, roots).eigenvalues
                words = judged(every, conservative=form_of([checked(M, C, K)]) != "damped")
    if words is None:
        try:
            every = dense_spectrum(M, C, K)
        except SingularTogetherError as error:
            every = exact_spectrum(M, C, K, error)
        if not all(e.value for e in every) and np.linalg.cond(unit_diagonal(K)) < 1e8:
            raise ComputationError(f"no eigenvalue can be given: {STIFF}")
    if bounded is not tuple:
        every = bounded(every)
        sure = tuple(e for e in every if e.rounding < math.inf)
        words = judged(sure, complete=not any(e.open for e in sure))
    statement: Statement | None = None
    if data is not None:
        deciding = every if problem.real else _upper(every, None, False)[0]
        every, words, statement = refereed(matrices, every, words or judged(deciding), data)
    proved = statement is not None and statement.status == "proved"
    known = np.array([e.value for e in every], dtype=complex)
    farthest, region = float(np.max(np.abs(known), initial=0.0)), wanted.rectangle
    upper, _ = _upper(every, None, problem.real)
    # of complex matrices those of falling motion mean nothing
    values = every if problem.real else upper
    words = words or judged(values)
    if region is None:
        count: int | None
        if proved:
            count = len(every)
        else:
            sizes = np.linalg.svd(unit_diagonal(problem.M.toarray()), compute_uv=False)
            count = 2 * problem.n  # the degree of det P
            if rank_of(sizes) < problem.n:
                count = count_roots(problem, Disc(2 * max(farthest, problem.rate)), known)
        if wanted.modes is not None or not problem.real:
            values, count = _upper(every, count, problem.real)
        notes = () if every else (NO_MOTION,)
        return SystemRoots(values, None, count, *words, notes=notes, judged_by=statement)
    if wanted.band is not None:  # with all real parts that occur in it
        reals = [abs(z.real) for z in known if region.low_imag < z.imag < region.high_imag]
        wide = max(1.1 * max(reals, default=0.0), region.high_real)
        region = replace(region, low_real=-wide, high_real=wide)
    inside = tuple(e for e in values if _may_lie_in(e, region))
    doubts = _doubts_at_ends(inside, region)
    outside = [m.root for m in growing(e for e in values if e not in inside)]
    disc = disc_around(region, known, 2 * farthest)
    # all roots of the disc are in the list, or it is not known where the others are
    complete = proved or count_roots(problem, disc, known) == int(np.sum(disc.contains(known)))
    count = int(np.sum(region.contains(known))) if complete else None
    # all roots are known: where none of the region grows the verdict is of all, unless one grows
    # elsewhere
    own = judged(inside, complete=False)
    words = own if own[0] is not None or outside else words
    return SystemRoots(
        inside,
        region,
        count,
        *words,
        outside=tuple(outside),
        judged_by=statement,
        doubts=doubts,
    )


def _upper(every: Known, count: int | None, real: bool) -> tuple[Known, int | None]:
    """The roots with Im >= 0, of complex matrices some below by rounding, and how many there are if
    `count` is that of all and as many lie below as were found there."""
    upper = tuple(e for e in every if e.value.imag >= (0.0 if real else -e.rounding))
    return upper, None if count is None else count - len(every) + len(upper)


def verdict_of(roots: NDArray[np.complex128], rounding: NDArray[np.float64]) -> str:
    """Verdict on roots that rounding may move so far."""
    return decide(roots, rounding).verdict if rounding.size else NO_ROOT


def rounding_of(system: TermSystem, roots: NDArray[np.complex128]) -> NDArray[np.float64]:
    """How far rounding may move roots of a system that were computed without vectors."""
    return assumed_rounding(roots, undamped=system.real and not system.C)


def _sweep_region(scaled: ScaledSystem, wanted: Wanted, changes: Changes) -> Rectangle:
    """The region of a sweep: what is wanted, or that of the lowest modes at one value."""
    if wanted.rectangle is not None:
        return wanted.rectangle
    if scaled.system.follows or wanted.modes is None:
        raise InputError(NO_BAND)
    if is_small(scaled.system):
        roots = roots_of_all(scaled.system, Wanted(), changes)
        sizes = np.sort(np.abs(roots[roots.imag >= 0.0]))
        radius = float(sizes[: wanted.modes][-1])
    else:
        radius = lowest_modes(scaled.at(changes), wanted.modes, certify=False).region.radius
    far = 1.2 * radius or 1.0
    return Rectangle(-far / 4, far / 4, -1e-6 * far, far)


def looked_at(look: FirstLook, wanted: Wanted, changes: Changes) -> SystemRoots:
    """The wanted roots at some parameters as a first look has them: nothing counts them."""
    found, none = look.judged(changes), np.empty(0, dtype=complex)
    errors = np.maximum(found.errors, rounding_of(look.scaled.system, found.values))
    each = zip(found.values.tolist(), found.residuals.tolist(), errors.tolist(), strict=True)
    rows = [Eigenvalue(z, none, none, r, math.nan, error) for z, r, error in each]
    values = tuple(rows[k] for k in ordered(found.values))
    limit = None if wanted.band is None else look.region.high_real
    words = judged(values, complete=False)
    outside = _beside(found.seen.tolist(), look.region)
    roots = SystemRoots(values, look.region, None, *words, growth_limit=limit, outside=outside)
    return roots if wanted.modes is None else roots.lowest(wanted.modes)


def reduced_for(
    system: TermSystem, wanted: Wanted, values: Sequence[Changes], method: str = "reduced"
) -> Reduction:
    """The reduced system that serves some values of the parameters.

    Warns if the full problem is not met to the tolerance, or if real modes may lose roots, so that
    the full problem is solved at each value.
    """
    scaled, text = ScaledSystem(system), ""
    reduction: Reduction
    region = _sweep_region(scaled, wanted, values[len(values) // 2])
    if system.follows:
        each = frequencies(system, region).tolist()
        values = [{**at, **system.frequency(omega)} for at in values for omega in each]
        method = "reduced"  # a first look corrects the roots of constant matrices
    if method == "modal":
        with one_thread():
            reduction = look = FirstLook(scaled, region, values).made()
        if not look.holds:
            text = (
                f"real modes up to {look.reach / math.tau:.4g} Hz and their corrections may "
                f"lose roots of the band (what they lack contracts by {look.contraction:.2g} "
                "only); each value is solved on the full system"
            )
    else:
        reduction = reduce_system(scaled, region, values)
        if not reduction.converged:
            text = (
                f"{len(reduction.samples)} full solutions do not suffice for the reduced system: a "
                f"root has a residual of {reduction.worst:.2g} in the full problem, {TOLERANCE:g} "
                "is wanted; a narrower band or range is required"
            )
    if text:
        warnings.warn(text, InputWarning, stacklevel=3)
    return reduction


def basis_of(reduction: Reduction | None, wanted: Wanted) -> dict[str, Any] | None:
    """A reduced system as JSON holds it."""
    if reduction is None:
        return None
    return picked(reduction, "method size converged spurious") | {
        "rows": reduction.scaled.n,
        "samples": [dict(changes) for changes in reduction.samples],
        "residual": reduction.worst,
        "contraction": getattr(reduction, "contraction", None),
        "real_modes_hz": getattr(reduction, "reach", 0.0) / math.tau or None,
        "growth_limit": None if wanted.band is None else reduction.region.high_real,
    }


def roots_of_all(system: TermSystem, wanted: Wanted, changes: Changes) -> NDArray[np.complex128]:
    """The roots of a small system in the band or region, by rising frequency, values alone."""
    roots = dense_values(*system.arrays(changes))
    if not system.real:  # rounding may put a real one below
        roots = np.where(np.abs(roots.imag) <= assumed_rounding(roots, True), roots.real, roots)
        roots = roots[roots.imag >= 0.0]
    if wanted.band is not None:  # of any real part
        low, high = (2 * np.pi * f for f in wanted.band)
        roots = roots[(roots.imag >= low) & (roots.imag <= high)]
    elif wanted.region is not None:
        roots = roots[wanted.region.contains(roots)]
    return np.asarray(roots[ordered(roots)])
