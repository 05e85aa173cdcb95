"""The referee: reads a system and a printed answer, and says whether the answer is proved."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.proof import AS_GIVEN
from squeal.proof.balls import Floats, Quadratic
from squeal.proof.enclosure import components, enclose, scaled
from squeal.proof.free import with_free_motions
from squeal.proof.pieces import (
    Failure,
    Means,
    Piece,
    growing_counts,
    labels,
    strong_components,
    touching,
)

Status = Literal["proved", "open", "refuted"]
LAST_DIGITS = "the answer hangs on the last digits of the entries"
NOT_TOLD_APART = "listed values cannot be told apart"
FREE = "free motions neither grow nor decay as far as the entries say"


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
    verdicts : frozenset of str
        The verdicts that are possible.
    pieces : tuple of Piece
        What is known of the roots, without those of components that have no enclosure.
    matches : tuple of m tuple of Piece
        The pieces among which the root of each listed value lies; empty if none is proved.
    """

    status: Status
    by: Means | None = None
    growth_below: float = math.inf
    data: str = AS_GIVEN
    reason: str = ""
    where: complex | float | None = None
    verdicts: frozenset[str] = frozenset()
    pieces: tuple[Piece, ...] = field(default=(), repr=False)
    matches: tuple[tuple[Piece, ...], ...] = field(default=(), repr=False)


class Count(NamedTuple):
    """Bounds of the number of roots with a positive real part."""

    lower: int
    upper: int

    @property
    def is_certain(self) -> bool:
        """True if the number is known."""
        return self.lower == self.upper


@dataclass(frozen=True, eq=False)
class Finding:
    """What is known of the roots of a system, by its strong components.

    parts: the pieces of each component, or why it has none; data: what is assumed of the entries
    for which the pieces hold; real: whether the system is real.
    """

    parts: list[list[Piece] | Failure]
    data: str
    real: bool = True

    @property
    def failure(self) -> Failure | None:
        """The first reason why a component has no pieces, None if all have some."""
        for part in self.parts:
            if isinstance(part, Failure):
                return part
        return None

    @property
    def pieces(self) -> list[Piece]:
        """The pieces of all components that have some."""
        pieces: list[Piece] = []
        for part in self.parts:
            if not isinstance(part, Failure):
                pieces += part
        return pieces

    @property
    def deciding(self) -> list[Piece]:
        """The pieces that decide the verdict: all of a real system. Of a complex one, whose roots
        below the real axis have no meaning, those that may reach above it."""
        if self.real:
            return self.pieces
        return [p for p in self.pieces if np.max(p.centres.imag + p.radii) >= 0.0]

    @property
    def by(self) -> Means:
        """The stronger of the means that were needed."""
        if any(piece.by == "exact" for piece in self.pieces):
            return "exact"
        return "enclosure"


def enclosed(system: Quadratic) -> Finding:
    """Enclose the roots of each strong component in discs, for all matrices in the balls."""
    parts = [enclose(system.block(rows)) for rows in components(system.parts)]
    return Finding(parts, system.data, system.is_real)


def _with_free_motions(system: Quadratic, finding: Finding) -> Finding:
    """The finding with pieces marked `free` whose roots are zero within the data: rigid-body
    motions (see `squeal.proof.free`)."""
    if not system.is_real:
        return finding
    parts = list(finding.parts)
    for number, rows in enumerate(components(system.parts)):
        part = parts[number]
        if isinstance(part, Failure):
            continue
        if any(piece.side == "unknown" for piece in part):
            block, _ = scaled(system.block(rows))
            parts[number] = with_free_motions(block, part)
    return replace(finding, parts=parts)


def _made_exact(system: Quadratic, finding: Finding) -> Finding:
    """The finding with exact roots of the components whose roots it leaves open.

    Where an entry has fewer digits than a double, exact roots of the given doubles say nothing, and
    the finding stays as it is.
    """
    if not (system.is_real and all(X.has_all_digits for X in system.parts)):
        return finding
    from squeal.proof.exact import exact_roots  # here, since few systems need python-flint

    parts = list(finding.parts)
    data = finding.data
    for number, rows in enumerate(components(system.parts)):
        part = parts[number]
        if not isinstance(part, Failure) and all(p.is_sharp and p.side != "free" for p in part):
            continue
        exact = exact_roots(system.block(rows))
        if not isinstance(exact, Failure):
            parts[number] = exact
            data = AS_GIVEN  # also where `exact` is empty, for a component without finite roots
        elif isinstance(part, Failure) and part.reason != exact.reason:
            parts[number] = Failure(f"{part.reason}; {exact.reason}")
    return Finding(parts, data)


def prove_roots(system: Quadratic, values: ArrayLike, verdict: str | None = None) -> Proof:
    """Whether a list has as many values as there are roots, and the verdict on these is right.

    Proved is that each listed value can be matched with a root of its own among its `matches`, that
    there are no other finite roots, and that the verdict is the only possible one. That holds for
    every system in the balls, or for their midpoints, as `data` of the result says. Refuted is what
    no system in the balls allows. The proof does not decide whether a value is near its root:
    100 +- 100i are proved for -0.25 +- 1.98i. The caller compares values with the pieces of their
    matches.

    Enclosures come first; what they leave open the exact roots of the given doubles decide.

    Parameters
    ----------
    system : Quadratic
        The matrices as given.
    values : array_like (m,)
        All finite roots as printed, rad/s, each as often as it is one.
    verdict : str, optional
        `stable`, `marginal`, `flutter` or `divergence` as printed.

    Examples
    --------
    >>> system = Quadratic.of([[1.0]], [[0.5]], [[4.0]], "half an ulp")
    >>> roots = [-0.25 + 1.984j, -0.25 - 1.984j]
    >>> proof = prove_roots(system, roots, "stable")
    >>> proof.status, proof.by, proof.growth_below
    ('proved', 'enclosure', 0.0)
    >>> prove_roots(system, [*roots, roots[0]]).reason
    '3 roots are listed, there are 2'
    """
    finding = _with_free_motions(system, enclosed(system))
    proof = judge_finding(finding, values, verdict)
    if proof.status == "refuted":
        return proof
    # a proved list still goes on to the exact roots if several verdicts are possible (none is
    # listed then), or if a root is free or of unknown side: the given doubles may decide both
    sides = {piece.side for piece in finding.pieces}
    has_free_motions = "free" in sides
    is_settled = len(proof.verdicts) == 1 and not sides & {"free", "unknown"}
    if proof.status == "proved" and is_settled:
        return proof
    exact = _made_exact(system, finding)
    exact_proof = judge_finding(exact, values, verdict)
    # exact roots are those of the given doubles, which other `data` may not mean
    if exact_proof.status != "refuted" or exact_proof.data == system.data:
        return exact_proof
    # the given doubles refute it, other entries within the data may not
    if has_free_motions:
        return replace(
            proof,
            status="open",
            reason=FREE,
            where=exact_proof.where,
            matches=exact_proof.matches,
        )
    # what is bounded for all these entries stands, beside the roots of the given ones
    return replace(
        proof,
        status="open",
        by=exact_proof.by,
        reason=f"{LAST_DIGITS}: as given {exact_proof.reason}",
        where=exact_proof.where,
        verdicts=exact_proof.verdicts,
        pieces=exact_proof.pieces,
    )


def unstable_count(system: Quadratic) -> Count:
    """How many roots have a positive real part, for every system in the balls or its midpoints."""
    finding = enclosed(system)
    count = _growing_count(finding, system.n)
    if count.is_certain:
        return count
    return _growing_count(_made_exact(system, finding), system.n)


def _growing_count(finding: Finding, n: int) -> Count:
    """The number of growing roots of a system of n rows."""
    least, most = growing_counts(finding.pieces)
    if finding.failure is not None:
        most = 2 * n
    return Count(least, most)


def growth_bound(pieces: Sequence[Piece]) -> float:
    """A rate (1/s), at least 0, that no root exceeds but those that grow for certain."""
    undecided = [piece.high for piece in pieces if piece.side in ("unknown", "free")]
    return max([0.0, *undecided])


def possible_verdicts(pieces: Sequence[Piece]) -> frozenset[str]:
    """The verdicts that the roots of pieces allow.

    The root of largest real part names it: `flutter` if it is one of a pair, else `divergence`.
    Where none grows it is `marginal` if one lies on the imaginary axis, else `stable`. A root of a
    `free` or `unknown` piece may grow, lie on the axis or decay.
    """
    verdicts: set[str] = set()
    certain_growth = [piece.low for piece in pieces if piece.side == "grows"]
    # the largest real part is at least this, 1/s
    leading = max(certain_growth, default=-math.inf)
    for piece in pieces:
        may_lead = piece.side not in ("axis", "decays") and piece.high >= leading
        # `real` is None if it is not known: both verdicts are then possible
        if may_lead and piece.real is not True:
            verdicts.add("flutter")
        if may_lead and piece.real is not False:
            verdicts.add("divergence")
    if certain_growth:
        return frozenset(verdicts)
    sides = {piece.side for piece in pieces}
    if "axis" in sides:
        verdicts.add("marginal")
        return frozenset(verdicts)
    if sides & {"free", "unknown"}:
        verdicts.add("marginal")
    verdicts.add("stable")
    return frozenset(verdicts)


def judge_finding(finding: Finding, values: ArrayLike, verdict: str | None) -> Proof:
    """Compare a list of roots (m,) and its verdict with what is known of the roots of a system.

    - Without an enclosure of each component all is open.
    - Of the roots the answer is that of `_compare`.
    - A verdict that is not possible is refuted; one of several possible ones is open.
    """
    failure = finding.failure
    if failure is not None:
        return Proof(
            status="open",
            by=finding.by,
            data=finding.data,
            reason=failure.reason,
            pieces=tuple(finding.pieces),
        )
    with np.errstate(all="ignore"):
        comparison = _compare(finding.pieces, np.asarray(values, dtype=complex).reshape(-1))
    verdicts = possible_verdicts(finding.deciding)
    proof = replace(
        comparison,
        by=finding.by,
        growth_below=growth_bound(finding.deciding),
        data=finding.data,
        verdicts=verdicts,
        pieces=tuple(finding.pieces),
    )
    if proof.status == "refuted" or verdict is None or verdicts == {verdict}:
        return proof
    possible = " or ".join(sorted(verdicts))
    if verdict not in verdicts:
        reason = f"the verdict is {possible}, not {verdict}"
        return replace(proof, status="refuted", reason=reason, where=None)
    if proof.status == "open":
        return proof
    sides = {piece.side for piece in finding.deciding}
    if "free" in sides and "unknown" not in sides:
        return replace(proof, status="open", reason=FREE, where=None)
    # roots of unknown side, or growing ones of which either may be the faster
    undecided = "unknown" if "unknown" in sides else "grows"
    candidates = [piece for piece in finding.deciding if piece.side == undecided]
    fastest = max(candidates, key=lambda piece: piece.high)
    reason = f"the verdict may be {possible}"
    return replace(proof, status="open", reason=reason, where=complex(fastest.centres[0]))


def _groups(
    pieces: Sequence[Piece], centres: NDArray[np.complex128], radii: Floats
) -> NDArray[np.intp]:
    """Number the groups of discs: those that meet, or belong to one piece, are one group.

    Returns the number of its group for each disc (k,); centres and radii (k,) are those of all
    pieces in their order.
    """
    piece_of = np.repeat(np.arange(len(pieces)), [piece.count for piece in pieces])
    is_joined = touching(centres, radii, centres, radii) | (piece_of[:, None] == piece_of)
    return labels(strong_components(is_joined), len(centres))


def _compare(pieces: Sequence[Piece], values: NDArray[np.complex128]) -> Proof:
    """Match each listed value to a group of discs that meet, which holds as many roots as discs.

    The proof is of the list alone: its status, reason, `where` and the matches.

    - Refuted: a value is not finite, or the numbers of values and roots differ.
    - Open: a group has not as many values nearest to it as it has roots.
    - Proved: none of these.
    """
    if not np.isfinite(values).all():
        return Proof("refuted", reason="a value of the list is not finite")
    centres = np.concatenate([np.zeros(0, complex), *(piece.centres for piece in pieces)])
    radii = np.concatenate([np.zeros(0), *(piece.radii for piece in pieces)])
    gaps = np.abs(values[:, None] - centres) - radii
    if len(values) != len(centres):
        reason = f"{len(values)} roots are listed, there are {len(centres)}"
        farthest = None
        if len(centres):
            farthest = complex(centres[int(np.argmax(gaps.min(axis=0, initial=math.inf)))])
        return Proof("refuted", reason=reason, where=farthest)
    if not len(values):
        return Proof("proved")
    group_of = _groups(pieces, centres, radii)
    sizes = np.bincount(group_of)
    nearest = group_of[np.argmin(gaps, axis=1)]
    miscounted = np.flatnonzero(np.bincount(nearest, minlength=len(sizes)) != sizes)
    if miscounted.size:
        root = complex(centres[group_of == miscounted[0]][0])
        return Proof("open", reason=NOT_TOLD_APART, where=root)
    pieces_of_group: list[list[Piece]] = [[] for _ in sizes]
    # the index of the first disc of each piece: its discs are in one group
    first_discs = np.cumsum([0] + [piece.count for piece in pieces[:-1]])
    for piece, group in zip(pieces, group_of[first_discs].tolist(), strict=True):
        pieces_of_group[group].append(piece)
    return Proof(
        "proved", matches=tuple(tuple(pieces_of_group[group]) for group in nearest.tolist())
    )
