"""Modes of an answer paired with those of another one, or of a test, by frequency and by MAC."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from squeal.analysis.answers import Eigenvalues
from squeal.errors import InputError
from squeal.io.system import DIRECTIONS, Coordinates, number_in, read_table
from squeal.io.writing import Answer, Column, Table, columns
from squeal.linear.matrices import dense, given_matrix
from squeal.schema import POSITIVE, Positive, public

FORBIDDEN = 1e6  # cost of a pair beyond the tolerance
EVEN = 2e-4  # difference, of the frequency, that tells nothing: a growing one pairs
DAMPING = "damping_ratio"
BESIDE = ("real [1/s]", "error [1/s]", "residual", "condition")  # in a table of eigenvalues


def mac(X: Any, Y: Any) -> NDArray[np.float64]:
    """Modal assurance criterion of shapes, 1 for equal ones whatever their scale and phase.

    Parameters
    ----------
    X, Y : array_like (n, m), (n, k)
        Shapes as columns, or one shape (n,), real or complex.

    Returns
    -------
    array (m, k)
        `|x^H y|^2 / (x^H x  y^H y)`; a shape of zeros is refused (InputError).

    Examples
    --------
    >>> mac([[1, 1], [1, -1]], [[2j], [0]]).round(3).tolist()
    [[0.5], [0.5]]
    """
    units = []
    for name, Z in {"X": X, "Y": Y}.items():
        Z = np.asarray(Z)[:, None] if np.ndim(Z) == 1 else Z  # one shape
        Z = dense(given_matrix(Z, f"mac: {name}"))
        if not Z.any(axis=0).all():
            raise InputError(f"mac: {name}: a shape of zeros is not allowed; each must move")
        Z = Z / np.abs(Z).max(axis=0)  # squares of shapes of any scale are finite then
        units.append(Z / np.linalg.norm(Z, axis=0))
    X, Y = units
    if len(X) != len(Y):
        raise InputError(f"mac: {len(X)} and {len(Y)} rows are not allowed; they must be the same")
    return np.asarray(np.abs(X.conj().T @ Y) ** 2)


Mode = tuple[tuple[Any, Any, Any], NDArray[np.complex128]]
"""Name, frequency (Hz) and damping ratio; displacements (3 nodes,), NaN where not measured."""


class Pair(NamedTuple):
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
    difference of a pair, of the frequency; warnings: which modes are equally near one of the
    reference.
    """

    reference: str
    pairs: tuple[Pair, ...]
    tolerance: float
    mac: NDArray[np.float64] = field(repr=False)
    warnings: tuple[str, ...] = ()

    @property
    def names(self) -> dict[int, str]:
        """The names that the reference gives computed modes, by their numbers."""
        return {one.mode: one.reference for one in self.pairs if one.mode and one.reference}

    def table(self) -> Table:
        names = columns("reference reference_hz mode frequency_hz")
        more = (Column("difference", "%"), *columns(f"mac reference_damping% {DAMPING}%"))
        title = f"modes paired with {self.reference}, within {100 * self.tolerance:g} %"
        return Table((*names, *more), self.pairs, title, "no mode")

    def to_dict(self) -> dict[str, Any]:
        return {"tolerance": self.tolerance, "pairs": [pair._asdict() for pair in self.pairs]}


@public
def compare(
    computed: Eigenvalues, reference: Eigenvalues | Path | str, tolerance: Positive = 0.1
) -> Pairs:
    """Pair the modes of an answer with those of another one, or with test frequencies.

    Pairs are assigned together: the sum of their differences in frequency, over the tolerance, and
    of 1 - MAC, where shapes are known, is the least. Of modes equally near to one of the reference
    that which grows is taken if the latter does, or its damping is not known, since what squeals is
    measured; the tie is a warning.

    Parameters
    ----------
    computed : Eigenvalues
        Of a pad or a system; of each pair of eigenvalues the mode is taken once.
    reference : Eigenvalues, or the path of a .csv file
        An answer with the same rows, or a table with the columns name, frequency_hz, if known
        damping_ratio, and shapes in columns NODE:DOF, numbers such as 0.3 or 0.3+0.1j; or what
        `save` of another answer wrote.
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
    where, name = getattr(computed.source[0], "coordinates", None), str(reference)
    own = _modes(computed, where)
    if isinstance(reference, Eigenvalues):
        sizes = [{len(root.right) for root in x.eigenvalues} for x in (reference, computed)]
        if len(set.union(*sizes)) > 1:
            counts = " and ".join(str(*size) for size in sizes)
            raise InputError(f"compare: {counts} rows are not allowed; they must be the same")
        other = [((str(k), *more), x) for (k, *more), x in _modes(reference, where)]
        name = f"{reference.name}, {reference.parameter} = {reference.value:.6g}"
    else:
        other = read_test(Path(reference), where)
    f, g = (np.array([heads[1] for heads, _ in each], float) for each in (other, own))
    apart = (g - f[:, None]) / f[:, None]
    alike = np.full(apart.shape, np.nan)
    for i, (_, shape) in enumerate(other if own else ()):
        some = ~np.isnan(shape)  # where it was measured
        moving = [j for j, (_, x) in enumerate(own) if shape[some].any() and x[some].any()]
        if moving:
            alike[i, moving] = mac(shape[some, None], np.array([own[j][1][some] for j in moving]).T)
    cost = np.abs(apart) / tolerance + np.where(np.isnan(alike), 0.0, 1.0 - alike)
    least = EVEN / tolerance
    even = [np.flatnonzero(np.abs(row - row.min()) <= least) for row in cost if len(own)]
    grows = [np.array([h[2] is None or h[2] < 0.0 for h, _ in each]) for each in (other, own)]
    cost = cost + least * (grows[0][:, None] != grows[1])
    cost = np.where(np.abs(apart) <= tolerance, cost, FORBIDDEN)
    pairs = np.transpose(linear_sum_assignment(cost)).tolist()
    pairs = [(i, j) for i, j in pairs if cost[i, j] < FORBIDDEN]
    ties = [
        f"{other[i][0][0]}: modes {', '.join(str(own[k][0][0]) for k in even[i])} are equally near"
        f"; {own[j][0][0]} is paired"
        for i, j in pairs
        if j in even[i] and len(even[i]) > 1
    ]
    none, left, right = (None,) * 3, {i for i, _ in pairs}, {j for _, j in pairs}
    rows: list[Any] = []
    for i, j in pairs:
        likeness = None if np.isnan(alike[i, j]) else float(alike[i, j])
        rows.append((*other[i][0], *own[j][0], 100 * float(apart[i, j]), likeness))
    rows += [(*heads, *none) for i, (heads, _) in enumerate(other) if i not in left]
    rows += [(*none, *heads) for j, (heads, _) in enumerate(own) if j not in right]
    return Pairs(name, tuple(Pair(*row) for row in rows), tolerance, alike, tuple(ties))


def _modes(answer: Eigenvalues, where: Coordinates | None) -> list[Mode]:
    """The modes that vibrate, with displacements of nodes if these are known, else of all rows."""
    upper = [(k, root, root.right) for k, root in answer.of_modes if root.value.imag > 0.0]
    return [
        ((k, root.frequency_hz, root.damping_ratio), where.displacements(x).ravel() if where else x)
        for k, root, x in upper
    ]


def read_test(path: Path, where: Coordinates | None) -> list[Mode]:
    """The modes of a table, with shapes as displacements of nodes. Raises InputError."""
    rows: dict[tuple[str, int], int] = {}
    if where is not None:
        ways = zip(where.nodes.tolist(), where.directions.tolist(), strict=True)
        rows = {(where.names[k].lower(), way): 3 * k + way for k, way in ways if way >= 0}
    modes: dict[str, Mode] = {}
    for here, line in read_table(path, ("frequency_hz",))[1]:
        line = {key: cell for key, cell in line.items() if key not in BESIDE}
        if number_in(line.pop("imag [rad/s]", "1"), here / "imag") <= 0.0:
            continue  # the other of a pair, or no vibration
        name, damping = line.pop("mode", ""), line.pop(DAMPING, "")
        name = line.pop("name", name).strip()
        if not name or name in modes:
            raise (here / "name").must_be(name, "a name that no other line has")
        frequency = number_in(line.pop("frequency_hz"), here / "frequency_hz", POSITIVE)
        ratio = number_in(damping, here / DAMPING) if damping.strip() else None
        shape = np.full(3 * len(where.places) if where else 0, np.nan, dtype=complex)
        for head, cell in line.items():
            node, _, dof = str(head).rpartition(":")
            row = rows.get((node.strip(), DIRECTIONS.get(dof.strip(), -1)))
            if row is None:
                allowed = "NODE:DOF of a node with coordinates that x, y or z moves"
                raise (here / head).must_be(head, allowed)
            if cell.strip():
                with suppress(ValueError):
                    shape[row] = complex(cell.strip())
                if not np.isfinite(shape[row]):
                    raise (here / head).must_be(cell, "a finite number such as 0.3 or 0.3+0.1j")
        modes[name] = (name, frequency, ratio), shape
    return list(modes.values())
