"""The growing roots of a brake with changed parameters: of a pad, a small or a reduced system."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, InputError
from squeal.linear import Spectrum
from squeal.linear.eigen import values_of
from squeal.linear.roots import ComplexArray
from squeal.linear.system import TermSystem
from squeal.queries.mode_paths import is_growing
from squeal.queries.options import Band
from squeal.queries.pads.equilibrium import spectra_of_pads
from squeal.queries.remedies.changes import IN_HAND, Change
from squeal.queries.systems.all_roots import in_band, is_small, roots_of_all
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sources import EigenvalueSelection, PadSource, SystemSource

if TYPE_CHECKING:
    from squeal.sparse.reduction import Reduction

WIDER = 0.15  # of the ends of a band: a mode that a change moves out of it has not stopped

Values: TypeAlias = Mapping[str, float]
"""Changed parameters: their values by name."""


class ChangedBrakes:
    """The growing roots of one brake with each change of a parameter; each is computed once.

    A factor is that on the free parameter: 1 is its present value.

    Attributes
    ----------
    band : (float, float) or None
        Of frequencies, Hz, in which nothing is to grow; None: at all.
    growing_outside : int
        How many roots grow outside of the band without a change; as many may go on growing.
    """

    def __init__(self, spectrum: Eigenvalues, changes: Sequence[Change]) -> None:
        """spectrum: of the brake without a change; changes: one step of each parameter up and down.

        A reduced system of a large one serves all changes of these kinds up to their largest size.
        """
        self.spectrum = spectrum
        source = spectrum.source
        self.band: Band | None = None
        self._reduction: Reduction | None = None
        if isinstance(source, SystemSource):
            self.band = source.selection.band
            if not is_small(source.file.system):
                # at present ({}: no parameter changes), with more of the free parameter, and with
                # half and all of each change
                good_at: list[Values] = [{}, {spectrum.parameter: IN_HAND * spectrum.value}]
                for change in changes:
                    for share in (0.5, 1.0):
                        # steps of the parameter, with the sign of the change
                        count = math.copysign(share * change.most, change.count)
                        good_at.append({change.parameter: change.of(count).after})
                self._reduction = _reduced_system(source, good_at)
        # by parameter, number of steps and factor
        self._computed: dict[tuple[str, float, float], ComplexArray | None] = {}
        (unchanged,) = self._compute([{}])
        self.growing_outside = 0
        if unchanged is not None:
            self.growing_outside = len(unchanged) - len(in_band(unchanged, self.band))

    def roots(self, changes: Sequence[Change], factor: float = 1.0) -> list[ComplexArray | None]:
        """The growing roots (m,) with each change, rad/s; None where there is no such brake."""
        keys = [(change.parameter, change.count, factor) for change in changes]
        missing = {}
        for key, change in zip(keys, changes, strict=True):
            values = {change.parameter: change.after}
            if factor != 1.0:
                values[self.spectrum.parameter] = factor * self.spectrum.value
            if key not in self._computed:
                missing[key] = values
        if missing:
            self._computed.update(zip(missing, self._compute(missing.values()), strict=True))
        return [self._computed[key] for key in keys]

    def growth(self, change: Change) -> float:
        """The rate of the mode of the band that grows fastest with a change, 1/s; 0 without one."""
        (roots,) = self.roots([change])
        if roots is None:
            return 0.0
        return float(in_band(roots, self.band).real.max(initial=0.0))

    def has_more_outside(self, roots: ComplexArray) -> bool:
        """Whether more of some growing roots lie outside of the band than without a change."""
        return len(roots) - len(in_band(roots, self.band)) > self.growing_outside

    def stopping(self, changes: Sequence[Change], factor: float = 1.0) -> Sequence[Change]:
        """The changes with which nothing of the band grows, nor has only moved out of it."""
        stopping = []
        for change, roots in zip(changes, self.roots(changes, factor), strict=True):
            if roots is None or len(in_band(roots, self.band)):
                continue
            if not self.has_more_outside(roots):
                stopping.append(change)
        return stopping

    def _compute(self, changes: Iterable[Values]) -> list[ComplexArray | None]:
        """The growing roots (m,) with each change, rad/s; None where they cannot be computed.

        Changed pads are computed together, changed systems one after the other.
        """
        source = self.spectrum.source
        growing: list[ComplexArray | None] = []
        if isinstance(source, PadSource):
            for spectrum in spectra_of_pads(source.scene, list(changes)):
                roots = None
                if isinstance(spectrum, Spectrum):  # else it is the error that says why not
                    roots = upper_growing(spectrum.values, spectrum.rounding)
                growing.append(roots)
            return growing
        assert source is not None
        for values in changes:
            roots = None
            with suppress(InputError, ComputationError, ArithmeticError):
                roots = self._growing_of_system(source.file.system, values)
            growing.append(roots)
        return growing

    def _growing_of_system(self, system: TermSystem, values: Values) -> ComplexArray:
        """All growing roots of a small system at changed parameters, of a large one as the reduced
        one estimates them."""
        if self._reduction is not None:
            from squeal.queries.systems.reduced import estimated_roots

            estimates = estimated_roots(self._reduction, values)
            rounding = np.array([root.rounding for root in estimates])
            return upper_growing(values_of(estimates), rounding)
        from squeal.queries.systems.verdicts import rounding_of

        changed = system.replace(values)  # no parameter that seats contact is among them
        roots = roots_of_all(changed, EigenvalueSelection(), {})
        return upper_growing(roots, rounding_of(changed, roots))


def _reduced_system(source: SystemSource, good_at: Sequence[Values]) -> Reduction:
    """A reduced system of the band and `WIDER` beyond its ends, as far as tables of moduli reach.

    good_at: changed parameters at which it has to be good, where the system has matrices there.
    """
    from squeal.queries.systems.reduced import reduced_for

    system = source.file.system
    selection = source.selection
    if selection.band is not None:
        low, high = selection.band
        least, most = system.covered  # by tables of moduli over the frequency
        wider_low = max((1.0 - WIDER) * low, min(least, low))
        wider_high = min((1.0 + WIDER) * high, max(most, high))
        selection = EigenvalueSelection((wider_low, wider_high))
    existing = []
    for values in good_at:
        with suppress(InputError):  # a factor may divide by the parameter
            system.frozen().at(values)
            existing.append(values)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of an estimate: what is named is computed in full
        return reduced_for(system, selection, existing, "modal")


def upper_growing(roots: ComplexArray, rounding: NDArray[np.float64]) -> ComplexArray:
    """The roots with Im >= 0 that grow by more than rounding may move them."""
    return roots[is_growing(roots, rounding) & (roots.imag >= 0.0)]
