"""Which roots of a system are asked for, and what it takes to get them."""

import dataclasses
from dataclasses import dataclass

from squeal.errors import ComputationError, InputError
from squeal.io.processes import available_memory
from squeal.linear.system import TermSystem
from squeal.schema.values import Instance, Place, Row, Whole
from squeal.sparse.argument_principle import Disc, Rectangle, band

ALL_ROWS = 400  # up to so many rows all roots are computed
MODES = 20  # of a larger system where nothing else is asked for

TERMS = Instance(TermSystem, "a TermSystem, such as that of `read_system`")
BAND = Row(2)
REGION = Instance(Rectangle, "a Rectangle")
MODES_ASKED = Whole(1, 10**6)


@dataclass(frozen=True)
class Wanted:
    """Roots of a band (Hz) or of a region, or the lowest ones; of a band the lowest `modes`.

    Raises InputError when made with a band and a region, or with what is none.
    """

    band: tuple[float, float] | None = None
    region: Rectangle | None = None
    modes: int | None = None

    def __post_init__(self) -> None:
        if self.band is not None and self.region is not None:
            raise InputError("band, region: one of them is allowed")
        at = Place("Wanted")
        if self.band is not None:
            band(*BAND.read(self.band, at / "band"))
        if self.region is not None:
            REGION.read(self.region, at / "region")
        if self.modes is not None:
            MODES_ASKED.read(self.modes, at / "modes")

    @property
    def rectangle(self) -> Rectangle | None:
        """The region, or that of the band; None if neither is given.

        What begins or ends on the real axis holds it.
        """
        found = self.region
        if self.band is not None:
            found = band(*self.band)
        if found is None or (found.low_imag and found.high_imag):
            return found
        edge = 1e-6 * max(found.high_imag, -found.low_imag)
        low, high = found.low_imag or -edge, found.high_imag or edge
        return Rectangle(found.low_real, found.high_real, low, high)

    def words(self) -> str:
        """The same in words, for people."""
        if self.band is not None:
            return f"{self.band[0]:g} to {self.band[1]:g} Hz"
        if self.region is not None:
            r = self.region
            return f"{r.low_real:g} < Re < {r.high_real:g}, {r.low_imag:g} < Im < {r.high_imag:g}"
        return "all" if self.modes is None else f"the lowest {self.modes}"


def is_small(system: TermSystem) -> bool:
    """True if all roots of a system are computed."""
    return system.n <= ALL_ROWS


def needed_memory(system: TermSystem) -> float:
    """Estimate of the memory (bytes) that one factorisation and one subspace take.

    Measured on three-dimensional solids; a full matrix takes what its entries need.
    """
    largest = max(_entries(t.matrix) for part in (system.M, system.C, system.K) for t in part)
    full, subspace = 16.0 * system.n**2, 16 * 2 * 180
    return min(full, 18.0 * largest * system.n ** (1 / 3)) + subspace * system.n


def _entries(matrix: object) -> int:
    return int(getattr(matrix, "nnz", getattr(matrix, "size", 0)))


def check_memory(system: TermSystem, limit: float | None = None) -> None:
    """Refuse what does not fit into `limit` bytes (left out: what the machine has free).

    Raises ComputationError.
    """
    needed = needed_memory(system)
    free = available_memory() if limit is None else limit
    if needed > free:
        raise ComputationError(
            f"{system.n} rows need about {needed / 1e9:.2g} GB for a factorisation, and "
            f"{free / 1e9:.2g} GB are free; --memory GB allows more, fewer rows need less"
        )


def extent(region: Rectangle | Disc | None) -> dict[str, float] | None:
    """A region for the JSON object; None stands for the whole plane."""
    if region is None:
        return None
    return {"radius": region.radius} if isinstance(region, Disc) else dataclasses.asdict(region)
