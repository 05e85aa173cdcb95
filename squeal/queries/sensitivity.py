"""The verb `sensitivity`: what moves the eigenvalues, or the first loss of stability."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.queries.options import Band, Modes, Progress, Region, Subject, refuse_options, upper_end
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.pads.sensitivity import loss_sensitivity, pad_root_sensitivity
from squeal.queries.thresholds import critical_friction, system_thresholds_with_proof
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.sources import PadSource, SystemSource, refuse_other_subject
from squeal.results.thresholds import Thresholds
from squeal.schema import Place, Positive, kind_of, public


@public
def sensitivity(
    subject: Subject,
    of: Literal["eigenvalues", "threshold"] = "eigenvalues",
    high: float | None = None,
    low: float | None = None,
    band: Band | None = None,
    region: Region | None = None,
    modes: Modes | None = None,
    matrices: Mapping[str, Mapping[str, Any]] | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
    known: Eigenvalues | Thresholds | None = None,
) -> Sensitivity:
    """Differentiate the eigenvalues, or the first loss of stability, by each parameter.

    Parameters
    ----------
    subject, band, region, modes, memory, progress
        As `eigenvalues` takes them. Of a scene the equilibrium moves with its parameters.
    of : {"eigenvalues", "threshold"}
        What is differentiated; of a threshold its frequency is too.
    high, low : float, optional
        Range that is searched for the loss, as `thresholds` takes it.
    matrices : mapping of str to mapping, optional
        Changes of a system that are no parameters: a name for each, and by the keys ``"M"``,
        ``"C"`` and ``"K"`` what it adds to these (n, n), arrays or names of files.
    known : Eigenvalues or Thresholds, optional
        The answer to differentiate, if it was computed before.

    Returns
    -------
    Sensitivity
        Derivatives per unit of each parameter, exact to rounding; infinite where two roots
        coalesce.

    Raises
    ------
    InputError
        For what does not fit the subject.
    ComputationError
        If several modes cross the imaginary axis at the threshold, or none does.

    Examples
    --------
    >>> import squeal
    >>> one = squeal.System([[1.0]], K={"k": [[1.0]]}, parameters={"k": 4.0})
    >>> moved = squeal.sensitivity(one, matrices={"mass": {"M": [[1.0]]}})  # of +-i sqrt(k)
    >>> moved.slopes["k"].imag.tolist(), moved.slopes["mass"].imag.tolist()
    ([0.25, -0.25], [-1.0, 1.0])
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K)  # flutter where 4 mu / 3 > 1
    >>> softer = {"softer": {"K": [[0, 1], [1, 0]]}}
    >>> moved = squeal.sensitivity(pair, of="threshold", matrices=softer)
    >>> moved.slopes["softer"][:1].round(9)
    array([-0.75])
    """
    of_threshold = of == "threshold"
    if known is not None:
        expected = Thresholds if of_threshold else Eigenvalues
        kind_of(expected).read(known, Place("known"))
    if not of_threshold and (high is not None or low is not None):
        raise InputError("high, low: are of thresholds; of='threshold' takes them")
    # the answer to differentiate is computed below where it is None
    known_thresholds = known if isinstance(known, Thresholds) else None
    known_eigenvalues = known if isinstance(known, Eigenvalues) else None
    if isinstance(subject, Scene):
        refuse_options(
            "a scene",
            band=band,
            region=region,
            modes=modes,
            memory=memory,
            low=low,
            matrices=matrices,
        )
        if known is not None:
            refuse_other_subject("known", known.source, subject)
        if of_threshold:
            if known_thresholds is None:
                known_thresholds = critical_friction(subject, upper_end(subject, high))
            return loss_sensitivity(subject, known_thresholds)
        if known_eigenvalues is None:
            return pad_root_sensitivity(subject, analyse(subject))
        source = known_eigenvalues.source
        assert isinstance(source, PadSource)
        assert source.analysis is not None  # every answer of eigenvalues has it
        # the answer may be at another mu than the scene's, and number its modes in another way
        answer = pad_root_sensitivity(subject.replace(mu=known_eigenvalues.value), source.analysis)
        return replace(answer, modes=known_eigenvalues.modes)
    from squeal.queries.systems.eigenvalues import system_eigenvalues
    from squeal.queries.systems.seat import note_of_seat_parameters, seat_parameters
    from squeal.queries.systems.sensitivity import (
        root_sensitivity,
        threshold_sensitivity,
        with_matrices,
    )
    from squeal.queries.systems.system_analysis import SystemAnalysis

    analysis = SystemAnalysis.of(subject, band, region, modes, memory, progress)
    if known is not None:
        refuse_other_subject("known", known.source, analysis.system)
        source = known.source
        selects = not (band is None and region is None and modes is None)
        if selects and isinstance(source, SystemSource) and source.selection != analysis.selection:
            raise InputError(
                "known: is the answer for another band, region or number of modes; that for the "
                "same ones is allowed, or leave them out"
            )
    # the system with a further parameter for each of the `matrices`
    system = with_matrices(analysis.file, matrices or {})
    if of_threshold:
        if known_thresholds is None:
            end = upper_end(subject, high)
            known_thresholds = system_thresholds_with_proof(analysis, end, low, prove=False)
        answer = threshold_sensitivity(system, known_thresholds)
    else:
        if known_eigenvalues is None:
            known_eigenvalues = system_eigenvalues(analysis)
        answer = root_sensitivity(system, known_eigenvalues)
    return answer.without(seat_parameters(analysis.file), note_of_seat_parameters(analysis.file))
