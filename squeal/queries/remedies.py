"""Remedies: the least change of one parameter with which nothing grows.

Each parameter is lowered and raised in steps, the first step at which nothing grows is bisected,
and the change is rounded up and computed anew. Of a large system a reduced one is searched; what is
named was computed on the full one.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene
from squeal.io.system import SystemFile
from squeal.io.writing import number
from squeal.linear import UnstableMode
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.options import Band
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.parameter_space import Outcome, ParameterSpace, first_loss
from squeal.queries.thresholds import thresholds
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import DEGREE, Sensitivity
from squeal.results.sources import EigenvalueSelection, PadSource, SystemSource

MOST_STEPS = 25  # of 1 % or a degree: the largest change that is looked at
FEW_STEPS = (1, 2, 4, 8, 16, MOST_STEPS)  # where each costs much
DENSE_ROWS = 100  # up to which every step is looked at
BEST_ROWS = 40  # up to which the first loss is computed at every step
BISECTIONS = 10  # to a thousandth of a step
RETRIES = 4  # of a change that the full system does not confirm, each time a larger one
WIDER = 0.15  # of the ends of a band: a mode that a change moves out of it has not stopped
SAME_MODE = 0.1  # of the frequency: so near a growing root is one of a mode that grew before
BETTER = 1.02  # how much later stability is lost with a change that is worth naming


class Loss(NamedTuple):
    """Where stability is lost first with a change: value of the free parameter, None if nowhere up
    to `high`, what happens there, and its frequency in Hz."""

    value: float | None
    kind: str
    frequency_hz: float | None
    high: float

    def words(self, parameter: str) -> str:
        """Up to where nothing grows, and what follows."""
        if self.value is None:
            return f"up to {parameter} = {number(self.high, 4)}, where the search ends"
        text = f"up to {parameter} = {rounded(self.value, 4, math.floor)}, then {self.kind}"
        if self.frequency_hz:
            text += f" at {number(self.frequency_hz, 4)} Hz"
        return text


@dataclass(frozen=True)
class Change:
    """A parameter before and after a change of `count` steps, which are percent or degrees."""

    parameter: str
    before: float
    step: float
    unit: str
    count: float

    @property
    def after(self) -> float:
        """The changed value."""
        return self.before + self.count * self.step

    @property
    def verb(self) -> str:
        """Whether the parameter is raised or lowered."""
        return "raise" if self.after > self.before else "lower"

    @property
    def doing(self) -> str:
        """The verb as a noun."""
        return "raising" if self.verb == "raise" else "lowering"

    @property
    def about(self) -> str:
        """How large an estimated change is, rounded up."""
        return self.of(float(rounded(abs(self.count), 2, math.ceil))).size

    @property
    def size(self) -> str:
        """How large the change is, in words."""
        unit = self.unit
        if unit == "degrees" and abs(self.count) == 1.0:
            unit = "degree"
        return f"{number(abs(self.count), 3)} {unit}".rstrip()

    @property
    def values(self) -> str:
        """The values before and after, angles in degrees as their change is."""
        if self.unit == "degrees":
            before = number(self.before / DEGREE, 5)
            return f"from {before} to {number(self.after / DEGREE, 5)} degrees"
        return f"from {number(self.before, 5)} to {number(self.after, 5)}"

    def of(self, count: float) -> Change:
        """Another change of the same parameter."""
        return Change(self.parameter, self.before, self.step, self.unit, count)


@dataclass(frozen=True, eq=False)
class Remedy:
    """The least change of one parameter with which nothing grows.

    change: rounded up to two digits; computed: the eigenvalues with it; loss: where stability is
    lost first then; best, best_loss: the change up to `MOST_STEPS` to the same side with which it
    is lost latest, None where that is no later, or was not looked for.
    """

    change: Change
    computed: Eigenvalues
    loss: Loss
    best: Change | None = None
    best_loss: Loss | None = None

    @property
    def sentence(self) -> str:
        """What to change, by how much, and what that does."""
        change = self.change
        parameter = self.computed.parameter
        text = f"{change.verb.capitalize()} {change.parameter} by {change.size}, {change.values}."
        value = self.loss.value
        text += " With it nothing grows"
        if value is not None and value <= self.computed.value:
            text += f" at {parameter} = {number(self.computed.value, 4)}; below, stability is lost"
            text += f" from {parameter} = {number(value, 4)} on"
        else:
            text += f" {self.loss.words(parameter)}"
        if self.computed.verdict == "marginal":
            text += " (nothing damps this model)"
        text += "."
        if self.best is not None and self.best_loss is not None:
            limit = self.best.of(MOST_STEPS).size
            best = "the largest" if self.best.size == limit else self.best.size
            text += f" Of changes this way up to {limit}, {best} is best: "
            text += f"nothing grows {self.best_loss.words(parameter)}."
        return text


@dataclass(frozen=True)
class PartialEffect:
    """What a parameter does that cannot stop all modes.

    limit: how far it was changed, in words; stops: the least change that stops each growing mode,
    None where none does; left: frequencies in Hz that grow with the first of these changes.
    """

    parameter: str
    limit: str
    stops: tuple[Change | None, ...]
    left: tuple[float, ...]


class RemedySearch(NamedTuple):
    """The best remedy, and of each parameter that is none what it does to the modes that grow."""

    remedy: Remedy | None
    effects: tuple[PartialEffect, ...]


Values: TypeAlias = Mapping[str, float]
GrowingRoots: TypeAlias = Callable[[Values], NDArray[np.complex128]]
"""The growing roots with Im >= 0 at changed parameters."""


def find_remedy(
    spectrum: Eigenvalues,
    derivatives: Sensitivity,
    high: float,
    options: Mapping[str, object],
) -> RemedySearch:
    """The parameter that stops every growing mode of the selection with the fewest steps.

    A step is 1 % of a parameter, or a degree of an angle. Where none does, the answer has no remedy
    but the effect of each parameter.

    Parameters
    ----------
    spectrum : Eigenvalues
        Of the brake as it is.
    derivatives : Sensitivity
        Of these eigenvalues; it says which parameters may change, and what a step is. The one that
        is swept is left out.
    high : float
        Upper end of the range in which the first loss of stability with the change is searched.
    options : mapping
        Of `eigenvalues` and `thresholds`: band, memory, progress.

    Raises
    ------
    ComputationError
        If the changed brake cannot be computed.
    """
    changes = []
    for name in derivatives.slopes:
        step, words = derivatives.step(name)
        if name == spectrum.parameter or not step:
            continue
        unit = words.removeprefix("1").strip().replace("degree", "degrees")
        changes.append(Change(name, derivatives.values[name], step, unit, 0.0))
    if not spectrum.unstable or not changes:
        return RemedySearch(None, ())
    search = _Search(spectrum, changes)
    for change in search.remedies():
        remedy = _computed(spectrum, change, high, options)
        if remedy is not None:
            return RemedySearch(remedy, ())
    return RemedySearch(None, tuple(search.effect(change) for change in changes))


class _Search:
    """Growing roots over changes of parameters, and what they make of the modes that grow."""

    def __init__(self, spectrum: Eigenvalues, changes: Sequence[Change]) -> None:
        self.unstable = spectrum.unstable
        self.changes = changes
        self.steps: Sequence[int] = range(1, MOST_STEPS + 1)
        source = spectrum.source
        self.band: Band | None = None
        if isinstance(source, SystemSource):
            self.band = source.selection.band
            if source.file.system.n > DENSE_ROWS:
                self.steps = FEW_STEPS
        self.growing = _growing_roots(source, changes)
        # outside of a band others may grow, and go on growing
        self.others = len(self.growing({})) - len(self._in_band(self.growing({})))
        self.known: dict[tuple[str, float], NDArray[np.complex128] | None] = {}

    def _in_band(self, roots: NDArray[np.complex128]) -> NDArray[np.complex128]:
        if self.band is None:
            return roots
        low, high = self.band
        return roots[(roots.imag >= math.tau * low) & (roots.imag <= math.tau * high)]

    def roots(self, change: Change) -> NDArray[np.complex128] | None:
        """The growing roots with a change; None where there is no such brake."""
        key = (change.parameter, change.count)
        if key not in self.known:
            self.known[key] = None
            with suppress(InputError, ComputationError):
                self.known[key] = self.growing({change.parameter: change.after})
        return self.known[key]

    def stops_all(self, change: Change) -> bool:
        """Whether nothing of the band grows, and nothing was but moved out of it."""
        roots = self.roots(change)
        if roots is None:
            return False
        return not len(self._in_band(roots)) and len(roots) <= self.others

    def remedies(self) -> Iterator[Change]:
        """The least change of each parameter that stops all that grows, the smallest first."""
        stopped_by: set[str] = set()
        before = 0
        for count in self.steps:
            located = []
            for change in self.changes:
                if change.parameter not in stopped_by:
                    located += self._between(change, before, count, self.stops_all)
            located.sort(key=lambda found: abs(found.count))
            for found in located:
                if found.parameter not in stopped_by:
                    yield found
                stopped_by.add(found.parameter)
            before = count

    def _between(
        self, change: Change, low: int, high: int, stops: Callable[[Change], bool]
    ) -> list[Change]:
        """The least change of either sign between two counts of steps for which a condition holds,
        if it holds at the larger one."""
        found = []
        for sign in (1, -1):
            if stops(change.of(sign * high)):
                found.append(self._bisected(change, sign * low, sign * high, stops))
        return found

    def _least(self, change: Change, stops: Callable[[Change], bool]) -> Change | None:
        """The least change of a parameter for which a condition holds, None if none is."""
        before = 0
        for count in self.steps:
            found = self._between(change, before, count, stops)
            if found:
                return min(found, key=lambda located: abs(located.count))
            before = count
        return None

    def _bisected(
        self, change: Change, low: float, high: float, stops: Callable[[Change], bool]
    ) -> Change:
        """The least change between one that does not suffice and one that does."""
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            if stops(change.of(middle)):
                high = middle
            else:
                low = middle
        return change.of(high)

    def effect(self, change: Change) -> PartialEffect:
        """What a parameter does that cannot stop all that grows."""
        stops = []
        for k in range(len(self.unstable)):

            def stops_mode(changed: Change, k: int = k) -> bool:
                roots = self.roots(changed)
                return roots is not None and not self._is_among(k, roots)

            stops.append(self._least(change, stops_mode))
        left: tuple[float, ...] = ()
        if stops[0] is not None:
            roots = self.roots(stops[0])
            assert roots is not None
            left = tuple((roots.imag / math.tau).tolist())
        return PartialEffect(change.parameter, change.of(MOST_STEPS).size, tuple(stops), left)

    def _is_among(self, k: int, roots: NDArray[np.complex128]) -> bool:
        """Whether one of the growing roots is that of mode k: each root is taken for the nearest
        mode in frequency."""
        frequencies = np.array([mode.root.imag for mode in self.unstable])
        for root in roots:
            distances = np.abs(frequencies - root.imag)
            nearest = int(distances.argmin())
            if nearest == k and distances[k] <= SAME_MODE * max(frequencies[k], root.imag):
                return True
        return False


def _growing_roots(
    source: PadSource | SystemSource | None, changes: Sequence[Change]
) -> GrowingRoots:
    """What computes growing roots: of the scene, of a small system, or of a reduced one that serves
    all changes."""
    assert source is not None
    if isinstance(source, PadSource):
        scene = source.scene

        def roots_of_pad(values: Values) -> NDArray[np.complex128]:
            spectrum = analyse(scene.replace(**values)).spectrum
            return _upper_growing(spectrum.values, spectrum.rounding)

        return roots_of_pad
    from squeal.queries.systems.all_roots import is_small, roots_of_all
    from squeal.queries.systems.verdicts import rounding_of

    system = source.file.system
    if is_small(system):

        def roots_of_system(values: Values) -> NDArray[np.complex128]:
            changed = system.replace(values)  # no parameter that seats contact is among them
            roots = roots_of_all(changed, EigenvalueSelection(), {})
            return _upper_growing(roots, rounding_of(changed, roots))

        return roots_of_system
    from squeal.queries.systems.reduced import estimated_roots, reduced_for

    selection = source.selection
    if selection.band is not None:
        low, high = selection.band
        selection = EigenvalueSelection(((1.0 - WIDER) * low, (1.0 + WIDER) * high))
    served: list[Values] = [{}]
    for change in changes:
        for share in (-1.0, -0.5, 0.5, 1.0):
            served.append({change.parameter: change.of(share * MOST_STEPS).after})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what it finds is computed on the full system
        reduction = reduced_for(system, selection, served, "modal")

    def roots_of_reduced(values: Values) -> NDArray[np.complex128]:
        found = estimated_roots(reduction, values)
        roots = np.array([root.value for root in found], dtype=complex)
        return _upper_growing(roots, np.array([root.rounding for root in found]))

    return roots_of_reduced


def _upper_growing(
    roots: NDArray[np.complex128], rounding: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """The roots with Im >= 0 that grow by more than rounding may move them."""
    return roots[(roots.real > rounding) & (roots.imag >= 0.0)]


def _computed(
    spectrum: Eigenvalues, change: Change, high: float, options: Mapping[str, object]
) -> Remedy | None:
    """A change, rounded up to two digits, with what the full system says of it; None if modes go on
    growing with it."""
    source = spectrum.source
    for count in _rounded_up(abs(change.count)):
        rounded_change = change.of(math.copysign(count, change.count))
        with suppress(InputError, ComputationError):  # there may be no such brake
            changed = replaced(source, rounded_change)
            computed = eigenvalues(changed, **options)  # type: ignore[arg-type]
            if not computed.unstable:
                loss = _loss_of(changed, high, options)
                best, best_loss = _best(spectrum, rounded_change, loss, high, options)
                return Remedy(rounded_change, computed, loss, best, best_loss)
    return None


def _rounded_up(count: float) -> Iterator[float]:
    """A count of steps in two digits, rounded up, and somewhat larger ones."""
    unit = 10.0 ** (math.floor(math.log10(count)) - 1)
    digits = math.ceil(count / unit * (1.0 - 1e-12))
    for retry in range(RETRIES):
        rounded_count = float(number((digits + retry * (retry + 1) // 2) * unit, 3))
        if rounded_count <= MOST_STEPS:
            yield rounded_count


def _loss_of(changed: Scene | SystemFile, high: float, options: Mapping[str, object]) -> Loss:
    """Where a changed brake loses stability first."""
    answer = thresholds(changed, high, prove=False, **options)  # type: ignore[arg-type]
    return _loss(first_loss(answer, high), high)


def _loss(outcome: Outcome, high: float) -> Loss:
    return Loss(outcome.critical, outcome.kind or "", outcome.frequency_hz, high)


def _best(
    spectrum: Eigenvalues,
    change: Change,
    loss: Loss,
    high: float,
    options: Mapping[str, object],
) -> tuple[Change | None, Loss | None]:
    """The larger change with which stability is lost latest; of pads and of systems of few rows."""
    source = spectrum.source
    assert source is not None
    if loss.value is None:
        return None, None
    band = None
    subject: Scene | SystemFile
    if isinstance(source, PadSource):
        subject = source.scene
    else:
        subject = source.file
        band = source.selection.band
        if subject.system.n > BEST_ROWS:
            return None, None
    space = ParameterSpace.of(subject, "report", high)
    larger = []
    for count in range(math.ceil(abs(change.count)), MOST_STEPS + 1):
        larger.append(change.of(math.copysign(count, change.count)))
    outcomes = space.outcomes([{one.parameter: one.after} for one in larger], high, band)
    best = None
    latest = BETTER * loss.value
    for one, outcome in zip(larger, outcomes, strict=True):
        if outcome.reason is not None:
            continue
        critical = math.inf if outcome.critical is None else outcome.critical
        if critical > latest:
            best = one
            latest = critical
    if best is None:
        return None, None
    computed = _loss_of(replaced(source, best), high, options)
    if computed.value is not None and computed.value <= BETTER * loss.value:
        return None, None  # a query, which is exact, does not confirm it
    return best, computed


def replaced(source: PadSource | SystemSource | None, change: Change) -> Scene | SystemFile:
    """The scene or the file of a system with a changed parameter."""
    if isinstance(source, PadSource):
        return source.scene.replace(**{change.parameter: change.after})
    assert source is not None
    return source.file.replaced({change.parameter: change.after})


def rounded(value: float, digits: int, towards: Callable[[float], int]) -> str:
    """A positive limit in so many digits, rounded by `towards` (math.floor or math.ceil).

    >>> rounded(0.30322, 4, math.floor), rounded(0.245226, 2, math.ceil)
    ('0.3032', '0.25')
    """
    unit = 10.0 ** (math.floor(math.log10(value)) + 1 - digits)
    return number(towards(value / unit) * unit, digits)


def partner_of(spectrum: Eigenvalues, mode: UnstableMode) -> int | None:
    """The number of the mode with which a growing one has coalesced, None without one.

    It is the nearest in frequency of those whose growth rate is lower by at least as much as the
    frequencies differ, both in rad/s.

    Two modes that have met are split along the real axis; before they meet, along the imaginary
    one.
    """
    own = spectrum.mode_of(mode)
    nearest = None
    least = math.inf
    for other, root in spectrum.of_modes:
        distance = abs(root.value.imag - mode.root.imag)
        is_split = mode.growth_rate - root.growth_rate >= distance
        if other != own and root.value.imag > 0.0 and is_split and distance < least:
            nearest = other
            least = distance
    return nearest
