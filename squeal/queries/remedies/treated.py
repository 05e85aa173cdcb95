"""A brake whose real modes are separated or damped: what grows, and where stability is lost.

A treatment adds U diag(f) U' to K or to C, where the columns of U are M x of real modes and f are
factors: w_2^2 - w^2 raises a mode from w to w_2, 2 zeta w damps it. All other real modes y of the
structure stay as they are, since y' M x = 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from squeal.errors import InputError
from squeal.linear.damping import bordered, structure_stiffness
from squeal.linear.functions import SystemFunction, matrices_of
from squeal.linear.matrices import MCK, Array, Matrix, dense, divisor
from squeal.linear.roots import ComplexArray
from squeal.linear.system import System
from squeal.linear.terms import Term
from squeal.linear.verdicts import assumed_rounding, is_undamped
from squeal.queries.energy import pad_terms
from squeal.queries.options import Band
from squeal.queries.pads.equilibrium import analyse, branch_system
from squeal.queries.remedies.changes import Brake, Effect, growing_within, loss_of
from squeal.queries.remedies.growing import upper_growing
from squeal.queries.remedies.meetings import Meeting, RealModes
from squeal.queries.systems.all_roots import in_band, is_small
from squeal.queries.thresholds import pad_thresholds
from squeal.results.sources import PadSource, SystemSource
from squeal.results.thresholds import Thresholds
from squeal.sparse.dense import dense_values

DENSE_ROWS = 40  # up to which all roots are computed for each change
ROOTS = 16  # whose vectors make a basis
DEPENDENT = 1e-7  # of the largest singular value: columns that rounding alone tells apart


class Treatment(NamedTuple):
    """The change U diag(factors) U' of K (`of_stiffness`) or of C; factors (k,) of all real modes
    of `TreatedBrake.modes`, in the order of their numbers."""

    of_stiffness: bool
    factors: Array


class Refutation(NamedTuple):
    """Whether something grows with a treatment.

    grows_at: a value of the free parameter at which it does, None if nothing grows; thresholds:
    with the treatment, None where none were searched.
    """

    grows_at: float | None
    thresholds: Thresholds | None


class TreatedBrake:
    """A brake with treatments: what grows, on a basis of few columns, and thresholds in full.

    Call `use_basis_of` before `grows` and `refuted`, and again for other meetings.

    Attributes
    ----------
    modes : RealModes
        Of the structure, behind growing modes.
    is_reduced : bool
        Whether there are more than `DENSE_ROWS` rows, so that `grows` computes on a basis.
    searches_thresholds : bool
        Whether `refuted` searches thresholds: the matrices depend on the free parameter, and its
        range begins below the present value.
    """

    def __init__(self, brake: Brake) -> None:
        """brake: as it is. Raises InputError if its mass is complex, or matrices follow the
        frequency."""
        self.brake = brake
        self.spectrum = brake.spectrum
        source = self.spectrum.source
        assert source is not None
        self.band: Band | None = None
        self.matrices = self._matrices_at(brake.present)
        if isinstance(source, PadSource):
            assert source.analysis is not None
            terms = pad_terms(source.scene, source.analysis)
            structure: Matrix = sum(term.matrix for term in terms if term.role == "stiffness")
        else:
            self.band = source.selection.band
            if np.iscomplexobj(self.matrices[0]):
                raise InputError("the mass is complex")
            structure, _ = structure_stiffness(source.file.system)
        self.modes = RealModes(self.spectrum, self.matrices[0], structure)
        self.is_reduced = structure.shape[0] > DENSE_ROWS
        self.searches_thresholds = brake.losses.low < brake.present and self.spectrum.depends
        self._basis: Array | None = None
        # by the value of the free parameter: M, C and K on the basis, and whether nothing damps
        self._projected: dict[float, tuple[MCK, bool]] = {}
        self._growing_outside: dict[float, int] = {}  # of the band, without treatment

    def use_basis_of(self, meetings: Iterable[Meeting]) -> None:
        """Compute growing roots on a basis for these meetings from now on."""
        self._basis = self._basis_for(meetings)
        self._projected = {}
        self._growing_outside = {}

    def grows(self, value: float, treatment: Treatment) -> bool:
        """Whether something of the band grows at a value of the free parameter, or has only moved
        out of the band: then more grows outside of it than without treatment."""
        roots = self._growing(value, treatment)
        if value not in self._growing_outside:
            untreated = treatment._replace(factors=np.zeros_like(treatment.factors))
            unchanged = self._growing(value, untreated)
            self._growing_outside[value] = len(unchanged) - len(in_band(unchanged, self.band))
        return len(in_band(roots, self.band)) > 0 or len(roots) > self._growing_outside[value]

    def grows_in_full(self, treatment: Treatment) -> bool:
        """Whether something grows at the present value, with the full matrices of many rows; False
        of few rows, where `grows` computes with these."""
        if not self.is_reduced:
            return False
        return bool(self.brake.eigenvalues_of(self._changed(treatment)).unstable)

    def refuted(self, treatment: Treatment, values: Sequence[float]) -> Refutation:
        """Whether something grows with a treatment (real modes separated or damped), and at which
        value of the free parameter.

        `values` are tried first, on the basis. Then thresholds of the full matrices show all values
        from the lower end of the range to the largest of `values`. Where no thresholds are searched
        the full matrices are tried at the present value alone.
        """
        for value in values:
            if self.grows(value, treatment):
                return Refutation(value, None)
        if not self.searches_thresholds:
            grows = self.grows_in_full(treatment)
            return Refutation(self.brake.present if grows else None, None)
        thresholds = self._thresholds(treatment, max(self.brake.high, *values))
        grows_at: float | None = None
        for middle in growing_within(thresholds, max(values)):
            # of few rows `grows` computes with the full matrices: it allows for rounding, which
            # may make undamped modes seem to grow between two thresholds
            if self.is_reduced or self.grows(middle, treatment):
                grows_at = middle  # of several the last one
        return Refutation(grows_at, thresholds)

    def effect(self, treatment: Treatment, thresholds: Thresholds | None) -> Effect:
        """What a treatment does at the present value of the free parameter, and beyond.

        thresholds: those with the treatment, None where none were searched.
        """
        value = self.brake.present
        roots = self.brake.selected_roots(thresholds, self._changed(treatment), value)
        loss = None if thresholds is None else loss_of(thresholds, thresholds.high)
        return Effect(self.spectrum, value, roots, loss)

    def _growing(self, value: float, treatment: Treatment) -> ComplexArray:
        """The growing roots with Im >= 0 of the treated brake on the basis, rad/s.

        value: of the free parameter.
        """
        (M, C, K), nothing_damps = self._untreated(value)
        factors = treatment.factors  # (k,), one for each real mode behind growing modes
        U = np.array(self.modes.forces).T  # (n, k), their columns M x
        if self._basis is not None:
            U = self._basis.T @ U
        change = (U * factors) @ U.T
        if treatment.of_stiffness:
            K = K + change
        elif factors.any():
            C = change if C is None else C + change
            nothing_damps = False
        roots = dense_values(M, C, K)
        return upper_growing(roots, assumed_rounding(roots, nothing_damps))

    def _untreated(self, value: float) -> tuple[MCK, bool]:
        """The matrices at a value of the free parameter, of many rows projected onto the basis, and
        whether nothing damps."""
        if value not in self._projected:
            M, C, K = self._matrices_at(value)
            nothing_damps = is_undamped(M, C, K)
            if C is not None:
                C = self._on_basis(C)
            self._projected[value] = (self._on_basis(M), C, self._on_basis(K)), nothing_damps
        return self._projected[value]

    def _on_basis(self, matrix: Matrix) -> Array:
        """A matrix (n, n) projected onto the basis; itself without one."""
        if self._basis is None:
            return dense(matrix)
        return np.asarray(self._basis.T @ (matrix @ self._basis))

    def _matrices_at(self, value: float) -> MCK:
        """The matrices at a value of the free parameter, without treatment."""
        source = self.spectrum.source
        if isinstance(source, PadSource):
            return analyse(source.scene.replace(mu=value)).matrices
        assert source is not None
        return source.file.system.at({self.spectrum.parameter: value})

    def _columns(self, treatment: Treatment) -> Array:
        """V (n, k) of the change V V' = U diag(factors) U'."""
        return np.array(self.modes.forces).T * np.sqrt(treatment.factors)

    def _changed(self, treatment: Treatment) -> System:
        """The treated system; a treated pad as a system at the present value."""
        if isinstance(self.spectrum.source, SystemSource):
            system: System = self.spectrum.source.file.system
        else:
            system = System(*self.matrices)
        columns = self._columns(treatment)
        if not is_small(system):
            return bordered(system, columns[:, columns.any(axis=0)], treatment.of_stiffness)
        term = Term(columns @ columns.T)
        if treatment.of_stiffness:
            return replace(system, K=(*system.K, term))
        return replace(system, C=(*system.C, term))

    def _thresholds(self, treatment: Treatment, high: float) -> Thresholds:
        """The changes of verdict up to a value, of the treated system or pad."""
        source = self.spectrum.source
        if not isinstance(source, PadSource):
            return self.brake.thresholds_of(self._changed(treatment), high)
        columns = self._columns(treatment)
        unchanged, path = branch_system(source.scene, high)
        change = columns @ columns.T
        zero = np.zeros_like(change)
        if treatment.of_stiffness:
            changed_pad = _ChangedPad(unchanged, to_damping=zero, to_stiffness=change)
        else:
            changed_pad = _ChangedPad(unchanged, to_damping=change, to_stiffness=zero)
        return pad_thresholds(source.scene, high, changed_pad, path, step_ends=())

    def _basis_for(self, meetings: Iterable[Meeting]) -> Array | None:
        """Real orthonormal columns (n, k); None where nothing is reduced.

        They span the shapes of `modes`, and the vectors of the `ROOTS` roots nearest to i w for
        each meeting, w the mean frequency of its real modes.
        """
        if not self.is_reduced:
            return None
        chosen = set()  # indices of roots
        for meeting in meetings:
            omega = float(meeting.omega.mean())
            nearest = np.argsort(abs(self.spectrum.values - 1j * omega))[:ROOTS]
            chosen.update(nearest.tolist())
        blocks = list(self.modes.shapes)  # arrays (n, columns), one a mode
        for k in sorted(chosen):
            root = self.spectrum.eigenvalues[k]
            for vector in (root.right, root.left):
                if len(vector):  # without its vectors a root has empty ones
                    blocks.append(np.array([vector.real, vector.imag]).T)
        columns = np.hstack(blocks)
        unit_columns = columns / divisor(np.linalg.norm(columns, axis=0))
        left, sizes, _ = np.linalg.svd(unit_columns, full_matrices=False)
        return left[:, sizes > DEPENDENT * sizes[0]]


@dataclass(frozen=True, eq=False)
class _ChangedPad:
    """M, C, K of a pad over mu, with the same (3, 3) added to C, and to K, at each mu."""

    unchanged: SystemFunction
    to_damping: Array
    to_stiffness: Array

    def __call__(self, mu: float) -> MCK:
        return self.many([mu])[0]

    def many(self, mus: Sequence[float]) -> list[MCK]:
        """The matrices at each mu, which together take hardly longer than one."""
        changed: list[MCK] = []
        for M, C, K in matrices_of(self.unchanged, mus):
            changed.append((M, C + self.to_damping, K + self.to_stiffness))
        return changed
