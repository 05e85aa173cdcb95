"""The referee: reads a system and a printed answer, and says whether the answer is proved."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.proof.balls import AS_GIVEN, HALF_ULP, Floats, Quadratic, half_widths, upper
from squeal.proof.enclosure import Guess, components, enclose, scaled
from squeal.proof.free import with_free_motions
from squeal.proof.pieces import Failure, Means, Piece, growing_counts, strong_parts, touching

Status = Literal["proved", "open", "refuted"]
LAST_DIGITS = "the answer hangs on the last digits of the entries"
FREE = "free motions neither grow nor decay as far as the entries say"


@dataclass(frozen=True, eq=False)
class RootList:
    """The printed roots of a system, all finite ones.

    Attributes
    ----------
    values : ndarray (m,)
        Roots, rad/s, each as often as it is one.
    errors : ndarray (m,)
        How far each may lie from a root of the system, rad/s.
    verdict : str or None
        `stable`, `marginal`, `flutter` or `divergence`; None if none is given.
    shapes : ndarray (n, m), optional
        Their mode shapes, if they are printed: a proof that is built on them costs less.
    """

    values: NDArray[np.complex128]
    errors: Floats
    verdict: str | None = None
    shapes: NDArray[np.complex128] | None = None

    @staticmethod
    def of(
        values: ArrayLike,
        errors: ArrayLike,
        verdict: str | None = None,
        shapes: ArrayLike | None = None,
    ) -> RootList:
        """The list of array-likes (m,). Raises ValueError if they differ in length."""
        roots = np.asarray(values, dtype=complex).reshape(-1)
        distances = np.broadcast_to(np.asarray(errors, float), roots.shape)
        if shapes is None:
            return RootList(roots, distances, verdict)
        return RootList(roots, distances, verdict, np.asarray(shapes, dtype=complex))

    def guess(self, rows: NDArray[np.intp]) -> Guess | None:
        """The roots and shapes for a component; None unless it has all rows of the system."""
        if self.shapes is None or self.shapes.shape != (len(rows), len(self.values)):
            return None
        if not (np.isfinite(self.values).all() and np.isfinite(self.shapes).all()):
            return None
        return Guess(self.values, self.shapes)


@dataclass(frozen=True, eq=False)
class Proof:
    """What the referee says of an answer.

    Attributes
    ----------
    status : str
        `proved`, `open` or `refuted`.
    by : str or None
        `enclosure`, or `exact` where some component needed it.
    growth_below : float
        No root beyond those that grow for sure grows faster, 1/s; inf if that is not known.
    data : str
        What is assumed of the entries.
    reason : str
        Why the answer is open or refuted, empty if it is proved.
    where : complex or float or None
        The root or the value of the parameter at which it is.
    errors : ndarray (m,)
        Proved distance of each listed value from a root of its own, rad/s; inf if none is proved.
    verdicts : frozenset of str
        The verdicts that are possible.
    pieces : tuple of Piece
        What is known of all roots; empty if some component has no enclosure.
    """

    status: Status
    by: Means | None = None
    growth_below: float = math.inf
    data: str = AS_GIVEN
    reason: str = ""
    where: complex | float | None = None
    errors: Floats = field(default_factory=lambda: np.zeros(0), repr=False)
    verdicts: frozenset[str] = frozenset()
    pieces: tuple[Piece, ...] = field(default=(), repr=False)


@dataclass(frozen=True)
class Count:
    """Bounds of the number of roots with a positive real part.

    `data` is what is assumed of the entries; `reason` says why the bounds differ.
    """

    lower: int
    upper: int
    by: Means | None
    data: str
    reason: str = ""

    @property
    def is_certain(self) -> bool:
        """True if the number is known."""
        return self.lower == self.upper


@dataclass(frozen=True, eq=False)
class Finding:
    """Pieces of each component, or why there are none; `data` is what they hold for, `real` says
    that the system is."""

    parts: list[list[Piece] | Failure]
    data: str
    real: bool = True

    @property
    def failure(self) -> Failure | None:
        """The first reason why a component has no pieces."""
        return next((part for part in self.parts if isinstance(part, Failure)), None)

    @property
    def pieces(self) -> list[Piece]:
        """The pieces of all components that have some."""
        return [piece for part in self.parts if not isinstance(part, Failure) for piece in part]

    @property
    def deciding(self) -> list[Piece]:
        """The pieces that decide the verdict: of a complex system, whose roots below the real axis
        mean nothing, those that may reach above it."""
        if self.real:
            return self.pieces
        return [p for p in self.pieces if np.max(p.centres.imag + p.radii) >= 0.0]

    @property
    def by(self) -> Means:
        """The stronger of the means that were needed."""
        return "exact" if any(piece.by == "exact" for piece in self.pieces) else "enclosure"


def enclosed(system: Quadratic, answer: RootList | None = None) -> Finding:
    """Enclosures of the roots of each strong component, built on those of an answer if possible."""
    parts: list[list[Piece] | Failure] = []
    for rows in components(system):
        guess = None if answer is None else answer.guess(rows)
        parts.append(enclose(system.block(rows), guess))
    return Finding(parts, system.data, system.is_real)


def _with_free_motions(system: Quadratic, finding: Finding) -> Finding:
    """The same with motions marked that are free within the data."""
    parts = list(finding.parts)
    for number, rows in enumerate(components(system)):
        part = parts[number]
        if (
            not isinstance(part, Failure)
            and system.is_real
            and any(piece.side == "unknown" for piece in part)
        ):
            block, _, _ = scaled(system.block(rows))
            parts[number] = with_free_motions(block, part)
    return replace(finding, parts=parts)


def _made_exact(system: Quadratic, finding: Finding) -> Finding:
    """The same with exact roots of the components that are not sharp.

    It is the same unless the balls are within the last digit of the doubles.
    """
    wide = any(np.any(X.rad > half_widths(X.mid, HALF_ULP)) for X in system.parts)
    if wide or not system.is_real:
        return finding
    from squeal.proof.exact import exact_roots  # here, since few systems need python-flint

    parts = list(finding.parts)
    for number, rows in enumerate(components(system)):
        part = parts[number]
        if not isinstance(part, Failure) and all(p.is_sharp and p.side != "free" for p in part):
            continue
        exact = exact_roots(system.block(rows))
        if not isinstance(exact, Failure):
            parts[number] = exact
        elif isinstance(part, Failure) and part.reason != exact.reason:
            parts[number] = Failure(f"{part.reason}; {exact.reason}")
    data = AS_GIVEN if any(p.by == "exact" for p in Finding(parts, "").pieces) else finding.data
    return Finding(parts, data)


def prove_roots(system: Quadratic, answer: RootList) -> Proof:
    """Whether a list of all roots, and the verdict on them, is right.

    Proved is that each listed value has a root of its own within its error, that there are no
    other finite roots, and that the verdict is the only possible one: for every system in the
    balls, or for their midpoints, as `data` of the result says. Refuted is what no system in the
    balls allows.

    Parameters
    ----------
    system : Quadratic
        The matrices as given.
    answer : RootList
        What is printed of them.
    """
    finding = _with_free_motions(system, enclosed(system, answer))
    proof = judge_finding(finding, answer)
    # a list without a verdict is asked for what its verdict may be, and what may be a free motion
    # within the data is asked whether it is one of the very numbers that are given
    is_settled = len(proof.verdicts) == 1 and all(p.side != "free" for p in finding.pieces)
    if proof.status == "refuted" or (proof.status == "proved" and is_settled):
        return proof
    exact = _made_exact(system, finding)
    second = judge_finding(exact, answer)
    if second.status == "refuted" and second.data != system.data:
        # the given doubles refute it, others within the data may not
        has_free = any(p.side == "free" for p in finding.pieces)
        reason = FREE if has_free else f"{LAST_DIGITS}: {second.reason}"
        known = finding if has_free else exact  # what all systems within the data have in common
        return _open(known, reason, second.where, second.errors)
    return second


def judge(
    M: ArrayLike,
    C: ArrayLike | None,
    K: ArrayLike,
    values: ArrayLike,
    errors: ArrayLike | None = None,
    verdict: str | None = None,
    data: str = HALF_ULP,
    shapes: ArrayLike | None = None,
) -> Proof:
    """Whether all roots of a dense system, and the verdict on them, are printed right.

    Parameters
    ----------
    M, C, K : array_like (n, n)
        Real or complex matrices, C None without damping.
    values : array_like (m,)
        All finite roots, rad/s.
    errors : array_like (m,), optional
        What is printed as their errors, rad/s. Left out, `errors` of the result can be printed.
    verdict : str, optional
        `stable`, `marginal`, `flutter` or `divergence`.
    data : str
        `as given`, `half an ulp`, or a number of digits such as `10 digits`.
    shapes : array_like (n, m), optional
        The mode shapes, however they were computed; a proof that is built on them costs less.

    Raises
    ------
    ValueError
        If the matrices are not square, of one size, or `data` is none of these.

    Examples
    --------
    >>> proof = judge([[1.0]], [[0.5]], [[4.0]], [-0.25 + 1.984j, -0.25 - 1.984j], 1e-3, "stable")
    >>> proof.status, proof.by, proof.growth_below
    ('proved', 'enclosure', 0.0)
    >>> judge([[1.0]], [[0.5]], [[4.0]], [-0.25 + 1.98j, -0.25 - 1.98j], 1e-3).reason
    'no root lies within the error of a listed one'
    """
    printed = RootList.of(values, math.inf if errors is None else errors, verdict, shapes)
    return prove_roots(Quadratic.of(M, C, K, data), printed)


def unstable_count(system: Quadratic) -> Count:
    """How many roots have a positive real part, for every system in the balls or its midpoints."""
    finding = enclosed(system)
    lower, most = _bounds(finding, system.n)
    if lower != most:
        finding = _made_exact(system, finding)
        lower, most = _bounds(finding, system.n)
    reason = ""
    if lower != most:
        reason = finding.failure.reason if finding.failure else LAST_DIGITS
    return Count(lower, most, finding.by if finding.pieces else None, finding.data, reason)


def _bounds(finding: Finding, n: int) -> tuple[int, int]:
    """The least and the largest number of growing roots of n rows."""
    least, most = growing_counts(finding.pieces)
    if finding.failure:
        most = 2 * n
    return least, most


def _open(finding: Finding, reason: str, where: complex | None, errors: Floats) -> Proof:
    pieces = finding.pieces
    growth, verdicts = math.inf, frozenset[str]()
    if finding.failure is None:
        growth = growth_bound(finding.deciding)
        verdicts = possible_verdicts(finding.deciding)
    return Proof(
        "open", finding.by, growth, finding.data, reason, where, errors, verdicts, tuple(pieces)
    )


def growth_bound(pieces: Sequence[Piece]) -> float:
    """A rate (1/s), at least 0, that only roots of pieces that grow for sure exceed."""
    return max([0.0, *(piece.high for piece in pieces if piece.side in ("unknown", "free"))])


def possible_verdicts(pieces: Sequence[Piece]) -> frozenset[str]:
    """The verdicts that the roots of pieces allow.

    The root of largest real part names it: `flutter` if it is one of a pair, else `divergence`.
    Where none grows it is `marginal` if one lies on the imaginary axis, else `stable`.
    """
    verdicts: set[str] = set()
    surely = [piece.low for piece in pieces if piece.side == "grows"]
    leading = max(surely, default=-math.inf)
    unknown = [p for p in pieces if p.side not in ("grows", "decays", "axis")]
    for piece in pieces:
        if piece.side in ("axis", "decays") or piece.high < leading:
            continue
        if piece.real is not True:
            verdicts.add("flutter")
        if piece.real is not False:
            verdicts.add("divergence")
    if not surely:
        on_axis = any(piece.side == "axis" for piece in pieces)
        if on_axis or unknown:
            verdicts.add("marginal")
        if not on_axis:
            verdicts.add("stable")
    return frozenset(verdicts)


def judge_finding(finding: Finding, answer: RootList) -> Proof:
    """Compare a list and a verdict with what is known of the roots."""
    errors = np.full(len(answer.values), math.inf)
    failure = finding.failure
    if failure is not None:
        return _open(finding, failure.reason, None, errors)
    pieces = finding.pieces
    with np.errstate(all="ignore"):
        status, reason, where = _compare(pieces, answer, errors)
    deciding = finding.deciding
    verdicts = possible_verdicts(deciding)
    if status != "refuted" and answer.verdict is not None and verdicts != {answer.verdict}:
        if answer.verdict not in verdicts:
            status = "refuted"
            reason = f"the verdict is {' or '.join(sorted(verdicts))}, not {answer.verdict}"
            where = None
        elif status == "proved":
            status = "open"
            vague = max(
                (p for p in deciding if p.side == "unknown"), key=lambda p: p.high, default=None
            )
            where = None if vague is None else complex(vague.centres[0])
            reason = f"the verdict may be {' or '.join(sorted(verdicts))}"
            if vague is None:
                reason = FREE
    growth = growth_bound(deciding)
    return Proof(
        status, finding.by, growth, finding.data, reason, where, errors, verdicts, tuple(pieces)
    )


def _compare(
    pieces: Sequence[Piece], answer: RootList, errors: Floats
) -> tuple[Status, str, complex | None]:
    """Status of a list of all roots, the reason and the place; fills in the proved `errors`."""
    values, claimed = answer.values, answer.errors
    centres = np.concatenate([piece.centres for piece in pieces] or [np.zeros(0, complex)])
    radii = np.concatenate([piece.radii for piece in pieces] or [np.zeros(0)])
    if not (np.isfinite(values).all() and np.all(claimed >= 0.0)):
        return "refuted", "a value of the list is not finite", None
    owner = np.repeat(np.arange(len(pieces)), [piece.count for piece in pieces])
    joined = touching(centres, radii, centres, radii) | (owner[:, None] == owner)
    parts = strong_parts(joined)
    groups = len(parts)
    sizes = np.array([len(part) for part in parts], dtype=int)
    label = np.empty(len(centres), dtype=int)
    for group, part in enumerate(parts):
        label[part] = group
    if len(values) != len(centres):
        # a list of another length is wrong whatever its errors are
        at = None
        if len(centres):
            gaps = np.abs(values[:, None] - centres).min(axis=0, initial=math.inf)
            at = complex(centres[int(np.argmax(gaps - radii))])
        return "refuted", f"{len(values)} roots are listed, there are {len(centres)}", at
    meets = touching(values, claimed, centres, radii)
    of_group = label[:, None] == np.arange(groups)
    reached = meets.astype(np.float32) @ of_group.astype(np.float32) > 0.0
    lost = np.flatnonzero(~reached.any(axis=1))
    if lost.size:
        value = complex(values[lost[0]])
        return "refuted", "no root lies within the error of a listed one", value
    for group in np.flatnonzero(reached.sum(axis=0) < sizes).tolist():
        place = complex(centres[label == group][0])
        return "refuted", "a root is missing from the list", place
    away = np.abs(values[:, None] - centres)
    nearest = label[np.argmin(away - radii, axis=1)] if len(values) else label
    for group in np.flatnonzero(np.bincount(nearest, minlength=groups) != sizes).tolist():
        place = complex(centres[label == group][0])
        return "open", "listed values cannot be told apart", place
    farthest = np.where(nearest[:, None] == label, away + radii, 0.0).max(axis=1, initial=0.0)
    errors[:] = upper(farthest, 8)
    wide = np.flatnonzero(errors > claimed)
    if wide.size:
        worst = int(wide[np.argmax(errors[wide] - claimed[wide])])
        return (
            "open",
            "a root is not known to the error of its listed value",
            complex(values[worst]),
        )
    return "proved", "", None
