"""What is proved of the roots of a system: pieces of the plane that hold so many of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.proof.balls import EPS, Floats

Side = Literal["grows", "decays", "axis", "free", "unknown"]
Means = Literal["enclosure", "exact"]
INFINITE = "an entry is not finite"


@dataclass(frozen=True, eq=False)
class Piece:
    """A union of discs that holds exactly as many roots (rad/s) as it has discs.

    Attributes
    ----------
    centres, radii : ndarray (k,)
        The discs.
    low, high : float
        Bounds of the real parts of all these roots, 1/s.
    side : str
        What each of these roots does: `grows`, `decays`, lies on the imaginary `axis`, is `free`,
        that is zero within what the data allow, or `unknown`. It may be known although `low` and
        `high` do not show it.
    real : bool or None
        Whether they are real, None if that is not known.
    by : str
        Which means proves it.
    """

    centres: NDArray[np.complex128]
    radii: Floats
    low: float
    high: float
    side: Side
    real: bool | None
    by: Means = "enclosure"

    @property
    def count(self) -> int:
        """How many roots it holds."""
        return len(self.centres)

    @property
    def is_sharp(self) -> bool:
        """True if nothing is left to say but where in its disc the root lies."""
        return self.count == 1 and self.side != "unknown"

    def distance_bound(self, value: complex) -> float:
        """A bound of the distance of a value from each root of the piece, rad/s."""
        farthest = np.max(np.abs(value - self.centres) + self.radii)
        return float(np.nextafter(farthest * (1.0 + 8.0 * EPS), np.inf))


class Tally(NamedTuple):
    """So many roots whose real parts lie between two bounds (1/s), and what they do."""

    number: int
    low: float
    high: float
    side: Side


@dataclass(frozen=True, eq=False)
class Failure:
    """Why the roots of a component are not enclosed."""

    reason: str


def touching(a: NDArray, radii_a: Floats, b: NDArray, radii_b: Floats) -> NDArray[np.bool_]:
    """Whether each disc around a (n,) may meet each around b (m,); infinite radii meet all."""
    least_distances = np.abs(a[:, None] - b) * (1.0 - 8.0 * EPS)
    return ~(least_distances > (radii_a[:, None] + radii_b) * (1.0 + 4.0 * EPS))


def strong_components(joined: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """Indices of each strong component of a directed graph, ascending.

    joined (n, n): entry (i, j) says that a link leads from i to j. Indices are of one component if
    each reaches the other. `reach` says which index leads to which over up to k links; its square
    says so of up to 2 k links, and it is squared until nothing changes.
    """
    n = len(joined)
    if not n:
        return []
    others = joined & ~np.eye(n, dtype=bool)
    # an index without a link to it, or without one from it, is a component by itself
    linked = np.flatnonzero(others.any(axis=0) & others.any(axis=1))
    reach = others[np.ix_(linked, linked)] | np.eye(len(linked), dtype=bool)
    while not reach.all():
        steps = reach.astype(np.float32)
        further = steps @ steps > 0.0  # of float32, whose product is fast; of Booleans it is not
        if np.array_equal(further, reach):
            break
        reach = further
    first = np.arange(n)  # the first index of the component of each index
    if len(linked):
        first[linked] = linked[(reach & reach.T).argmax(axis=1)]
    return [np.flatnonzero(first == index) for index in np.unique(first)]


def labels(parts: Sequence[NDArray[np.intp]], n: int) -> NDArray[np.intp]:
    """The number (n,) of the part that holds each index, of parts that hold each once."""
    label = np.empty(n, dtype=int)
    for number, part in enumerate(parts):
        label[part] = number
    return label


def clusters(centres: NDArray, radii: Floats) -> list[NDArray[np.intp]]:
    """Indices of the discs of each connected part of their union."""
    return strong_components(touching(centres, radii, centres, radii))


def pieces_of(
    centres: NDArray[np.complex128],
    radii: Floats,
    real: bool,
    hamiltonian: bool,
    real_squares: NDArray[np.bool_],
) -> list[Piece]:
    """The pieces of the discs of a system, each with what its mirror images prove.

    Of a real system a root's mirror image at the real axis is a root; of a Hamiltonian system that
    at the imaginary axis too. Where the image of a disc that holds one root meets no disc but this
    one, the root is its own image, and lies on the axis.

    Parameters
    ----------
    centres, radii : ndarray (n,)
        Discs that together hold all n roots, rad/s.
    real, hamiltonian : bool
        Whether the system is.
    real_squares : ndarray (n,)
        Of which discs the roots are known to have a real square, so that each is real or imaginary.
    """
    parts = clusters(centres, radii)
    label = labels(parts, len(centres))
    alone = np.bincount(label)[label] == 1  # whether each disc is a part by itself

    def are_own_images(images: NDArray[np.complex128]) -> NDArray[np.bool_]:
        """For each disc whether it is alone, and its one root equals its image."""
        meets = touching(images, radii, centres, radii)
        meets_others = meets & (label[:, None] != label)
        return alone & ~meets_others.any(axis=1)

    on_real_axis = np.zeros(len(centres), dtype=bool)
    if real:
        on_real_axis = are_own_images(centres.conj())
    on_imaginary_axis = np.zeros(len(centres), dtype=bool)
    if hamiltonian:
        on_imaginary_axis = are_own_images(-centres.conj())
    off_real = np.abs(centres.imag) > radii
    off_imaginary = np.abs(centres.real) > radii
    lows = np.nextafter(centres.real - radii, -np.inf)
    highs = np.nextafter(centres.real + radii, np.inf)
    pieces = []
    for part in parts:
        # a part whose root lies on an axis by its image has this disc alone
        first = part[0]
        have_real_squares = bool(real_squares[part].all())
        is_off_real = bool(off_real[part].all())
        is_off_imaginary = bool(off_imaginary[part].all())
        is_on_real_axis: bool | None = None
        if on_real_axis[first] or (have_real_squares and is_off_imaginary):
            is_on_real_axis = True
        elif is_off_real:
            is_on_real_axis = False
        low = float(lows[part].min())
        high = float(highs[part].max())
        side: Side = "unknown"
        if on_imaginary_axis[first] or (have_real_squares and is_off_real):
            side = "axis"
            low = 0.0
            high = 0.0
        elif low > 0.0:
            side = "grows"
        elif high < 0.0:
            side = "decays"
        pieces.append(Piece(centres[part], radii[part], low, high, side, is_on_real_axis))
    return pieces


def growing_counts(pieces: Sequence[Piece], rate: float = 0.0) -> tuple[int, int]:
    """The least and the largest number of roots that may grow faster than a rate (1/s)."""
    return growing_of([Tally(p.count, p.low, p.high, p.side) for p in pieces], rate)


def growing_of(tallies: Sequence[Tally], rate: float = 0.0) -> tuple[int, int]:
    """The least and the largest number of roots that may grow faster than a rate (1/s).

    The bounds of the real parts decide. At the rate 0 the side of a root decides too: mirror images
    may prove a side that the bounds do not show.
    """
    least = 0
    most = 0
    for number, low, high, side in tallies:
        surely_grow = low > rate or (rate == 0.0 and side == "grows")
        never_grow = high <= rate or (rate == 0.0 and side in ("axis", "decays"))
        if surely_grow:
            least += number
        if not never_grow:
            most += number
    return least, most
