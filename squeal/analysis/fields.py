"""Numbers over two parameters: critical friction, growth rate and frequency, for contour maps."""

import math
from dataclasses import dataclass

import numpy as np

from squeal.analysis.critical import MU_MAX
from squeal.analysis.maps import AXES, Axis, codes_at
from squeal.analysis.points import Points, normalised, points_at
from squeal.errors import InputError
from squeal.io.scene import Scene, takes_scene
from squeal.linear import VERDICTS
from squeal.linear.matrices import first_order
from squeal.schema.arguments import takes

LEVELS = 64  # of mu at which the verdicts of all points are taken; windows between are not seen
HALVINGS = 44  # of the interval in which stability is lost: to 1e-13 of mu_max
COARSE = 12  # of them are made with steps of mu that may be too long for an equilibrium near a fold
QUIET = [VERDICTS.index(name) for name in ("stable", "marginal")]
QUANTITIES = {
    "critical-friction": ("critical friction", "1"),
    "growth": ("growth rate of the most unstable mode", "1/s"),
    "frequency": ("frequency of the most unstable mode", "Hz"),
}
"""What a field may show: its name in words, and its unit."""


@dataclass(frozen=True, eq=False)
class Field:
    """A quantity over two parameters; values (n1, n2), NaN where there is none.

    There is no critical friction where stability lasts up to mu_max, no growth rate where there
    is no equilibrium, and no frequency where nothing grows.
    """

    quantity: str
    axes: tuple[Axis, Axis]
    values: np.ndarray

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return QUANTITIES[self.quantity][1]


@takes_scene
@takes(axes=AXES, mu_max=MU_MAX)
def field(scene: Scene, axes: tuple[Axis, Axis], quantity: str, mu_max: float = 2.0) -> Field:
    """One of `QUANTITIES` over two parameters, which replace the scene's.

    Growth and frequency are taken at the scene's mu (or that of the axis), the critical friction
    is the first loss of stability, or of the equilibrium, on the way from mu = 0 up to mu_max.
    Raises InputError for another quantity, and for a critical friction over mu itself.
    """
    if quantity not in QUANTITIES:
        raise InputError(
            f"quantity: {quantity} is not allowed; it must be one of {', '.join(QUANTITIES)}"
        )
    names = (axes[0].name, axes[1].name)
    if quantity == "critical-friction" and "mu" in names:
        raise InputError(
            "quantity: critical-friction is not allowed over mu; take another parameter, or the "
            "map of verdicts"
        )
    grid = np.meshgrid(axes[0].values, axes[1].values, indexing="ij")
    values = np.array([part.ravel() for part in grid])
    if quantity == "critical-friction":
        found = first_losses(scene, names, values, mu_max)
    else:
        at = points_at(scene, names, values)
        fastest = most_unstable(at)
        found = np.full(values.shape[1], np.nan)
        grows = fastest.real > 0.0
        rate = fastest.real if quantity == "growth" else np.abs(fastest.imag) / (2 * math.pi)
        found[at.there] = rate if quantity == "growth" else np.where(grows, rate, np.nan)
    return Field(quantity, axes, found.reshape(grid[0].shape))


def most_unstable(at: Points) -> np.ndarray:
    """Of each pad with an equilibrium the eigenvalue (m,) of largest real part, in rad/s.

    Without damping, real parts of the size of rounding, next to a coalescence the square root of
    it, are zero.
    """
    A = normalised(at.pads, at.K)
    n = len(A)
    if at.B is None:
        s = np.linalg.eigvals(A).astype(complex)
        values = np.sqrt(-s)
        values = np.where(values.real < 0.0, -values, values)
        size = np.abs(values).max(axis=1, keepdims=True)
        values.real[values.real <= 1e-8 * size] = 0.0
    else:
        values = np.linalg.eigvals(first_order(A, at.B, 1.0)[0]).astype(complex)
    # of several that grow alike the one of largest frequency
    best = np.lexsort((np.abs(values.imag), values.real), axis=1)[:, -1]
    return np.asarray(values[np.arange(n), best] * at.rate)


def first_losses(
    scene: Scene, names: tuple[str, ...], values: np.ndarray, mu_max: float
) -> np.ndarray:
    """The least mu (n,) at which each pad grows or has no equilibrium; NaN above mu_max.

    All pads are followed from mu = 0 together over `LEVELS` values of mu, each from its own last
    equilibrium; the first interval with a change is then halved. A fold is met to some 1e-6.
    """
    n = values.shape[1]
    low, high = np.zeros(n), np.full(n, np.nan)
    places = np.zeros((4, n))

    def quiet(index: np.ndarray, mu: np.ndarray, near: bool) -> np.ndarray:
        at = np.vstack([values[:, index], mu])
        found = codes_at(scene, (*names, "mu"), at, places[:, index] if near else None)
        calm = np.isin(found.codes, QUIET)
        if found.places is not None:
            places[:, index[calm]] = found.places[:, calm]
        return calm

    def surely_quiet(index: np.ndarray, mu: np.ndarray) -> np.ndarray:
        """As `quiet`, followed anew from mu = 0 where the step of mu may have been too long."""
        calm = quiet(index, mu, near=True)
        doubtful = ~calm
        if doubtful.any():
            calm[doubtful] = quiet(index[doubtful], mu[doubtful], near=False)
        return calm

    rest = np.arange(n)
    start = quiet(rest, np.zeros(n), near=False)
    high[~start] = 0.0
    active = rest[start]
    for mu in mu_max * np.arange(1, LEVELS + 1) / LEVELS:
        calm = surely_quiet(active, np.full(active.size, mu))
        high[active[~calm]] = mu
        active = active[calm]
        low[active] = mu
        if not active.size:
            break
    lost = np.flatnonzero(high > 0.0)
    for k in range(HALVINGS):
        middle = (low[lost] + high[lost]) / 2
        calm = surely_quiet(lost, middle) if k < COARSE else quiet(lost, middle, near=True)
        low[lost[calm]], high[lost[~calm]] = middle[calm], middle[~calm]
    return high
