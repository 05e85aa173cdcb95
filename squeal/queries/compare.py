"""Modes of an answer paired with those of another one, or of a test, by frequency and by MAC."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from squeal.errors import InputError
from squeal.io.coordinates import DIRECTIONS, NO_DIRECTION, Coordinates
from squeal.io.tables import number_in, read_table
from squeal.io.writing import Answer, Column, Panel, Table, columns
from squeal.linear.continuation import Bools
from squeal.linear.labels import labels_of
from squeal.linear.matrices import Array, dense, given_matrix
from squeal.linear.roots import ComplexArray
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sources import SystemSource
from squeal.schema import POSITIVE, Place, Positive, public

FORBIDDEN = 1e6  # cost of a pair beyond the tolerance
EQUALLY_NEAR = 2e-4  # of the frequency: a difference too small to prefer one of two modes
TIE = 0.01  # the largest cost of such a difference: modes whose MAC differs by more are told apart
DAMPING = "damping_ratio"
IGNORED = ("real [1/s]", "error [1/s]", "residual", "condition")  # columns of saved eigenvalues


def mac(X: ArrayLike, Y: ArrayLike) -> Array:
    """Modal assurance criterion of shapes, 1 for equal ones whatever their scale and phase.

    Parameters
    ----------
    X, Y : array_like (n, m), (n, k)
        Shapes as columns, or one shape (n,), real or complex.

    Returns
    -------
    array (m, k)
        `|x^H y|^2 / (x^H x  y^H y)`.

    Raises
    ------
    InputError
        For a shape of zeros, or rows that are not the same: by number, or by their labels (pandas).

    Examples
    --------
    >>> mac([[1, 1], [1, -1]], [[2j], [0]]).round(3).tolist()
    [[0.5], [0.5]]
    """
    unit_shapes = []
    row_labels = []
    for name, Z in {"X": X, "Y": Y}.items():
        in_columns = Z
        if hasattr(Z, "to_frame"):  # a series (pandas), which has labels as a data frame does
            in_columns = Z.to_frame()
        elif np.ndim(Z) == 1:
            in_columns = np.asarray(Z)[:, None]
        labels = labels_of(in_columns)
        if labels:
            row_labels.append(labels[0])  # labels[1] are those of the columns
        shapes = dense(given_matrix(in_columns, f"mac: {name}"))
        if not shapes.any(axis=0).all():
            raise InputError(f"mac: {name}: a shape of zeros is not allowed; each must move")
        scaled = shapes / np.abs(shapes).max(axis=0)  # squares neither overflow nor vanish
        unit_shapes.append(scaled / np.linalg.norm(scaled, axis=0))
    if len(row_labels) == 2 and row_labels[0] != row_labels[1]:
        raise InputError("mac: X and Y: other labels of their rows are not allowed; reindex one")
    x, y = unit_shapes
    if len(x) != len(y):
        raise InputError(f"mac: {len(x)} and {len(y)} rows are not allowed; they must be the same")
    return np.abs(x.conj().T @ y) ** 2


class Mode(NamedTuple):
    """A mode that vibrates.

    name: of a test, or the number of a computed mode; shape: displacements along x, y and z of each
    node (3 nodes,), or of all rows (n,) where no nodes are known; NaN where it was not measured.
    """

    name: str | int
    frequency_hz: float
    damping: float | None
    shape: ComplexArray


class Pair(NamedTuple):
    """A mode of the reference and the computed one, None where it has none; the difference in
    frequency (% of the reference) and the MAC, if shapes are known."""

    reference: str | int | None = None
    reference_hz: float | None = None
    reference_damping: float | None = None
    mode: str | int | None = None
    frequency_hz: float | None = None
    damping_ratio: float | None = None
    difference: float | None = None
    mac: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Pairs(Answer):
    """Modes paired with those of `reference`, then those left over on both sides.

    mac: of each mode of the reference with each computed one (m, k); tolerance: the largest
    difference of a pair, of the frequency; warnings: which modes are equally near one of the
    reference.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
    >>> still = squeal.System([[1, 0], [0, 1]], K=K)
    >>> pairs = squeal.compare(squeal.eigenvalues(still), squeal.eigenvalues(still))
    >>> [(pair.mode, round(pair.mac, 9)) for pair in pairs.pairs]
    [(1, 1.0), (2, 1.0)]
    """

    panel = Panel("reference_hz", "frequency_hz")

    reference: str
    pairs: tuple[Pair, ...]
    tolerance: float
    mac: Array = field(repr=False)
    warnings: tuple[str, ...] = ()

    @property
    def names(self) -> dict[int, str]:
        """The names that the reference gives computed modes, by their numbers."""
        pairs = self.pairs
        return {int(p.mode): str(p.reference) for p in pairs if p.mode and p.reference}

    def table(self) -> Table:
        all_columns = (
            *columns("reference reference_hz mode frequency_hz"),
            Column("difference", "%"),
            *columns(f"mac reference_damping% {DAMPING}%"),
        )
        title = f"modes paired with {self.reference}, within {100 * self.tolerance:g} %"
        return Table(all_columns, self.pairs, title, "no mode")

    def to_dict(self) -> dict[str, Any]:
        return {"tolerance": self.tolerance, "pairs": [pair._asdict() for pair in self.pairs]}


@public
def compare(
    computed: Eigenvalues, reference: Eigenvalues | Path | str, tolerance: Positive = 0.1
) -> Pairs:
    """Pair the modes of an answer with those of another one, or with test frequencies.

    All pairs are assigned together, so that the sum of their costs is least: the difference in
    frequency over the tolerance, plus 1 - MAC where shapes are known. Where several computed modes
    are equally near to a mode of the reference, a growing one is preferred if the reference mode
    grows or has no known damping, since tests measure what squeals. Each such tie is a warning.

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
        For another number of rows, names that stand twice, frequencies that are no numbers above 0,
        and shapes at nodes without coordinates.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 1], [0, 0]]}
    >>> chain = squeal.System([[1, 0], [0, 1]], K=K)
    >>> both = (squeal.eigenvalues(chain, at) for at in (0.0, 0.1))
    >>> [(pair.mode, round(pair.mac, 3)) for pair in compare(*both).pairs]
    [(1, 0.999), (2, 0.999)]
    """
    coordinates = None
    if isinstance(computed.source, SystemSource):
        coordinates = computed.source.file.coordinates
    modes = _modes(computed, coordinates)
    if isinstance(reference, Eigenvalues):
        _check_rows(reference, computed)
        references = []
        for mode in _modes(reference, coordinates):
            references.append(mode._replace(name=str(mode.name)))
        title = f"{reference.name}, {reference.parameter} = {reference.value:.6g}"
    else:
        references = read_test(Path(reference), coordinates)
        title = str(reference)
    costs = pairing_costs(references, modes, tolerance)
    # of each mode of the reference the computed modes that are equally near, as indices
    equally_near = _equally_near(costs.cost, most=_cost_of_tie(tolerance))
    rows = []
    ties = []  # sentences on modes that are equally near
    pairs = assigned_pairs(costs, references, modes, tolerance)  # as indices
    for i, j in pairs:
        mac_of_pair = None
        if not np.isnan(costs.mac[i, j]):
            mac_of_pair = float(costs.mac[i, j])
        pair = _pair(references[i], modes[j])
        rows.append(pair._replace(difference=100 * float(costs.difference[i, j]), mac=mac_of_pair))
        if len(equally_near[i]) > 1 and j in equally_near[i]:
            numbers = ", ".join(str(modes[k].name) for k in equally_near[i])
            ties.append(
                f"{references[i].name}: modes {numbers} are equally near; {modes[j].name} is paired"
            )
    paired_references = {i for i, _ in pairs}
    for i, mode in enumerate(references):
        if i not in paired_references:
            rows.append(_pair(mode, None))
    paired_modes = {j for _, j in pairs}
    for j, mode in enumerate(modes):
        if j not in paired_modes:
            rows.append(_pair(None, mode))
    return Pairs(title, tuple(rows), tolerance, costs.mac, tuple(ties))


def _cost_of_tie(tolerance: float) -> float:
    """The difference in cost up to which two computed modes are equally near, see `compare`."""
    return min(EQUALLY_NEAR / tolerance, TIE)


class PairingCosts(NamedTuple):
    """Of each mode of a reference (row) with each computed mode (column), arrays (m, k).

    difference: computed frequency less that of the reference, as a share of the latter or, where
    that is 0, of the computed one; mac: NaN where no shape is known; cost: of the pair, see
    `pairing_costs`.
    """

    difference: Array
    mac: Array
    cost: Array


def pairing_costs(
    references: Sequence[Mode], modes: Sequence[Mode], tolerance: float
) -> PairingCosts:
    """What pairs cost: their difference in frequency over the tolerance, plus 1 - MAC if known."""
    reference_hz = np.array([mode.frequency_hz for mode in references], float)[:, None]  # a column
    computed_hz = np.array([mode.frequency_hz for mode in modes], float)  # a row
    # the frequency that a difference is a share of; two modes of frequency 0 do not differ
    size = np.where(reference_hz > 0.0, reference_hz, computed_hz)
    difference = (computed_hz - reference_hz) / np.where(size > 0.0, size, 1.0)
    macs = _mac_of_modes(references, modes)
    unlikeness = np.where(np.isnan(macs), 0.0, 1.0 - macs)
    return PairingCosts(difference, macs, np.abs(difference) / tolerance + unlikeness)


def assigned_pairs(
    costs: PairingCosts, references: Sequence[Mode], modes: Sequence[Mode], tolerance: float
) -> list[tuple[int, int]]:
    """The pairs (i, j) of references[i] and modes[j] within the tolerance that cost least in sum.

    A linear assignment problem. A pair of one growing and one decaying mode costs more by
    `_cost_of_tie`, so that of equally near pairs one whose modes both grow or both decay is taken.
    """
    differs_in_growth = _counts_as_growing(references)[:, None] != _counts_as_growing(modes)
    cost = costs.cost + _cost_of_tie(tolerance) * differs_in_growth
    cost = np.where(np.abs(costs.difference) <= tolerance, cost, FORBIDDEN)
    assigned = np.transpose(linear_sum_assignment(cost)).tolist()
    return [(i, j) for i, j in assigned if cost[i, j] < FORBIDDEN]


def _pair(reference: Mode | None, mode: Mode | None) -> Pair:
    """A row of a mode of the reference and a computed one, either of which may be missing."""
    pair = Pair()
    if reference is not None:
        pair = pair._replace(
            reference=reference.name,
            reference_hz=reference.frequency_hz,
            reference_damping=reference.damping,
        )
    if mode is not None:
        pair = pair._replace(
            mode=mode.name, frequency_hz=mode.frequency_hz, damping_ratio=mode.damping
        )
    return pair


def _check_rows(reference: Eigenvalues, computed: Eigenvalues) -> None:
    """Refuse answers whose shapes have different numbers of rows. Raises InputError."""
    # all roots of an answer have as many rows; two answers may have different numbers of roots
    for root, other in zip(reference.eigenvalues, computed.eigenvalues, strict=False):
        if root.right.shape != other.right.shape:
            rows = f"{len(root.right)} and {len(other.right)} rows"
            raise InputError(f"compare: {rows} are not allowed; they must be the same")


def _mac_of_modes(references: Sequence[Mode], modes: Sequence[Mode]) -> Array:
    """MAC (m, k) of each of m modes of the reference with each of k computed ones.

    It is taken over the rows that were measured in the mode of the reference, whose shape is NaN in
    the others. It is NaN for a pair of which one shape is zero in all measured rows.
    """
    macs = np.full((len(references), len(modes)), np.nan)
    for i, reference in enumerate(references):
        measured = ~np.isnan(reference.shape)
        if not reference.shape[measured].any():
            continue
        moving = [j for j, mode in enumerate(modes) if mode.shape[measured].any()]
        if moving:
            shapes = np.array([modes[j].shape[measured] for j in moving]).T
            macs[i, moving] = mac(reference.shape[measured, None], shapes)
    return macs


def _equally_near(cost: Array, most: float) -> list[NDArray[np.int64]]:
    """For each mode of the reference the computed modes that cost at most `most` above the least.

    cost (m, k): of pairs, a row for each mode of the reference. Modes are indices of columns. Where
    there are no computed modes the list is empty: no row has a least cost, and no mode a partner.
    """
    if not cost.shape[1]:
        return []
    return [np.flatnonzero(np.abs(row - row.min()) <= most) for row in cost]


def _counts_as_growing(modes: Sequence[Mode]) -> Bools:
    """Whether each mode (m,) grows. One of unknown damping counts: tests measure what squeals."""
    return np.array([mode.damping is None or mode.damping < 0.0 for mode in modes])


def _modes(answer: Eigenvalues, coordinates: Coordinates | None) -> list[Mode]:
    """The modes that vibrate, with shapes at the nodes of `coordinates`, else of all rows."""
    modes = []
    for number, root in answer.of_modes:
        if root.value.imag > 0.0:
            shape = root.right
            if coordinates is not None:
                shape = coordinates.displacements(root.right).ravel()
            modes.append(Mode(number, root.frequency_hz, root.damping_ratio, shape))
    return modes


def read_test(path: Path, coordinates: Coordinates | None) -> list[Mode]:
    """Read the modes of a table .csv, each line one mode, with shapes at the nodes, see `Mode`.

    The table may be that of saved `Eigenvalues`, which has a line for each root. Lines with an
    imaginary part that is not positive are skipped there: the second root of a pair, and roots that
    do not vibrate. coordinates: of the nodes that the heads NODE:DOF name, None if there are none.
    Raises InputError.
    """
    entries = _entries_of_shapes(coordinates)
    size = 0
    if coordinates is not None:
        size = 3 * len(coordinates.places)
    modes: dict[str, Mode] = {}
    _, lines = read_table(path, ("frequency_hz",))
    for here, line in lines:
        cells = {head: cell for head, cell in line.items() if head not in IGNORED}
        # the table of a test has no column of imaginary parts: all of its lines are modes, and "1"
        # stands for a positive imaginary part
        if number_in(cells.pop("imag [rad/s]", "1"), here / "imag") <= 0.0:
            continue
        damping = cells.pop(DAMPING, "")
        number = cells.pop("mode", "")
        name = cells.pop("name", number)
        if not name or name in modes:
            raise (here / "name").must_be(name, "a name that no other line has")
        frequency = number_in(cells.pop("frequency_hz"), here / "frequency_hz", POSITIVE)
        ratio = None
        if damping:
            ratio = number_in(damping, here / DAMPING)
        # all other columns, NODE:DOF, were left in `cells`
        shape = _read_shape(cells, here, entries, size)
        modes[name] = Mode(name, frequency, ratio, shape)
    return list(modes.values())


def _entries_of_shapes(coordinates: Coordinates | None) -> dict[tuple[str, int], int]:
    """The index in the shape (3 nodes,) of a mode, by name of a node and direction (0 to 2)."""
    entries: dict[tuple[str, int], int] = {}
    if coordinates is None:
        return entries
    nodes = coordinates.nodes.tolist()
    for node, direction in zip(nodes, coordinates.directions.tolist(), strict=True):
        if direction >= 0:  # not a rotation
            entries[coordinates.names[node].lower(), direction] = 3 * node + direction
    return entries


def _read_shape(
    cells: Mapping[str, str], here: Place, entries: Mapping[tuple[str, int], int], size: int
) -> ComplexArray:
    """A shape (size,) from cells under heads NODE:DOF, NaN where a cell is empty or missing.

    A cell "0.3+0.1j" under the head "12:z" is the entry of node 12 in direction 2. entries: the
    index in the shape by the name of a node and its direction (0 to 2 for x, y, z). Raises
    InputError.
    """
    shape = np.full(size, np.nan, dtype=complex)
    for head, cell in cells.items():
        node_name, _, dof = str(head).rpartition(":")
        entry = entries.get((node_name.strip(), DIRECTIONS.get(dof.strip(), NO_DIRECTION)))
        if entry is None:  # an unknown node, or a rotation or an unknown word as direction
            allowed = "NODE:DOF of a node with coordinates that x, y or z moves"
            raise (here / head).must_be(head, allowed)
        if cell:
            with suppress(ValueError):  # the entry remains NaN, which is refused below
                shape[entry] = complex(cell)
            if not np.isfinite(shape[entry]):
                raise (here / head).must_be(cell, "a finite number such as 0.3 or 0.3+0.1j")
    return shape
