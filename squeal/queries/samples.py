"""What is computed of samples of parameters: a threshold, or the growth of selected roots.

Of a large system a reduced one is computed, whose residual in the full problem is reported.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene
from squeal.linear.eigen import values_of
from squeal.linear.matrices import Array
from squeal.linear.roots import ComplexArray
from squeal.linear.system import TermSystem
from squeal.linear.verdicts import decide
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.parameter_space import NO_PAD, Outcome, ParameterSpace, first_loss
from squeal.queries.systems.all_roots import NO_BAND, is_small, roots_of_all
from squeal.queries.systems.reduced import estimated_roots, reduced_for
from squeal.queries.systems.thresholds import system_thresholds
from squeal.queries.systems.verdicts import rounding_of, verdict_of_some
from squeal.results.scatter import Measure, Sample
from squeal.results.sources import EigenvalueSelection
from squeal.schema import Place
from squeal.sparse.reduction import Reduction

BASIS_SAMPLES = 24  # about so many samples a reduced system is made at

Changes: TypeAlias = dict[str, float]
"""Parameters of a sample by name; all others have the value of the subject."""


@dataclass(frozen=True)
class ThresholdSamples:
    """Computes the first loss of stability up to `high` of changed pads or small systems."""

    space: ParameterSpace
    selection: EigenvalueSelection
    high: float
    reduction = None

    def samples(self, changes: Sequence[Changes]) -> list[Sample]:
        """The sample of each change of parameters."""
        outcomes = self.space.outcomes(changes, self.high, self.selection.band)
        return list(map(_threshold_sample, changes, outcomes))


@dataclass(frozen=True)
class ReducedThresholdSamples:
    """Computes the first loss of stability up to `high` of a large system.

    The reduced system says where to search; the threshold is located on the full one.
    """

    reduction: Reduction
    selection: EigenvalueSelection
    high: float

    def sample(self, values: Changes) -> Sample:
        """The sample at changed parameters, with the residual of the reduced system there."""
        try:
            reduction = self.reduction.replaced(values)
            full_system = reduction.scaled.system
            search = system_thresholds(
                full_system, self.high, selection=self.selection, shared_reduction=reduction
            )
            outcome = first_loss(search.answer, self.high)
            mu = self.high  # without a threshold the whole range was searched
            if outcome.critical is not None:
                mu = outcome.critical
            residuals = reduction.modes({search.answer.parameter: mu}).residuals
        except (InputError, ComputationError) as error:
            return _refused(values, error)
        return _threshold_sample(values, outcome, float(np.max(residuals, initial=0.0)))


@dataclass(frozen=True, eq=False)
class _RootsOfSample:
    """Roots (m,), how far rounding or an error may move each, 1/s (m,), and residuals (m,) in the
    full problem; these are None unless the roots are those of a reduced system."""

    roots: ComplexArray
    rounding: Array
    residuals: Array | None = None


@dataclass(frozen=True)
class GrowthSamples:
    """Computes the growth rates of the selected roots of a pad, a system or a reduced one."""

    subject: Scene | TermSystem | Reduction
    selection: EigenvalueSelection

    @property
    def reduction(self) -> Reduction | None:
        """The reduced system whose roots are taken, None without one."""
        if isinstance(self.subject, Reduction):
            return self.subject
        return None

    def sample(self, values: Changes) -> Sample:
        """The sample at changed parameters: its verdict, and the mode that grows fastest."""
        try:
            selected = self._roots(values)
        except (InputError, ComputationError) as error:
            return _refused(values, error)
        roots = selected.roots
        if not len(roots):
            return Sample(values, reason="no root lies in the band")
        # of a pair the root with Im > 0 alone; a real root of real matrices has Im = 0 exactly
        unstable = roots[(roots.real > selected.rounding) & (roots.imag >= 0.0)]
        fastest = roots[np.argmax(roots.real)]
        residual = None
        verdict: str | None = decide(roots, selected.rounding).verdict
        if selected.residuals is not None:  # nothing is counted on a reduced system
            residual = float(np.max(selected.residuals, initial=0.0))
            verdict = verdict_of_some(roots, selected.rounding)
        # `propensity`, the squeal propensity index: the sum of sigma / |lambda| of growing modes
        return Sample(
            parameters=values,
            value=float(fastest.real),
            kind=verdict,
            frequency_hz=abs(float(fastest.imag)) / math.tau,
            unstable=len(unstable),
            propensity=math.fsum(unstable.real / np.abs(unstable)),
            residual=residual,
        )

    def _roots(self, values: Changes) -> _RootsOfSample:
        """The selected roots at changed parameters. Raises InputError, ComputationError."""
        subject = self.subject
        if isinstance(subject, Scene):
            spectrum = analyse(subject.replace(**values)).spectrum
            return _RootsOfSample(spectrum.values, spectrum.rounding)
        if isinstance(subject, TermSystem):
            roots = roots_of_all(subject, self.selection, values)
            return _RootsOfSample(roots, rounding_of(subject, roots))
        estimated = estimated_roots(subject, values)
        return _RootsOfSample(
            roots=values_of(estimated),
            rounding=np.array([root.rounding for root in estimated]),
            residuals=np.array([root.residual for root in estimated]),
        )


SampleComputer: TypeAlias = ThresholdSamples | ReducedThresholdSamples | GrowthSamples


def sample_computer(
    space: ParameterSpace,
    measure: Measure,
    high: float,
    selection: EigenvalueSelection,
    changes: Sequence[Changes],
) -> SampleComputer:
    """The object that computes the samples; of a large system it holds a reduced system.

    The reduced system is made at the parameters of the subject and at about `BASIS_SAMPLES` of the
    changes, evenly chosen.

    high: up to which value of the free parameter thresholds are searched; changes: the parameters
    that differ from those of the subject, of each sample.

    Raises InputError for a band with a scene, and for a large system without a band.
    """
    subject = space.subject
    if isinstance(subject, Scene) and selection.band is not None:
        raise Place("band").refuse("is not allowed with a scene; a system takes it")
    if isinstance(subject, Scene) or is_small(subject):
        if measure == "threshold":
            return ThresholdSamples(space, selection, high)
        return GrowthSamples(subject, selection)
    if selection.band is None:
        raise InputError(NO_BAND)
    points_of_basis = [{}, *changes[:: max(1, len(changes) // BASIS_SAMPLES)]]
    if measure == "growth":
        modal = reduced_for(subject, selection, points_of_basis, method="modal")
        return GrowthSamples(modal, selection)
    # a search passes through the whole range of the free parameter: each point of the basis gets
    # another value of it
    values = np.linspace(0.0, high, len(points_of_basis) + 1)[1:].tolist()
    spread_over_range = []
    for parameters, value in zip(points_of_basis, values, strict=True):
        spread_over_range.append({**parameters, space.free: value})
    reduction = reduced_for(subject, selection, spread_over_range)
    return ReducedThresholdSamples(reduction, selection, high)


def samples_of(computer: SampleComputer, changes: Sequence[Changes]) -> list[Sample]:
    """The samples of a chunk of changes; a task of a process."""
    if isinstance(computer, ThresholdSamples):  # which computes pads together
        return computer.samples(changes)
    return [computer.sample(values) for values in changes]


def _refused(values: Changes, error: InputError | ComputationError) -> Sample:
    """A sample without a result: parameters that no pad can have, or a failed computation."""
    kind = NO_PAD if isinstance(error, InputError) else None
    return Sample(values, kind=kind, reason=str(error))


def _threshold_sample(values: Changes, outcome: Outcome, residual: float | None = None) -> Sample:
    """A sample whose value is the critical friction of an outcome, NaN if there is none."""
    return Sample(
        parameters=values,
        value=math.nan if outcome.critical is None else outcome.critical,
        kind=outcome.kind,
        frequency_hz=outcome.frequency_hz,
        residual=residual,
        reason=outcome.reason,
    )
