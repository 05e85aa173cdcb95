"""What the referee (`squeal.proof`) proves of all roots of a small system, and how that changes the
roots, the verdict and the statement of an answer.

The referee encloses all roots in pieces: unions of discs that hold exactly as many roots as they
have discs, with bounds of the real parts. Its proof of a list is proved, open or refuted.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, InputWarning, MatrixError
from squeal.io.writing import JsonObject
from squeal.linear.eigen import Eigenvalue, growth_of, values_of
from squeal.linear.matrices import MCK, Array, Matrix, SingularTogetherError, dense_matrices
from squeal.linear.roots import ComplexArray
from squeal.linear.verdicts import is_undamped
from squeal.proof import AS_GIVEN, HALF_ULP
from squeal.results.columns import OPEN

if TYPE_CHECKING:
    from squeal.proof.balls import Quadratic
    from squeal.proof.pieces import Piece
    from squeal.proof.referee import Proof

NO_MOTION = "no motion satisfies the equations, so that none grows"
PRINTED = 1e-6
"""An error beyond this share of a real or an imaginary part shows in the digits of a table."""
NO_BOUND = "of the growth rates no bound is proved"
EigenvalueTuple = tuple[Eigenvalue, ...]
BY_REFEREE = "roots of the referee"  # the criterion of a verdict on roots that it encloses
VerdictAndCriterion = tuple[str | None, str]
"""The verdict, None where it is open, and what decided it or why it is open, in words."""


def as_complex(where: complex | float | None) -> complex | None:
    """The root, or the value of the parameter, at which a proof is open; None if it names none."""
    return None if where is None else complex(where)


@dataclass(frozen=True, eq=False)
class Data:
    """How precisely the entries of M, C and K are known.

    Attributes
    ----------
    precision : str
        In words. Without radii the referee takes the errors from it: `HALF_ULP` (half a
        unit in the last place of a double), or a number of digits such as "12 digits".
    radii : tuple of 3 array (n, n), or None
        How far the entries of M, C and K may be off, in addition to half a unit in the last place
        of a double. None: as `precision` says.
    keeps_symmetry : bool
        Whether M and K, if they are symmetric, are so in truth: of all entries within the radii
        only symmetric ones are meant.
    keeps_skew : bool
        The same of a skew C.
    """

    precision: str = HALF_ULP
    radii: tuple[Array, ...] | None = None
    keeps_symmetry: bool = True
    keeps_skew: bool = True

    @property
    def is_half_ulp(self) -> bool:
        """Whether the entries are known to all digits of a double, or are sums of such entries."""
        return self.precision == HALF_ULP

    def around(self, M: NDArray, C: NDArray | None, K: NDArray) -> Quadratic:
        """The system in ball arithmetic: each entry is an interval of all values it may have.

        Raises ValueError where an entry is no double.
        """
        from squeal.proof.balls import Balls, Quadratic  # scenes start without it

        if self.radii is None:
            return Quadratic.of(M, C, K, self.precision)
        system = Quadratic.of(M, C, K, HALF_ULP)  # to which the radii are added
        mass, damping, stiffness = map(Balls.widened, system.parts, self.radii)
        return replace(
            system,
            M=mass,
            C=damping,
            K=stiffness,
            data=self.precision,
            symmetric=system.symmetric and self.keeps_symmetry,
            skew=system.skew and self.keeps_skew,
        )


@dataclass(frozen=True)
class Statement:
    """What is known of the completeness of a list of roots, as JSON holds it under `proof`.

    Attributes
    ----------
    status : {"proved", "counted", "open"}
        Whether the list is proved complete, confirmed by a count, or neither.
    by : {"exact", "enclosure", "count"} or None
        The means: exact arithmetic, enclosures in balls, or a count by the argument principle.
    growth_below : float or None
        No root beside the listed ones grows faster, 1/s; None if that is not known.
    data : str or None
        What is assumed of the entries of the matrices.
    reason : str
        Why it is open.
    where : complex or None
        The root, rad/s, at which it is open.
    """

    status: str
    by: str | None
    growth_below: float | None = None
    data: str | None = None
    reason: str = ""
    where: complex | None = None

    def certifies(self, is_small: bool) -> bool:
        """Whether a list is certified: by a proof, or by a count of a system so large that the
        referee cannot judge it."""
        return self.status == "proved" or (self.status == "counted" and not is_small)

    @property
    def words(self) -> str:
        """The statement in a line below a list."""
        if self.status == "counted":
            return "counted: a count that does not use the list agrees"
        if self.status == "open":
            line = f"{OPEN}{self.reason}"
            if self.where is not None:
                line += f" (near {self.where:.6g} rad/s)"
            if self.by != "count" and self.growth_below is None:
                line += f"; {NO_BOUND}"
            return line
        return self.words_of_proof()

    def words_of_proof(self, extent: str = "") -> str:
        """What is proved, on a range that `extent` states, and of which entries."""
        line = "proved: no other mode grows"
        if self.growth_below:
            line += f" by more than {self.growth_below:.3g} 1/s"
        line += extent
        if self.data == AS_GIVEN:
            line += " (entries as given)"
        elif self.data != HALF_ULP:
            line += f" (entries known to {self.data})"
        return line

    def to_dict(self) -> JsonObject:
        """The statement as JSON holds it."""
        z = self.where
        where = None if z is None else {"real": z.real, "imag": z.imag}
        return vars(self) | {"reason": self.reason or None, "where": where}


NOT_COUNTED = Statement(
    "open", "count", reason="nothing was counted beside a sweep or at own frequencies"
)


class RefereedRoots(NamedTuple):
    """Roots with their proved errors, the verdict on them, and what is proved of the list."""

    roots: EigenvalueTuple
    verdict: VerdictAndCriterion
    statement: Statement


def refereed(
    matrices: MCK, roots: EigenvalueTuple, judged: VerdictAndCriterion, data: Data
) -> RefereedRoots:
    """Let the referee judge all roots of a small system, and take what it proves into the answer.

    The list is replaced by the roots that the referee encloses itself, if it can prove them, in
    four cases:

    - It is refuted.
    - The entries as given refute it in exact arithmetic, though others within half an ulp may not.
      Unless that counts fewer finite roots, or rounding in the solver hid the side of a damped
      root, the verdict and the list stay open.
    - It is proved, but holds a root that the solver failed to solve, or missed by more than printed
      digits.
    - It is open only because its roots cannot be assigned to enclosures, one to one.

    Parameters
    ----------
    matrices : (M, C, K)
        Arrays or sparse matrices (n, n), C may be None.
    roots : tuple of Eigenvalue
        All finite roots as they were computed.
    judged : (str or None, str)
        The verdict on them, and what decided it.
    data : Data
        How precisely the entries of the matrices are known.

    Raises
    ------
    ValueError
        Where an entry is no double.
    """
    from squeal.proof.referee import LAST_DIGITS, NOT_TOLD_APART

    arrays = dense_matrices(*matrices)
    system = data.around(*arrays)
    verdict, _ = judged
    proof = _proof_of(system, roots, verdict)
    # entries that are rounded sums have radii, which may leave a wrong list open. A second proof
    # takes these entries for known to half an ulp: it may refute the list, and has narrower
    # enclosures. It does not prove the list, since the entries are not known so well
    sharpest_proof = proof
    if proof.status == "open" and data.is_half_ulp and data.radii is not None:
        sharpest_proof = _proof_of(Data().around(*arrays), roots, verdict)
    # the entries as given refute the list, others within half an ulp may not
    if data.is_half_ulp and proof.by == "exact" and proof.reason.startswith(LAST_DIGITS):
        number = sum(piece.count for piece in proof.pieces)
        # where M is exactly singular, and rounding in the solver made it regular, too many roots
        # were computed
        if number < len(roots):
            return _with_roots_of_referee(arrays, system, roots, proof, data)
        # a damped root on the axis to rounding: the solver did not know on which side it lies
        if verdict == "marginal" and not is_undamped(*arrays):
            return refereed(matrices, roots, (None, f"{OPEN}{proof.reason}"), data)
        if number == len(roots):
            return _open_with_roots_as_given(arrays, system, roots, judged, proof, data)
    if sharpest_proof.status == "refuted":
        warnings.warn(
            f"the referee refutes the roots that were computed ({sharpest_proof.reason})",
            InputWarning,
            stacklevel=2,
        )
        return _with_roots_of_referee(arrays, system, roots, sharpest_proof, data)
    # the solver failed where the list is proved, but holds a root with a large backward error, or
    # one that is off by more than the digits that tables print
    all_solved = all(root.decides for root in roots)
    some_off = any(map(_is_off, roots, proof.matches))
    solver_failed = proof.status == "proved" and (not all_solved or some_off)
    if solver_failed or sharpest_proof.reason == NOT_TOLD_APART:
        enclosed = _roots_of_pieces(arrays, sharpest_proof.pieces)
        proved = _if_proved(system, enclosed, sharpest_proof, data)
        if proved is not None:
            return proved
    return _with_proof(roots, judged, proof, data)


def _is_off(root: Eigenvalue, match: tuple[Piece, ...]) -> bool:
    """Whether a root may be off by an error that shows in printed digits, and that the enclosures
    themselves do not explain: `match` are the pieces among which the root lies."""
    distance = max(piece.distance_bound(root.value) for piece in match)
    radius = max(float(piece.radii.max()) for piece in match)
    return distance > max(_visible_error(root.value, match), 4 * radius)


def _visible_error(value: complex, match: tuple[Piece, ...]) -> float:
    """The error of a root, rad/s, from which on it shows in digits of the frequency; of a root that
    is proved to be real, in digits of its size."""
    is_real = value.imag == 0.0 and all(piece.real for piece in match)
    return PRINTED * abs(value if is_real else value.imag)


def _if_proved(
    system: Quadratic, enclosed: EigenvalueTuple, proof: Proof, data: Data
) -> RefereedRoots | None:
    """Let the referee judge the centres `enclosed` of its own enclosures as if they were a list.

    The verdict on them is the only one that `proof`, which made the enclosures, leaves possible.
    None unless the referee proves the list and that verdict.
    """
    only_verdict = _only_verdict(proof)
    proof_of_enclosed = _proof_of(system, enclosed, only_verdict)
    if only_verdict is None or proof_of_enclosed.status != "proved":
        return None
    return _with_proof(enclosed, (only_verdict, BY_REFEREE), proof_of_enclosed, data)


def _open_with_roots_as_given(
    matrices: MCK,
    system: Quadratic,
    roots: EigenvalueTuple,
    judged: VerdictAndCriterion,
    refutation: Proof,
    data: Data,
) -> RefereedRoots:
    """Replace a list by the roots of the entries as given, which refute it, and leave it open.

    Their errors and the bound of growth are those of all entries within half an ulp.

    system: the matrices in ball arithmetic, with these entries; roots: the list; judged: its
    verdict, and why; refutation: the proof that refutes it, with enclosures of all roots as given.
    """
    # enclosures of the entries as given know no rounding of these: their roots get that of the list
    largest_rounding = max(root.rounding for root in roots)
    roots_as_given = []
    for root in _roots_of_pieces(matrices, refutation.pieces):
        roots_as_given.append(replace(root, rounding=largest_rounding))
    enclosed = tuple(roots_as_given)
    verdict, _ = judged
    return _with_proof(enclosed, judged, _proof_of(system, enclosed, verdict), data)


def _with_roots_of_referee(
    matrices: MCK, system: Quadratic, refuted: EigenvalueTuple, refutation: Proof, data: Data
) -> RefereedRoots:
    """Replace a refuted list by the centres of the referee's enclosures.

    Where the referee encloses no root, or refutes the new list too, the refuted list is returned
    with an open statement.

    Parameters
    ----------
    matrices : (M, C, K)
        Arrays (n, n), C may be None.
    system : Quadratic
        The same in ball arithmetic.
    refuted : tuple of Eigenvalue
        The list.
    refutation : Proof
        Why it is refuted, and the enclosures of all roots.
    data : Data
        How precisely the entries of the matrices are known.
    """
    verdict: VerdictAndCriterion = (None, f"{OPEN}{refutation.reason}")
    only_verdict = _only_verdict(refutation)
    enclosed = _roots_of_pieces(matrices, refutation.pieces)
    proof = _proof_of(system, enclosed, only_verdict)
    nothing_was_enclosed = not enclosed and proof.status != "proved"  # an empty list may be proved
    if proof.status == "refuted" or nothing_was_enclosed:
        statement = Statement("open", proof.by, data=proof.data, reason=refutation.reason)
        return RefereedRoots(refuted, verdict, statement)
    if only_verdict is not None:
        verdict = (only_verdict, BY_REFEREE)
    return _with_proof(enclosed, verdict, proof, data)


def _proof_of(system: Quadratic, roots: EigenvalueTuple, verdict: str | None) -> Proof:
    """The referee's proof that `roots` are all roots of a system, and that the verdict holds."""
    from squeal.proof.referee import prove_roots  # here, since scenes start without it

    return prove_roots(system, values_of(roots), verdict)


def _with_proof(
    roots: EigenvalueTuple, judged: VerdictAndCriterion, proof: Proof, data: Data
) -> RefereedRoots:
    """Take into an answer what a proof says of roots that it does not refute.

    The verdict and the status of the proof are taken as they are, but for these cases:

    - The proof is open and another verdict is possible: the verdict becomes open.
    - The list is proved and empty: the verdict is the only possible one.
    - The list is proved, its verdict was open because of rounding, the entries have all digits of a
      double and one verdict is possible: this is the verdict.
    - The list is proved and its verdict was open for another reason, such as few digits of the
      data: it stays open, and the statement on the list becomes open too.

    Parameters
    ----------
    roots : tuple of Eigenvalue
        The list; it gets the proved errors and growth rates.
    judged : (str or None, str)
        The verdict on it, and what decided it or why it is open.
    proof : Proof
        Whether the list is proved, and the verdicts that are possible.
    data : Data
        How precisely the entries of the matrices are known.
    """
    from squeal.proof.referee import FREE

    status = proof.status
    reason = proof.reason
    verdict, criterion = judged
    if status == "open" and proof.verdicts and proof.verdicts != {verdict}:
        verdict = None
        criterion = f"{OPEN}{reason}"
    elif status == "proved" and verdict is None:
        only_verdict = _only_verdict(proof)
        if not roots:
            verdict = only_verdict
            criterion = f"{only_verdict}: {NO_MOTION}"
        elif data.is_half_ulp and only_verdict is not None:
            verdict = only_verdict
            criterion = f"{only_verdict}, which is proved although rounding hides it"
        else:
            status = "open"
            reason = criterion.removeprefix(OPEN)
            # a rigid-body motion: its roots are zero within what the data allow
            if any(piece.side == "free" for piece in proof.pieces):
                reason = FREE
    matched_roots = with_proved_bounds(roots, proof.matches)
    growth = proof.growth_below if proof.growth_below < math.inf else None
    statement = Statement(status, proof.by, growth, proof.data, reason, as_complex(proof.where))
    return RefereedRoots(matched_roots, (verdict, criterion), statement)


def _only_verdict(proof: Proof) -> str | None:
    """The only verdict that a proof leaves possible, None if it leaves several or none."""
    if len(proof.verdicts) != 1:
        return None
    return next(iter(proof.verdicts))


def exact_spectrum(
    M: Matrix, C: Matrix | None, K: Matrix, unsure: ComputationError | SingularTogetherError
) -> EigenvalueTuple:
    """Compute all finite roots in exact arithmetic, where rounding hides which of them are zero, or
    whether M, C and K are singular together.

    If they are, det(z^2 M + z C + K) = 0 for every z. In doubles that cannot be told from a
    determinant that merely is small.

    Parameters
    ----------
    M, C, K : arrays or sparse matrices (n, n)
        Their entries are taken as given. C may be None.
    unsure : ComputationError or SingularTogetherError
        What to raise where exact arithmetic fails too.

    Raises
    ------
    MatrixError
        If they are singular together.
    ComputationError, SingularTogetherError
        The error `unsure`, for complex matrices and where exact arithmetic fails.
    """
    from squeal.proof.balls import Quadratic
    from squeal.proof.enclosure import components
    from squeal.proof.exact import SINGULAR, exact_roots
    from squeal.proof.pieces import Failure

    arrays = dense_matrices(M, C, K)
    system = Quadratic.of(*arrays, AS_GIVEN)
    if not system.is_real:
        raise unsure
    pieces: list[Piece] = []
    for rows in components(system.parts):  # groups of rows that nothing couples
        roots_of_component = exact_roots(system.block(rows))
        if isinstance(roots_of_component, Failure):
            if roots_of_component.reason == SINGULAR:
                singular = "M, C and K: are singular together, so that every number is a root"
                raise MatrixError(singular)
            raise unsure
        pieces += roots_of_component
    return _roots_of_pieces(arrays, pieces)


def with_proved_bounds(
    roots: EigenvalueTuple, matches: Sequence[tuple[Piece, ...]]
) -> EigenvalueTuple:
    """Roots moved into what is proved of each, with the rounding, error and sense that this proves.

    Parameters
    ----------
    roots : tuple of m Eigenvalue
        The roots.
    matches : sequence of m tuple of Piece
        The pieces among which each lies; an empty sequence leaves the roots as they are.

    Raises
    ------
    ValueError
        If there are more or fewer matches than roots.
    """
    if not matches:
        return roots
    bounded = []
    for root, match in zip(roots, matches, strict=True):
        bounded.append(_with_bounds_of(root, match))
    return tuple(bounded)


def _with_bounds_of(root: Eigenvalue, match: tuple[Piece, ...]) -> Eigenvalue:
    """A root with the bounds of the pieces among which it lies.

    A piece is a union of discs that holds exactly as many roots as it has discs, with proved bounds
    `low` and `high` of their real parts.

    - Its real part is clipped to their bounds.
    - Its `rounding` is raised to the distance to which it is known, or set to it where it was
      infinite (not known). A distance that shows in printed digits raises its `error` too.
    - Its `proved_sense` says whether it grows or decays, if its rounding hides that and all pieces
      prove it.
    """
    low = min(piece.low for piece in match)
    high = max(piece.high for piece in match)
    growth = min(max(root.value.real, low), high)
    value = complex(growth, root.value.imag)
    distance = max(piece.distance_bound(value) for piece in match)
    growth_error = max(high - growth, growth - low)
    error = root.error
    shows = growth_error > PRINTED * abs(growth) or distance > _visible_error(value, match)
    # a distance up to the least normal double is that of an underflow, at a root of zero
    if shows and distance > sys.float_info.min:
        error = max(root.error or 0.0, distance)
    rounding = distance
    if root.rounding < math.inf:
        rounding = max(root.rounding, distance)
    sense = 0
    # otherwise the root itself shows whether it grows
    if not (root.decides and abs(growth_of(value)) > rounding):
        sides = {piece.side for piece in match}
        sense = int(sides == {"grows"}) - int(sides == {"decays"})
    return replace(root, value=value, rounding=rounding, error=error, proved_sense=sense)


def _roots_of_pieces(matrices: MCK, pieces: Sequence[Piece]) -> EigenvalueTuple:
    """The roots at the centres of the discs of pieces, by rising frequency, with vectors and
    residuals there.

    Their rounding is 0: how far they are off is what is proved of them.
    """
    from squeal.sparse.dense import spectrum_at  # which pads start without
    from squeal.sparse.quadratic import scaled_problem

    roots = spectrum_at(scaled_problem(*matrices), _centres(pieces))
    return tuple(replace(root, rounding=0.0) for root in roots)


def _centres(pieces: Sequence[Piece]) -> ComplexArray:
    """The centres (m,) of pieces: exactly real, or on the imaginary axis, where that is proved."""
    values: list[complex] = []
    for piece in pieces:
        for z in piece.centres.tolist():
            real = z.real
            imag = z.imag
            if piece.side == "axis":
                real = 0.0
            if piece.real:
                imag = 0.0
            values.append(complex(real, imag))
    return np.array(values, dtype=complex)
