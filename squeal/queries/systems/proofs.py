"""What the referee says of all roots of a small system, and what it changes in an answer."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputWarning, MatrixError
from squeal.linear import GROWING
from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import SingularTogetherError, dense
from squeal.linear.roots import ordered
from squeal.linear.system import Matrix
from squeal.results.columns import OPEN

if TYPE_CHECKING:
    from squeal.proof.balls import Quadratic
    from squeal.proof.pieces import Piece
    from squeal.proof.referee import Proof

AS_GIVEN = "as given"
HALF_ULP = "half an ulp"  # is assumed of the entries of arrays and of files with all digits
NO_MOTION = "no motion satisfies the equations, so that none grows"
PRINTED = 1e-6
"""An error beyond this share of |lambda| shows in the digits of a table."""
Known = tuple[Eigenvalue, ...]
FORBIDDEN = 1e300
"""The cost of a pair that must not be formed."""
Arrays = tuple[NDArray, NDArray | None, NDArray]
"""M, C and K (n, n)."""
VerdictAndCriterion = tuple[str | None, str]
"""The verdict, None where it is open, and what decided it or why it is open, in words."""


@dataclass(frozen=True, eq=False)
class Data:
    """How precisely the entries of M, C and K are known.

    words: the same for people; radii: of each of the three an array (n, n), how far an entry may
    lie from the given one beside half a unit in its last place; None if that is all.
    keeps_structure: whether M and K that are symmetric, and C that is skew, remain so within them.
    """

    words: str = HALF_ULP
    radii: tuple[NDArray[np.float64], ...] | None = None
    keeps_structure: bool = True

    @property
    def is_rounded(self) -> bool:
        """Whether the radii are those of the rounding of sums, not of digits."""
        return self.radii is not None and self.words == HALF_ULP

    def around(self, M: NDArray, C: NDArray | None, K: NDArray) -> Quadratic:
        """The system with each entry a ball that holds all values it may have.

        Raises ValueError where an entry is no double.
        """
        from squeal.proof.balls import Balls, Quadratic, upper  # scenes start without it

        if self.radii is None:
            return Quadratic.of(M, C, K, self.words)
        system = Quadratic.of(M, C, K, HALF_ULP)
        balls = []
        for X, radius in zip(system.parts, self.radii, strict=True):
            wider = np.where(radius > 0.0, upper(X.rad + radius, 2), X.rad)
            balls.append(Balls(X.mid, wider))
        mass, damping, stiffness = balls
        return replace(
            system,
            M=mass,
            C=damping,
            K=stiffness,
            data=self.words,
            symmetric=system.symmetric and self.keeps_structure,
            skew=system.skew and self.keeps_structure,
        )


@dataclass(frozen=True)
class Statement:
    """What is known of a list of roots, as JSON holds it under `proof`.

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

    @property
    def words(self) -> str:
        """The statement in a line below a list."""
        if self.status == "counted":
            return "counted: an argument-principle count agrees"
        if self.status == "open":
            where = "" if self.where is None else f" (near {self.where:.6g} rad/s)"
            return f"{OPEN}{self.reason}{where}"
        words = "proved: no other mode grows"
        if self.growth_below:
            words += f" by more than {self.growth_below:.3g} 1/s"
        if self.data == AS_GIVEN:
            words += " (entries as given)"
        elif self.data != HALF_ULP:
            words += f" (entries known to {self.data})"
        return words

    def to_dict(self) -> dict[str, Any]:
        """The statement as JSON holds it."""
        z = self.where
        where = None if z is None else {"real": z.real, "imag": z.imag}
        return vars(self) | {"reason": self.reason or None, "where": where}


NOT_COUNTED = Statement(
    "open", "count", reason="nothing was counted beside a sweep or at own frequencies"
)


def counted(agrees: bool) -> Statement:
    """What a count says where the referee does not apply."""
    if agrees:
        return Statement("counted", "count")
    return Statement("open", "count", reason="no count agrees, others may be missing")


class RefereedRoots(NamedTuple):
    """Roots with their proved errors, the verdict on them, and what is proved of the list."""

    roots: Known
    verdict: VerdictAndCriterion
    statement: Statement


def refereed(
    matrices: tuple[Matrix, Matrix | None, Matrix],
    roots: Known,
    verdict: VerdictAndCriterion,
    data: Data,
) -> RefereedRoots:
    """The roots of a small system as far as the referee confirms them.

    If it refutes them, the roots that it knows itself take their place, if they pass. Roots that
    lie between those that it knows are moved to these, if that proves the list.

    Parameters
    ----------
    matrices : (M, C, K)
        Arrays or sparse matrices (n, n), C may be None.
    roots : tuple of Eigenvalue
        All finite roots as they were computed.
    verdict : (str or None, str)
        The verdict on them, and what decided it.
    data : Data
        How precisely the entries of the matrices are known.

    Raises
    ------
    ValueError
        Where an entry is no double.
    """
    from squeal.proof.referee import NOT_TOLD_APART

    M = dense(matrices[0])
    C = None if matrices[1] is None else dense(matrices[1])
    K = dense(matrices[2])
    system = data.around(M, C, K)
    proof = _proof_of(system, roots, verdict[0])
    refuting = proof
    if proof.status == "open" and data.is_rounded:
        # exact numbers prove nothing of sums that were rounded, but tell a wrong list
        refuting = _proof_of(Data().around(M, C, K), roots, verdict[0])
    if refuting.status == "refuted":
        warnings.warn(
            f"the referee refutes the roots that were computed ({refuting.reason})",
            InputWarning,
            stacklevel=2,
        )
    elif refuting.reason == NOT_TOLD_APART:
        centred = _at_centres(roots, refuting.pieces)
        only_verdict = _only_verdict(refuting)
        centred_proof = _proof_of(system, centred, only_verdict)
        if centred_proof.status != "proved" or only_verdict is None:
            return _as_proved(roots, verdict, proof, data)
        return _as_proved(centred, (only_verdict, "roots of the referee"), centred_proof, data)
    else:
        return _as_proved(roots, verdict, proof, data)
    refuted = (None, f"{OPEN}{refuting.reason}")
    only_verdict = _only_verdict(refuting)
    own_roots = _roots_of_pieces((M, C, K), refuting.pieces)
    proof = _proof_of(system, own_roots, only_verdict)
    is_empty_by_chance = not own_roots and proof.status != "proved"  # nothing was enclosed
    if proof.status == "refuted" or is_empty_by_chance:
        statement = Statement("open", proof.by, None, proof.data, refuting.reason, None)
        return RefereedRoots(roots, refuted, statement)
    if only_verdict is None:
        return _as_proved(own_roots, refuted, proof, data)
    return _as_proved(own_roots, (only_verdict, "roots of the referee"), proof, data)


def _proof_of(system: Quadratic, roots: Known, verdict: str | None) -> Proof:
    """What the referee says of all roots and the verdict on them."""
    from squeal.proof.referee import RootList, prove_roots  # here, since scenes start without it

    values = np.array([e.value for e in roots], dtype=complex)
    shapes = None
    if roots and all(len(e.right) == system.n for e in roots):
        shapes = np.column_stack([e.right for e in roots])
    return prove_roots(system, RootList.of(values, math.inf, verdict, shapes))


def _as_proved(
    roots: Known, verdict: VerdictAndCriterion, proof: Proof, data: Data
) -> RefereedRoots:
    """Roots that are not refuted, with what a proof adds to them, to the verdict and to the list.

    A verdict is open if the proof leaves others. One that was open is what the proof says, unless
    the data have few digits: what is known to these neither grows nor decays.
    """
    from squeal.proof.referee import FREE

    status = proof.status
    reason = proof.reason
    if status == "open" and proof.verdicts and proof.verdicts != {verdict[0]}:
        verdict = (None, f"{OPEN}{reason}")
    elif status == "proved" and verdict[0] is None:
        only_verdict = _only_verdict(proof)
        if not roots:
            verdict = (only_verdict, f"{only_verdict}: {NO_MOTION}")
        elif data.words == HALF_ULP and only_verdict is not None:
            criterion = f"{only_verdict}, which is proved although rounding hides it"
            verdict = (only_verdict, criterion)
        elif any(piece.side == "free" for piece in proof.pieces):
            status = "open"
            reason = FREE
        else:
            status = "open"
            reason = verdict[1].removeprefix(OPEN)
    proved = with_proved_errors(roots, proof.errors)
    if verdict[0] in GROWING:
        proved = with_proved_growth(proved, proof.pieces)
    growth = proof.growth_below if proof.growth_below < math.inf else None
    where = None if proof.where is None else complex(proof.where)
    statement = Statement(status, proof.by, growth, proof.data, reason, where)
    return RefereedRoots(proved, verdict, statement)


def _only_verdict(proof: Proof) -> str | None:
    """The verdict that a proof leaves, None if it leaves several or none."""
    if len(proof.verdicts) != 1:
        return None
    return next(iter(proof.verdicts))


def exact_spectrum(M: Matrix, C: Matrix | None, K: Matrix, unsure: SingularTogetherError) -> Known:
    """All finite roots of matrices that rounding does not tell from singular ones.

    Raises MatrixError if they are singular together, `unsure` where the exact means do not say.
    """
    from squeal.proof.balls import Quadratic
    from squeal.proof.enclosure import components
    from squeal.proof.exact import SINGULAR, exact_roots
    from squeal.proof.pieces import Failure

    damping = None if C is None else dense(C)
    arrays = (dense(M), damping, dense(K))
    system = Quadratic.of(*arrays, AS_GIVEN)
    if not system.is_real:
        raise unsure
    pieces: list[Piece] = []
    for rows in components(system):
        part = exact_roots(system.block(rows))
        if isinstance(part, Failure):
            if part.reason == SINGULAR:
                words = "M, C and K: are singular together, so that every number is a root"
                raise MatrixError(words)
            raise unsure
        pieces += part
    return _roots_of_pieces(arrays, pieces)


def with_proved_errors(roots: Known, errors: NDArray[np.float64]) -> Known:
    """Roots with the proved distances from the exact ones, where these exceed their rounding.

    Parameters
    ----------
    roots : tuple of m Eigenvalue
        The roots.
    errors : array (m,)
        How far each may lie from the exact root, 1/s; infinite where that is not known. A distance
        that shows in the printed digits becomes the listed error of the root.
    """
    changed = []
    for root, distance in zip(roots, errors.tolist(), strict=True):
        if not distance < math.inf:
            changed.append(root)
            continue
        error = root.error
        if distance > PRINTED * abs(root.value):
            error = max(root.error or 0.0, distance)
        rounding = distance
        if root.rounding < math.inf:
            rounding = max(root.rounding, distance)
        changed.append(replace(root, rounding=rounding, error=error))
    return tuple(changed)


def with_proved_growth(roots: Known, pieces: Sequence[Piece]) -> Known:
    """Roots of which those that are proved to grow say so, although their errors hide it.

    Each piece whose roots grow is matched with as many listed roots, the nearest to its centres;
    their real parts are taken into the proved bounds of the piece.
    """
    growing_pieces = [piece for piece in pieces if piece.side == "grows"]
    proved = sum(piece.count for piece in growing_pieces)
    if not proved or proved <= sum(root.value.real > root.rounding for root in roots):
        return roots
    from scipy.optimize import linear_sum_assignment  # which pads start without

    changed = list(roots)
    values = np.array([root.value for root in roots])
    is_free = np.ones(len(roots), dtype=bool)
    for piece in growing_pieces:
        if np.count_nonzero(is_free) < piece.count:
            break
        distances = np.abs(piece.centres[:, None] - values)
        _, nearest = linear_sum_assignment(np.where(is_free, distances, FORBIDDEN))
        is_free[nearest] = False
        for i in nearest.tolist():
            growth = min(max(changed[i].value.real, piece.low), piece.high)
            value = complex(growth, changed[i].value.imag)
            changed[i] = replace(changed[i], value=value, grows=True)
    return tuple(changed)


def _roots_of_pieces(matrices: Arrays, pieces: Sequence[Piece]) -> Known:
    """The roots at the centres of pieces, ordered as a spectrum."""
    values = _centres(pieces)
    return tuple(_solved(matrices, complex(values[k])) for k in ordered(values))


def _at_centres(roots: Known, pieces: Sequence[Piece]) -> Known:
    """Listed roots moved to the nearest centres of pieces, each to one of its own, if there are as
    many; they keep their vectors."""
    from scipy.optimize import linear_sum_assignment  # which pads start without

    centres = _centres(pieces)
    if len(centres) != len(roots):
        return roots
    listed = np.array([root.value for root in roots])
    _, own = linear_sum_assignment(np.abs(np.subtract.outer(listed, centres)))
    moved = []
    for root, value in zip(roots, centres[own].tolist(), strict=True):
        moved.append(replace(root, value=value))
    return tuple(moved[k] for k in ordered(centres[own]))


def _centres(pieces: Sequence[Piece]) -> NDArray[np.complex128]:
    """The centres of pieces: exactly real, or on the imaginary axis, where that is proved."""
    values: list[complex] = []
    for piece in pieces:
        for z in piece.centres.tolist():
            real = 0.0 if piece.side == "axis" else z.real
            imag = 0.0 if piece.real else z.imag
            values.append(complex(real, imag))
    return np.array(values, dtype=complex)


def _solved(matrices: Arrays, z: complex) -> Eigenvalue:
    """A root z of (M, C, K) with its vectors, M-normalised if that is possible.

    The vectors are the singular ones of z^2 M + z C + K of least singular value, which over the
    norms of the three parts is the backward error.
    """
    M, C, K = matrices
    parts = [z**2 * M, K]
    if C is not None:
        parts.insert(1, z * C)
    left, singular_values, right = np.linalg.svd(sum(parts))
    x = right[-1].conj()
    y = left[:, -1]
    energy = abs(np.vdot(x, M @ x))
    if energy > 0.0:
        x = x / math.sqrt(energy)
        y = y / math.sqrt(energy)
    size = sum(float(np.linalg.norm(part)) for part in parts)
    residual = float(singular_values[-1]) / size if size else 0.0
    return Eigenvalue(z, x, y, residual, math.inf)
