"""Modes of an answer paired with those of another one, or of a test, by frequency and by MAC."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from squeal.analysis.answers import Eigenvalues
from squeal.errors import InputError
from squeal.io.system import DIRECTIONS, Coordinates, read_table
from squeal.io.writing import Answer, Column, Table, columns
from squeal.schema import ANY, Number, Place

FORBIDDEN = 1e6  # cost of a pair beyond the tolerance
POSITIVE = Number(0.0)
DAMPING = "damping_ratio"


def mac(X: ArrayLike, Y: ArrayLike) -> NDArray[np.float64]:
    """Modal assurance criterion of shapes, 1 for equal ones whatever their scale and phase.

    Parameters
    ----------
    X, Y : array_like (n, m), (n, k)
        Shapes as columns, real or complex.

    Returns
    -------
    array (m, k)
        |x^H y|^2 / (x^H x  y^H y); NaN where a shape is zero or not known.

    Examples
    --------
    >>> mac([[1, 1], [1, -1]], [[2j], [0]]).round(3).tolist()
    [[0.5], [0.5]]
    """
    X, Y = np.asarray(X), np.asarray(Y)
    with np.errstate(invalid="ignore"):
        sizes = np.multiply.outer(*(np.sum(np.abs(Z) ** 2, axis=0) for Z in (X, Y)))
        return np.asarray(np.abs(X.conj().T @ Y) ** 2 / sizes)


class Mode(NamedTuple):
    """Name, frequency (Hz), damping ratio and shape (rows,) of a mode, NaN where not measured."""

    name: str
    frequency_hz: float
    damping_ratio: float | None
    shape: NDArray[np.complex128]


@dataclass(frozen=True)
class Pair:
    """A mode of the reference and the computed one, None where it has none; the difference in
    frequency (% of the reference) and the MAC, if shapes are known."""

    reference: str | None
    reference_hz: float | None
    reference_damping: float | None
    mode: int | None
    frequency_hz: float | None
    damping_ratio: float | None
    difference: float | None = None
    mac: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Pairs(Answer):
    """Modes paired with those of `reference`, then those left over on both sides.

    mac: of each mode of the reference with each computed one (m, k); tolerance: the largest
    difference of a pair, of the frequency.
    """

    reference: str
    pairs: tuple[Pair, ...]
    tolerance: float
    mac: NDArray[np.float64] = field(repr=False)

    @property
    def names(self) -> dict[int, str]:
        """The names that the reference gives computed modes, by their numbers."""
        return {one.mode: one.reference for one in self.pairs if one.mode and one.reference}

    def table(self) -> Table:
        names = columns("reference reference_hz mode frequency_hz")
        more = (Column("difference", "%"), *columns(f"mac reference_damping {DAMPING}"))
        title = f"modes paired with {self.reference}, within {100 * self.tolerance:g} %"
        return Table((*names, *more), self.pairs, title, "no mode")

    def to_dict(self) -> dict[str, Any]:
        return {"tolerance": self.tolerance, "pairs": [asdict(pair) for pair in self.pairs]}


def compare(
    computed: Eigenvalues, reference: Eigenvalues | Path | str, tolerance: float = 0.1
) -> Pairs:
    """Pair the modes of an answer with those of another one, or with test frequencies.

    Pairs are assigned together: the sum of their differences in frequency, over the tolerance, and
    of 1 - MAC, where shapes are known, is the least.

    Parameters
    ----------
    computed : Eigenvalues
        Of a pad or a system; of each pair of eigenvalues the mode is taken once.
    reference : Eigenvalues, or the path of a .csv file
        An answer with the same rows, or a table with the columns name, frequency_hz, if known
        damping_ratio, and shapes in columns NODE:DOF, numbers such as 0.3 or 0.3+0.1j.
    tolerance : float
        Largest difference of a pair, of the frequency of the reference.

    Raises
    ------
    InputError
        For other rows, doubled names, frequencies that are none, and nodes without coordinates.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 1], [0, 0]]}
    >>> chain = squeal.System([[1, 0], [0, 1]], K=K)
    >>> both = (squeal.eigenvalues(chain, at) for at in (0.0, 0.1))
    >>> [(pair.mode, round(pair.mac, 3)) for pair in compare(*both).pairs]
    [(1, 0.999), (2, 0.999)]
    """
    POSITIVE.check(tolerance, Place("compare"), "tolerance")
    where = getattr(computed.source[0], "coordinates", None)
    own, name = list(_modes(computed, where)), str(reference)
    size = len(own[0].shape) if own else 0
    if isinstance(reference, Eigenvalues):
        other = list(_modes(reference, where))
        name = f"{reference.name}, {reference.parameter} = {reference.value:.6g}"
        if other and own and len(other[0].shape) != size:
            counts = f"{len(other[0].shape)} and {size} rows"
            raise InputError(f"compare: {counts} are not allowed; they must be the same")
    else:
        other = read_test(Path(reference), where, size)
    f, g = (np.array([mode.frequency_hz for mode in each]) for each in (other, own))
    apart = (g - f[:, None]) / f[:, None]
    alike = np.full(apart.shape, np.nan)
    for i, one in enumerate(other if own else ()):
        some = ~np.isnan(one.shape)  # where it was measured
        alike[i] = mac(one.shape[some, None], np.array([mode.shape[some] for mode in own]).T)
    cost = np.abs(apart) / tolerance + np.where(np.isnan(alike), 0.0, 1.0 - alike)
    cost = np.where(np.abs(apart) <= tolerance, cost, FORBIDDEN)
    rows = []
    for i, j in zip(*linear_sum_assignment(cost), strict=True):
        if cost[i, j] < FORBIDDEN:
            likeness = None if np.isnan(alike[i, j]) else float(alike[i, j])
            rows.append(_pair(other[i], own[j], 100 * float(apart[i, j]), likeness))
    paired = {pair.reference for pair in rows}, {pair.mode for pair in rows}
    rows += [_pair(one, None) for one in other if one.name not in paired[0]]
    rows += [_pair(None, one) for one in own if int(one.name) not in paired[1]]
    return Pairs(name, tuple(rows), tolerance, alike)


def _pair(a: Mode | None, b: Mode | None, *more: float | None) -> Pair:
    first: Any = (a.name, a.frequency_hz, a.damping_ratio) if a else (None, None, None)
    second: Any = (int(b.name), b.frequency_hz, b.damping_ratio) if b else (None, None, None)
    return Pair(*first, *second, *more)


def _modes(answer: Eigenvalues, where: Coordinates | None) -> Iterator[Mode]:
    """The modes that vibrate, with what of their shapes moves nodes, of others all rows."""
    for number, root in zip(answer.modes.tolist(), answer.eigenvalues, strict=True):
        if root.value.imag > 0.0:
            shape = root.right if where is None else root.right[where.directions >= 0]
            yield Mode(str(number), root.frequency_hz, root.damping_ratio, shape)


def read_test(path: Path, where: Coordinates | None, size: int = 0) -> list[Mode]:
    """The modes of a table, with shapes (size,) on the rows that move nodes. Raises InputError."""
    _, lines = read_table(path, ("name", "frequency_hz"))
    rows: dict[tuple[str, int], int] = {}
    if where is not None:
        moving = np.flatnonzero(where.directions >= 0)
        at = zip(where.nodes[moving].tolist(), where.directions[moving].tolist(), strict=True)
        rows = {(where.names[node].lower(), way): k for k, (node, way) in enumerate(at)}
    modes: dict[str, Mode] = {}
    for here, line in lines:
        name, texts = line.pop("name").strip(), (line.pop("frequency_hz"), line.pop(DAMPING, ""))
        if not name or name in modes:
            raise (here / "name").must_be(name, "a name that no other line has")
        frequency = POSITIVE.read(_number(texts[0]), here / "frequency_hz")
        damping = ANY.read(_number(texts[1]), here / DAMPING) if texts[1].strip() else None
        shape = np.full(size or len(rows), np.nan, dtype=complex)
        for head, cell in line.items():
            node, _, dof = str(head).rpartition(":")
            row = rows.get((node.strip(), DIRECTIONS.get(dof.strip(), -1)))
            if row is None:
                allowed = "NODE:DOF of a node with coordinates that x, y or z moves"
                raise (here / head).must_be(head, allowed)
            value = _number(cell, complex) if cell.strip() else math.nan
            if isinstance(value, str) or (cell.strip() and not np.isfinite(value)):
                raise (here / head).must_be(cell, "a finite number such as 0.3 or 0.3+0.1j")
            shape[row] = value
        modes[name] = Mode(name, frequency, damping, shape)
    return list(modes.values())


def _number(text: str, kind: Callable[[str], Any] = float) -> Any:
    """The number that text is, or the text."""
    try:
        return kind(text.strip())
    except ValueError:
        return text
