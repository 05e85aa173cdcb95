"""What the referee says of all roots of a small system, and what it changes in an answer."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.analysis.answers import OPEN
from squeal.errors import InputWarning
from squeal.linear import GROWING
from squeal.linear.eigen import Eigenvalue, growing, ordered
from squeal.linear.matrices import dense
from squeal.linear.system import Matrix

DATA = "half an ulp"  # what is assumed of the entries of arrays and of files with all digits
Known = tuple[Eigenvalue, ...]
Words = tuple[str | None, str]


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
            given = " (entries as given)" * (self.data != DATA)
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
    matrices: tuple[Matrix, Matrix | None, Matrix], every: Known, words: Words
) -> tuple[Known, Words, Statement | None]:
    """All finite roots and the verdict on them as far as the referee lets them pass.

    What it refutes is replaced by the roots that it knows. The statement is None for matrices on
    which it does not speak.
    """
    from squeal.analysis.systems.matrices import ALL_ROWS  # here, since pads need none of it

    M, K = dense(matrices[0]), dense(matrices[2])
    C = None if matrices[1] is None else dense(matrices[1])
    if len(K) > ALL_ROWS or any(X is not None and np.iscomplexobj(X) for X in (M, C, K)):
        return every, words, None
    from squeal.proof import judge  # here, since scenes start without it

    values = np.array([e.value for e in every], dtype=complex)
    proof = judge(M, C, K, values, None, words[0], DATA)
    if proof.status == "refuted":
        warnings.warn(
            f"the referee refutes the roots that were computed ({proof.reason})",
            InputWarning,
            stacklevel=2,
        )
        verdicts = proof.verdicts
        verdict = next(iter(verdicts)) if len(verdicts) == 1 else None
        values = _centres(proof.pieces)
        refutation = proof.reason
        proof = judge(M, C, K, values, None, verdict, DATA)
        if proof.status == "refuted" or not len(values):
            statement = Statement("open", proof.by, None, proof.data, refutation, None)
            return every, (None, f"{OPEN}{refutation}"), statement
        every = tuple(_solved((M, C, K), z) for z in values[ordered(values)].tolist())
        values = np.array([e.value for e in every], dtype=complex)
        proof = judge(M, C, K, values, None, verdict, DATA)
        words = verdict, f"{OPEN}{refutation}" if verdict is None else "roots of the referee"
    status, reason = proof.status, proof.reason
    where = None if proof.where is None else complex(proof.where)
    if status == "open" and proof.verdicts and proof.verdicts != {words[0]}:
        words = None, f"{OPEN}{reason}"
    elif status == "proved" and words[0] is None:
        verdict = next(iter(proof.verdicts)) if len(proof.verdicts) == 1 else None
        if verdict in ("stable", "marginal"):
            words = verdict, f"{verdict}, which is proved although rounding hides it"
        else:
            status, reason = "open", words[1].removeprefix(OPEN)
    every = _widened(every, proof.errors, words[0])
    growth = proof.growth_below if proof.growth_below < math.inf else None
    return every, words, Statement(status, proof.by, growth, proof.data, reason, where)


def _widened(every: Known, errors: NDArray[np.float64], verdict: str | None) -> Known:
    """Roots with the distances that are proved where these exceed what rounding is taken for."""
    each = zip(every, errors.tolist(), strict=True)
    wide = tuple(
        replace(e, rounding=max(e.rounding, error)) if error < math.inf else e for e, error in each
    )
    # the mode that names the verdict stays in the list of those that grow
    return every if verdict in GROWING and not growing(wide) else wide


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
