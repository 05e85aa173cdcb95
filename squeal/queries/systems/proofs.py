"""What the referee says of all roots of a small system, and what it changes in an answer."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputWarning
from squeal.linear import GROWING
from squeal.linear.eigen import Eigenvalue, growing, ordered
from squeal.linear.matrices import dense
from squeal.linear.system import Matrix
from squeal.results.columns import OPEN

if TYPE_CHECKING:
    from squeal.proof import Proof, Quadratic

AS_GIVEN = "as given"
HALF_ULP = "half an ulp"  # is assumed of the entries of arrays and of files with all digits
PRINTED = 1e-6  # of |lambda|: the digits of a table
Known = tuple[Eigenvalue, ...]
Words = tuple[str | None, str]


@dataclass(frozen=True, eq=False)
class Data:
    """What is assumed of the entries of M, C and K.

    words: in words; radii: how far each entry (n, n) of the three may lie from the given one beside
    half an ulp, None if the words say it.
    """

    words: str = HALF_ULP
    radii: tuple[NDArray[np.float64], ...] | None = None

    def around(self, M: NDArray[Any], C: NDArray[Any] | None, K: NDArray[Any]) -> Quadratic:
        """The system in balls as wide as the data.

        Raises ValueError where an entry is no double.
        """
        from squeal.proof.balls import Balls, Quadratic, upper  # scenes start without it

        if self.radii is None:
            return Quadratic.of(M, C, K, self.words)
        system = Quadratic.of(M, C, K, HALF_ULP)
        balls = (
            Balls(X.mid, np.where(radius > 0.0, upper(X.rad + radius, 2), X.rad))
            for X, radius in zip(system.parts, self.radii, strict=True)
        )
        mass, damping, stiffness = balls
        return replace(system, M=mass, C=damping, K=stiffness, data=self.words)


@dataclass(frozen=True)
class Statement:
    """What is known of a list of roots, as JSON holds it under `proof`.

    status: `proved`, `counted` or `open`; by: `exact`, `enclosure` or `count`; growth_below: no
    other root grows faster, 1/s, None if that is not known; data: what is assumed of the entries;
    reason and where: why it is open, and at which root.
    """

    status: str
    by: str | None
    growth_below: float | None = None
    data: str | None = None
    reason: str = ""
    where: complex | None = None

    @property
    def words(self) -> str:
        """In a line below a list."""
        if self.status == "proved":
            growth = "" if not self.growth_below else f" by more than {self.growth_below:.3g} 1/s"
            given = ""
            if self.data == AS_GIVEN:
                given = " (entries as given)"
            elif self.data != HALF_ULP:
                given = f" (entries known to {self.data})"
            return f"proved: no other mode grows{growth}{given}"
        if self.status == "counted":
            return "counted: an argument-principle count agrees"
        where = "" if self.where is None else f" (near {self.where:.6g} rad/s)"
        return f"{OPEN}{self.reason}{where}"

    def to_dict(self) -> dict[str, Any]:
        """As JSON holds it."""
        z = self.where
        where = None if z is None else {"real": z.real, "imag": z.imag}
        return vars(self) | {"reason": self.reason or None, "where": where}


def counted(agrees: bool) -> Statement:
    """What a count says where the referee does not apply."""
    if agrees:
        return Statement("counted", "count")
    return Statement("open", "count", reason="no count agrees, others may be missing")


def refereed(
    matrices: tuple[Matrix, Matrix | None, Matrix], every: Known, words: Words, data: Data
) -> tuple[Known, Words, Statement]:
    """All finite roots and the verdict on them as far as the referee lets them pass.

    What it refutes is replaced by the roots that it knows. Raises ValueError where an entry
    is no double.
    """

    M, K = dense(matrices[0]), dense(matrices[2])
    C = None if matrices[1] is None else dense(matrices[1])
    from squeal.proof.referee import (  # here, since scenes start without it
        FREE,
        RootList,
        prove_roots,
    )

    system = data.around(M, C, K)

    def judge(roots: Known, verdict: str | None) -> Proof:
        values = np.array([e.value for e in roots], dtype=complex)
        shapes = None
        if roots and all(len(e.right) == len(K) for e in roots):
            shapes = np.column_stack([e.right for e in roots])
        return prove_roots(system, RootList.of(values, math.inf, verdict, shapes))

    proof = judge(every, words[0])
    if proof.status == "refuted":
        warnings.warn(
            f"the referee refutes the roots that were computed ({proof.reason})",
            InputWarning,
            stacklevel=2,
        )
        refutation = proof.reason
        verdict = next(iter(proof.verdicts)) if len(proof.verdicts) == 1 else None
        values = _centres(proof.pieces)
        found = tuple(_solved((M, C, K), z) for z in values[ordered(values)].tolist())
        proof = judge(found, verdict)
        if proof.status == "refuted" or not found:
            statement = Statement("open", proof.by, None, proof.data, refutation, None)
            return every, (None, f"{OPEN}{refutation}"), statement
        every = found
        words = verdict, f"{OPEN}{refutation}" if verdict is None else "roots of the referee"
    status, reason = proof.status, proof.reason
    where = None if proof.where is None else complex(proof.where)
    if status == "open" and proof.verdicts and proof.verdicts != {words[0]}:
        words = None, f"{OPEN}{reason}"
    elif status == "proved" and words[0] is None:
        verdict = next(iter(proof.verdicts)) if len(proof.verdicts) == 1 else None
        # what is known to few digits neither grows nor decays
        if data.words == HALF_ULP and verdict in ("stable", "marginal"):
            words = verdict, f"{verdict}, which is proved although rounding hides it"
        elif any(piece.side == "free" for piece in proof.pieces):
            status = "open"
            reason = FREE
        else:
            status = "open"
            reason = words[1].removeprefix(OPEN)
    every = with_proved_errors(every, proof.errors, words[0])
    growth = proof.growth_below if proof.growth_below < math.inf else None
    return every, words, Statement(status, proof.by, growth, proof.data, reason, where)


def with_proved_errors(every: Known, errors: NDArray[np.float64], verdict: str | None) -> Known:
    """Roots with the distances that are proved where these exceed what rounding is taken for.

    One that the printed digits would hide is the error of the root, which is listed.
    """
    wide = []
    for root, distance in zip(every, errors.tolist(), strict=True):
        if distance < math.inf:
            root = replace(root, rounding=max(root.rounding, distance))
            if distance > PRINTED * abs(root.value):
                root = replace(root, error=max(root.error or 0.0, distance))
        wide.append(root)
    # the mode that names the verdict stays in the list of those that grow
    return every if verdict in GROWING and not growing(wide) else tuple(wide)


def _centres(pieces: tuple[Any, ...]) -> NDArray[np.complex128]:
    """The known roots (m,), conjugate to each other where they are."""
    found: list[complex] = []
    for piece in pieces:
        for z in piece.centres.tolist():
            real = 0.0 if piece.side == "axis" else z.real
            found.append(complex(real, 0.0 if piece.real else z.imag))
    return np.array(found, dtype=complex)


def _solved(matrices: tuple[Any, Any, Any], z: complex) -> Eigenvalue:
    """A root with its vectors, M-normalised if that is possible, and its backward error."""
    M, C, K = matrices
    parts = [z**2 * M, z * C if C is not None else 0.0 * M, K]
    left, sizes, right = np.linalg.svd(sum(parts))
    x, y = right[-1].conj(), left[:, -1]
    energy = abs(np.vdot(x, M @ x))
    if energy > 0.0:
        x = x / math.sqrt(energy)
        y = y / math.sqrt(energy)
    size = sum(float(np.linalg.norm(part)) for part in parts)
    residual = float(sizes[-1]) / size if size else 0.0
    return Eigenvalue(z, x, y, residual, math.inf)
