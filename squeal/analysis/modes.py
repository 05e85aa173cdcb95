"""Mode shapes, and modes followed over the friction with all that happens on the way."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from squeal.analysis.eigenvalues import Analysis, branch_system
from squeal.equilibrium import Path
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.linear import Crossing, Spectrum, System, thresholds, track, verdict
from squeal.linear.system import check_system
from squeal.schema.values import Instance, Number, takes

PAD_COORDINATES = ("x", "y", "theta")
FINE, COARSE = 201, 81  # values of mu that a sweep looks at, of small and of larger systems
SMALL = 10  # degrees of freedom


@dataclass(frozen=True, eq=False)
class ModeShape:
    """The shape (n,) of one mode: complex, its largest entry 1 once each is times its lever.

    number: by rising frequency, from 1; a pair of eigenvalues is one mode.
    """

    number: int
    frequency_hz: float
    growth_rate: float
    shape: np.ndarray = field(repr=False)


@takes(spectrum=Instance(Spectrum, "a Spectrum, such as that of an Analysis"))
def mode_shapes(spectrum: Spectrum, levers: Sequence[float] = ()) -> tuple[ModeShape, ...]:
    """The shape of each mode: of a pair of eigenvalues, and of half of the real ones.

    levers (n,): lengths that make the coordinates comparable, (1, 1, w) of a pad; 1 if left out.
    Of the real eigenvalues those that grow faster are taken.
    """
    size = np.asarray(levers) if len(levers) else 1.0
    found = []
    real = [e for e in spectrum.eigenvalues if e.value.imag == 0.0]
    pairs = [e for e in spectrum.eigenvalues if e.value.imag > 0.0]
    real.sort(key=lambda e: -e.growth_rate)
    for number, e in enumerate([*real[: (len(real) + 1) // 2], *pairs], 1):
        seen = size * e.right
        shape = e.right / seen[int(np.argmax(np.abs(seen)))]
        found.append(ModeShape(number, e.frequency_hz, e.growth_rate, shape))
    return tuple(found)


def shapes_of_pad(analysis: Analysis, w: float) -> tuple[ModeShape, ...]:
    """Mode shapes (x, y, theta) of a pad of half length w, the largest of x, y, w theta 1 m."""
    return mode_shapes(analysis.spectrum, (1.0, 1.0, w))


@dataclass(frozen=True, eq=False)
class ModeSweep:
    """Modes followed over a parameter from low to high, and what happens on the way.

    mus (k,); values (k, 2n) rad/s, of which columns 2j and 2j + 1 are a mode and its conjugate, by
    rising frequency at the start; spans: (from, to, verdict) between the thresholds; crossings of
    the imaginary axis; contacts: (mu, state) where the contact changes; end: how far the branch
    reaches.
    """

    parameter: str
    low: float
    high: float
    end: float
    mus: np.ndarray = field(repr=False)
    values: np.ndarray = field(repr=False)
    spans: tuple[tuple[float, float, str], ...]
    crossings: tuple[Crossing, ...]
    contacts: tuple[tuple[float, str], ...]


@takes(low=Number(), high=Number())
def sweep_modes(subject: Scene | System, low: float, high: float, name: str = "mu") -> ModeSweep:
    """Follow the modes of a scene (along its branch from mu = 0) or system from low to high.

    Raises InputError unless low < high, and 0 <= low for a scene, ComputationError if a scene has
    no equilibrium without friction, or its branch ends before `low`.
    """
    if not isinstance(subject, Scene):
        check_system(subject, "sweep_modes", "a Scene or ")
    if not low < high or (isinstance(subject, Scene) and low < 0.0):
        raise InputError(
            f"sweep_modes: low {low:g} and high {high:g} are not allowed; it must be low < high, "
            "and 0 <= low for a scene"
        )
    path = None
    if isinstance(subject, Scene):
        system, path = branch_system(subject, high)
    else:
        system = subject
    end = high if path is None else min(high, path.mu_end)
    if path is not None and end <= low:
        path.at(low)  # refuses, with the reason
    breaks = [] if path is None else [mu for mu in path.breakpoints if low < mu < end]
    stop = end * (1.0 - 1e-9) if path is not None and path.fold == end else end
    found = thresholds(system, stop, breaks, low)
    edges = [low, *(p.mu for p in found.points if low < p.mu < stop), stop]
    spans = [(a, b, verdict(*system((a + b) / 2))) for a, b in itertools.pairwise(edges) if b > a]
    n = len(np.asarray(system(low)[0]))
    marked = [*edges, *(c.mu for c in found.crossings)]
    steps = values_of_mu(path, low, stop, marked, FINE if n <= SMALL else COARSE)
    tracked = track(system, steps, halvings=7 if n <= SMALL else 2)
    changes = tuple((mu, _state(path, mu)) for mu in breaks)
    way = (tracked.mus, tracked.values, tuple(spans))
    return ModeSweep(name, low, high, end, *way, tuple(found.crossings), changes)


def _state(path: Path | None, mu: float) -> str:
    assert path is not None
    return path.model.state_name(path.at(mu)[1])


def values_of_mu(
    path: Path | None, low: float, high: float, marked: Sequence[float], count: int
) -> np.ndarray:
    """Where modes are looked at: `count` values from low to high, and marked values among them.

    Towards a fold the values crowd, since a frequency falls there as a fourth root; the fold
    itself, where the linearisation is singular, is left out by 1e-9. A contact change is looked at
    from both sides.
    """
    share = np.linspace(0.0, 1.0, count)
    breaks: list[float] = []
    if path is not None:
        breaks = path.breakpoints
        if path.fold is not None and path.fold <= high * (1.0 + 1e-8):
            share = (1.0 - (1.0 - share) ** 2) * (1.0 - 1e-9)
            high = path.fold
    grid = low + (high - low) * share
    before = [math.nextafter(mu, 0.0) for mu in breaks]
    extra = [mu for mu in [*marked, *breaks, *before] if low <= mu <= grid[-1]]
    return np.unique(np.concatenate([grid, extra]))
