"""The two real modes behind a growing one, and what would stop it: separation, or damping.

Separation adds (w^2 - w_2^2) M x x' M to K, which raises the upper mode alone to w; damping adds
2 zeta w M x x' M to C. Both are U U' with few columns, and have to do at the present value of the
parameter and at some below. More than `DENSE_ROWS` rows are searched on a basis of their modes, and
what is named is computed on the full system, with a row more for each column of U.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.processes import one_thread
from squeal.linear import UnstableMode
from squeal.linear.damping import bordered, structure_stiffness
from squeal.linear.matrices import Array, Matrix, dense, divisor, is_sparse
from squeal.linear.real_modes import real_modes
from squeal.linear.system import SystemMatrices
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.energy import pad_terms
from squeal.queries.mode_paths import Paths, is_growing
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.remedies import rounded
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sources import PadSource, SystemSource
from squeal.sparse.dense import dense_values
from squeal.sparse.factor import factorise

DENSE_ROWS = 40  # up to which all roots are computed for each change
NEAR = 12  # real modes around a growing one
ROOTS = 40  # whose vectors make a basis
PARTNER = 0.02  # of the energy of the leading real mode: what a second one has at least
NOTHING = 1e-7  # of |lambda|: growth that two undamped modes may have by rounding
LEAST = 2.0**-17  # of the frequency, or of critical damping: the first change that is tried
MOST = 0.25  # and the last one
BISECTIONS = 10
BELOW = 6  # values of the parameter below the present one
RETRIES = 4  # of what the full system does not confirm, each time 5 % more


class Cure(Enum):
    """What is done to two modes."""

    APART = "further apart"
    BOTH = "both damped"
    LOWER = "the lower one damped"
    UPPER = "the upper one damped"


DAMPED = {Cure.BOTH: (1.0, 1.0), Cure.LOWER: (1.0, 0.0), Cure.UPPER: (0.0, 1.0)}


@dataclass(frozen=True, eq=False)
class Meeting:
    """Two real modes that feed a growing one, and the least changes that stop it; of more than
    `DENSE_ROWS` rows they may be 5 % larger than the least.

    Attributes
    ----------
    omega : array (2,)
        Their angular frequencies without friction and damping, rising, rad/s.
    forces : array (n, 2)
        M x of both, with x' M x = 1.
    cures : mapping
        What stops the mode: of `APART` how much further apart the two must be, Hz; of the others
        how much more damping is needed, as a share of critical damping. What needs more than
        `MOST` is missing.
    worst : tuple of float
        Values of the parameter below the present one that need more of a cure than that.
    """

    omega: Array
    forces: Array
    cures: Mapping[Cure, float]
    worst: tuple[float, ...] = ()

    @property
    def hertz(self) -> tuple[float, float]:
        """Their frequencies without friction and damping."""
        lower, upper = (self.omega / math.tau).tolist()
        return lower, upper

    def needs(self, cure: Cure) -> float:
        """How much of a cure is needed, infinite where it does not stop the mode."""
        return self.cures.get(cure, math.inf)

    @property
    def alone(self) -> Cure:
        """Which of the two modes needs less damping alone."""
        return min((Cure.LOWER, Cure.UPPER), key=self.needs)

    def columns(self, cure: Cure, amount: float) -> Array:
        """U (n, 2), so that U U' added to K or C is a cure of some amount."""
        if cure is Cure.APART:
            raised = self.omega[1] + math.tau * amount
            added = np.array([0.0, raised**2 - self.omega[1] ** 2])
        else:
            added = 2.0 * amount * self.omega * DAMPED[cure]
        return self.forces * np.sqrt(added)


def find_meetings(
    spectrum: Eigenvalues, options: Mapping[str, object], paths: Paths | None = None
) -> dict[int, Meeting]:
    """The two real modes behind each growing mode, by its number, with what stops it.

    Empty where matrices are complex or follow the frequency. A mode that grows with one real mode
    alone is left out.

    Parameters
    ----------
    spectrum : Eigenvalues
        Roots with vectors.
    options : mapping
        Of `eigenvalues`, with which the full system is solved.
    paths : Paths, optional
        Of these modes: what stops a mode does so at some values below the present one too.
    """
    meetings: dict[int, Meeting] = {}
    with suppress(InputError, ComputationError), one_thread():
        problem = _Problem(spectrum)
        for mode in spectrum.unstable:
            pair = problem.pair_of(mode)
            number_of_mode = spectrum.mode_of(mode)
            if pair is not None and number_of_mode is not None:
                meetings[number_of_mode] = problem.cured(
                    pair, _below(spectrum, number_of_mode, paths)
                )
        if problem.is_reduced:
            meetings = _confirmed(spectrum, meetings, options)
    return meetings


def _below(spectrum: Eigenvalues, mode: int, paths: Paths | None) -> dict[float, bool]:
    """Values of a path below the present one, that of the least damping ratio among them, and
    whether the mode grows there."""
    if paths is None or mode not in paths.at:
        return {}
    below = paths.at[mode] < spectrum.value
    values = paths.at[mode][below]
    if not values.size:
        return {}
    roots = paths.roots[mode][below]
    chosen = {*np.linspace(0, len(values) - 1, BELOW).astype(int).tolist()}
    chosen.add(int(np.argmax(roots.real / abs(roots))))
    growing = is_growing(roots)
    return {float(values[k]): bool(growing[k]) for k in sorted(chosen)}


class _Problem:
    """Matrices at the own parameter, and the structure without friction."""

    def __init__(self, spectrum: Eigenvalues) -> None:
        self.spectrum = spectrum
        source = spectrum.source
        assert source is not None
        if isinstance(source, PadSource):
            assert source.analysis is not None
            M, C, K = source.analysis.matrices
            self.matrices: SystemMatrices = (M, C, K)
            terms = pad_terms(source.scene, source.analysis)
            self.structure: Matrix = sum(term.matrix for term in terms if term.role == "stiffness")
        else:
            system = source.file.system
            if system.follows or not system.real:
                raise InputError("the matrices are complex, or follow the frequency")
            self.matrices = system.at()
            self.structure, _ = structure_stiffness(system)
        self.is_reduced = self.structure.shape[0] > DENSE_ROWS

    def matrices_at(self, value: float) -> SystemMatrices:
        """The matrices at another value of the parameter."""
        source = self.spectrum.source
        if isinstance(source, PadSource):
            M, C, K = analyse(source.scene.replace(mu=value)).matrices
            return M, C, K
        assert source is not None
        return source.file.system.at({self.spectrum.parameter: value})

    def pair_of(self, mode: UnstableMode) -> Meeting | None:
        """The two real modes with the largest shares of a growing one, None if there is one."""
        M = self.matrices[0]
        if not mode.frequency_hz or M.shape[0] < 2:
            return None
        omega, shapes = _modes_near(self.structure, M, mode.root.imag)
        forces = M @ shapes
        nearest = int(abs(self.spectrum.values - mode.root).argmin())
        shares = abs(forces.T @ self.spectrum.eigenvalues[nearest].right) ** 2
        pair = np.sort(np.argsort(-shares)[:2])
        if shares[pair].min() < PARTNER * shares[pair].max():
            return None
        return Meeting(omega[pair], forces[:, pair], {})

    def cured(self, pair: Meeting, below: Mapping[float, bool]) -> Meeting:
        """Two modes with the least change of each kind after which one mode less grows, at the
        present value and at those below at which the mode grows."""
        basis = self._basis(pair)

        def unit_of(cure: Cure) -> float:
            return pair.hertz[1] if cure is Cure.APART else 1.0

        def growing(matrices: SystemMatrices, cure: Cure, share: float) -> int:
            M, C, K = matrices
            U = pair.columns(cure, share * unit_of(cure))
            added = basis.T @ U @ U.T @ basis
            damping = 0.0 * added if C is None else basis.T @ (C @ basis)
            stiffness = basis.T @ (K @ basis)
            if cure is Cure.APART:
                stiffness = stiffness + added
            else:
                damping = damping + added
            roots = dense_values(basis.T @ (M @ basis), damping, stiffness)
            return int(np.sum((roots.imag > 0.0) & (roots.real > NOTHING * abs(roots))))

        def least(matrices: SystemMatrices, cure: Cure, start: float, most: int) -> float:
            """The least share from a start on with which no more than `most` grow."""
            low = high = start
            while growing(matrices, cure, high) > most:
                if high >= MOST:
                    return math.inf
                low = high
                high = min(max(2.0 * high, LEAST), MOST)
            for _ in range(BISECTIONS * (high > start)):
                middle = (low + high) / 2.0
                if growing(matrices, cure, middle) > most:
                    low = middle
                else:
                    high = middle
            return high

        at_values = [(self.spectrum.value, self.matrices, True)]
        for value, grows in below.items():
            with suppress(InputError, ComputationError, ArithmeticError):  # none slides there
                at_values.append((value, self.matrices_at(value), grows))
        most = []
        for _, matrices, grows in at_values:
            most.append(max(growing(matrices, Cure.BOTH, 0.0) - grows, 0))
        cures = {}
        worst = set()
        for cure in Cure:
            share = 0.0
            for (value, matrices, _), left in zip(at_values, most, strict=True):
                more = math.inf if share == math.inf else least(matrices, cure, share, left)
                if share and share < more < math.inf:
                    worst.add(value)
                share = max(share, more)
            if share < math.inf:
                cures[cure] = float(rounded(share * unit_of(cure), 2, math.ceil))
        return replace(pair, cures=cures, worst=tuple(sorted(worst)))

    def _basis(self, pair: Meeting) -> Array:
        """Orthonormal columns (n, k) that hold the two modes and those around; all of few rows."""
        n = len(pair.forces)
        if not self.is_reduced:
            return np.eye(n)
        distances = abs(self.spectrum.values - 1j * pair.omega.mean())
        vectors = []
        for k in np.argsort(distances)[:ROOTS].tolist():
            root = self.spectrum.eigenvalues[k]
            vectors += [root.right, root.left]
        shapes = np.array([vector for vector in vectors if len(vector)]).T
        M = self.matrices[0]
        _, modes = _modes_near(self.structure, M, float(pair.omega.mean()))
        columns = np.hstack([shapes.real, shapes.imag, modes])
        left, sizes, _ = np.linalg.svd(
            columns / divisor(np.linalg.norm(columns, axis=0)), full_matrices=False
        )
        return left[:, sizes > NOTHING * sizes[0]]


def _modes_near(K: Matrix, M: Matrix, omega: float) -> tuple[Array, Array]:
    """The real modes nearest to an angular frequency: omega (k,) rising, and shapes (n, k)."""
    n = K.shape[0]
    if not is_sparse(K):
        return real_modes(K, dense(M), n, None)
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

    shift = omega**2
    try:
        inverse = LinearOperator(
            (n, n), matvec=factorise((K - shift * M).tocsc()).solve, dtype=float
        )
        start = np.random.default_rng(0).standard_normal(n)
        squares, shapes = eigsh(K, NEAR, M, shift, OPinv=inverse, v0=start)
    except (ArpackError, ArithmeticError, RuntimeError) as error:
        raise ComputationError(f"real modes near {omega / math.tau:g} Hz: {error}") from None
    order = np.argsort(squares)
    return np.sqrt(np.maximum(squares[order], 0.0)), shapes[:, order]


def _confirmed(
    spectrum: Eigenvalues, meetings: Mapping[int, Meeting], options: Mapping[str, object]
) -> dict[int, Meeting]:
    """Cures that the full system confirms, each kind for all modes at once; the damping of one mode
    alone with that of the others.

    A cure that stops fewer modes than it should is enlarged, and left out in the end.
    """
    confirmed = dict(meetings)
    for cures in ([Cure.APART], [Cure.BOTH], [Cure.LOWER, Cure.UPPER]):
        tried: dict[int, Cure] = {}
        for mode, meeting in meetings.items():
            least = min(cures, key=meeting.needs)
            if least in meeting.cures:
                tried[mode] = least
        amounts = _confirmed_amounts(spectrum, meetings, tried, options)
        for mode, meeting in confirmed.items():
            others = {cure: amount for cure, amount in meeting.cures.items() if cure not in cures}
            if mode in amounts:
                others[tried[mode]] = amounts[mode]
            confirmed[mode] = replace(meeting, cures=others)
    return confirmed


def _confirmed_amounts(
    spectrum: Eigenvalues,
    meetings: Mapping[int, Meeting],
    tried: Mapping[int, Cure],
    options: Mapping[str, object],
) -> dict[int, float]:
    """How much of the cures stops all modes that they are for, by the number of the mode; empty if
    they do not."""
    source = spectrum.source
    assert isinstance(source, SystemSource)
    if not tried:
        return {}
    of_stiffness = Cure.APART in tried.values()
    left = len(spectrum.unstable) - len(tried)
    factors = dict.fromkeys(tried, 1.0)
    values = {value for mode in tried for value in meetings[mode].worst}
    for _ in range(RETRIES):
        amounts = {}
        columns = []
        for mode, cure in tried.items():
            amount = factors[mode] * meetings[mode].cures[cure]
            amounts[mode] = float(rounded(amount, 2, math.ceil))
            columns.append(meetings[mode].columns(cure, amounts[mode]))
        changed = bordered(source.file.system, np.hstack(columns), of_stiffness)
        unstable = eigenvalues(changed, **options).unstable  # type: ignore[arg-type]
        for value in values:
            if len(unstable) <= left:
                computed = eigenvalues(changed.replace({changed.parameter: value}), **options)  # type: ignore[arg-type]
                unstable = computed.unstable
        if len(unstable) <= left:
            return amounts
        for growing in unstable:  # more for the pair that is nearest
            omega = growing.root.imag
            nearest = min(tried, key=lambda mode: abs(meetings[mode].omega.mean() - omega))
            factors[nearest] += 0.05
    return {}
