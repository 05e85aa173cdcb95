"""The stability chapter's numbers beside those of `loci` and `angles`."""

from squeal.article.results.loci import Branch, Loop, SingleLoop
from squeal.article.results.records import Missing, Record, Result

READ, DERIVED, MATRICES = "read in a copy", "derived", "from the matrices"
"""How the expected numbers of the literature are known."""


class Thresholds(Record):
    """Thresholds of a pad along its branch, and with the equilibrium held."""

    model: str
    branch: Branch | Missing
    loop: SingleLoop | Loop


class Growth(Record):
    """Growth rates and frequencies fitted to simulations over mu, beside the predicted ones.

    predicted, fitted: real and imaginary part (1/s, rad/s) at each mu; apart: their greatest
    relative difference.
    """

    name: str
    alpha1: float
    alpha2: float
    mu: tuple[float, ...]
    predicted: tuple[tuple[float, float], ...]
    fitted: tuple[tuple[float, float], ...]
    apart: float


class Comparison(Record):
    """A number of the literature and what the toolkit makes of it, as text.

    error: relative, None where only one of the two exists; provenance: how the expected number is
    known.
    """

    name: str
    quantity: str
    expected: str
    computed: str
    error: float | None
    agrees: bool
    provenance: str


class Stability(Result):
    """advice: by name of the scene; fluttering: a pad that flutters, None if no angles make
    one or the scene itself does."""

    advice: dict[str, str]
    fluttering: Thresholds | None
    growth: tuple[Growth, ...]
    literature: tuple[Comparison, ...]
