"""The verb `map`: the verdict over two parameters of a pad or of a system."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.linear import VERDICTS
from squeal.queries.options import Band, Progress, Subject, Workers, refuse_options
from squeal.queries.pads.maps import stability_map
from squeal.results.columns import basis_text
from squeal.results.map import Axis, Map
from squeal.results.sources import EigenvalueSelection, SystemSource
from squeal.schema import Place, Positive, public

if TYPE_CHECKING:  # pads start without the solvers of systems
    from squeal.linear.system import System
    from squeal.queries.systems.system_analysis import SystemAnalysis
    from squeal.sparse.reduction import Reduction

BASIS_VALUES = 5  # of each parameter, evenly chosen, that a reduced system is made at


@public
def map(
    subject: Subject,
    axes: tuple[Axis, Axis] | None = None,
    quantity: Literal["critical-friction", "growth", "frequency"] | None = None,
    curves: bool = False,
    band: Band | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
    workers: Workers | None = None,  # `public` reads it
) -> Map:
    """Compute the verdict over two parameters.

    Parameters
    ----------
    subject, band, memory, progress, workers
        As `sweep` takes them.
    axes : (Axis, Axis), optional
        Two different parameters with their ranges. A system needs them; left out, they are both
        spring angles of a scene from 0 to pi.
    quantity : {"critical-friction", "growth", "frequency"}, optional
        A number beside the verdict, of scenes. Beside that of a system the largest growth rate
        always stands.
    curves : bool
        Whether the curves on which stability is lost are located too, of scenes.

    Returns
    -------
    Map
        Codes (n1, n2) of verdicts, and the share of the points that each verdict has.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, 0], [0, 2]], "gap": [[1, 0], [0, -1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"gap": 0.5})
    >>> axes = squeal.Axis("mu", 0, 1, 9), squeal.Axis("gap", 0, 1, 3)
    >>> squeal.map(pair, axes).share["flutter"]
    0.4444444444444444
    """
    if isinstance(subject, Scene):
        refuse_options("a scene", band=band, memory=memory)
        return stability_map(subject, axes, quantity, curves)
    refuse_options("a system", quantity=quantity, curves=curves)
    from squeal.queries.systems.system_analysis import SystemAnalysis

    analysis = SystemAnalysis.of(subject, band, memory=memory, progress=progress)
    return _system_map(analysis, axes)


def _system_map(analysis: SystemAnalysis, axes: tuple[Axis, Axis] | None) -> Map:
    """Compute the verdict on the selected roots of a system over two named parameters.

    Up to 400 rows every point is solved in full. A larger system is solved on a reduced one, which
    is made at `BASIS_VALUES` values of each parameter.
    """
    from squeal.io.processes import mapped, with_progress
    from squeal.queries.systems.all_roots import is_small
    from squeal.queries.systems.reduced import basis_of, reduced_for
    from squeal.queries.systems.seat import notes_of_seat
    from squeal.queries.systems.system_analysis import refuse_without_effect
    from squeal.queries.systems.verdicts import NO_ROOT, UNCOUNTED
    from squeal.sparse.quadratic import PROGRESS

    system = analysis.system
    selection = analysis.selection
    if axes is None:
        raise InputError(f"{system.name}: axes: missing; the map of a system needs two parameters")
    if axes[0].name == axes[1].name:
        raise InputError(f"{system.name}: axes: must be two different parameters, by name")
    refuse_without_effect(analysis.file, [axis.name for axis in axes], Place("map", "axes"))
    reduction = None
    if not is_small(system):
        values = [np.linspace(axis.low, axis.high, BASIS_VALUES) for axis in axes]
        reduction = reduced_for(system, selection, _points(axes, values), method="modal")
    points = _points(axes, [axis.values for axis in axes])
    verdict_at = partial(_verdict_and_growth, system, selection, reduction)
    computed = mapped(verdict_at, points, in_threads=reduction is not None)
    # verdict and growth of each point, in the order of the points
    cells = with_progress(computed, len(points), PROGRESS.get(), "points")
    verdicts, growth = zip(*cells, strict=True)
    names = (*VERDICTS, NO_ROOT, UNCOUNTED)
    shape = (axes[0].n, axes[1].n)
    codes = np.reshape([names.index(verdict) for verdict in verdicts], shape).astype(np.int8)
    basis = basis_of(reduction, selection) or analysis.component_reduction
    notes = notes_of_seat(analysis.file)
    if basis:
        notes.insert(0, basis_text(basis))
    extent = None
    if selection.band is not None:
        extent = selection.words()
        notes.insert(0, f"Verdicts are of {extent}; what grows outside is left out")
    return Map(
        name=system.name,
        axes=axes,
        units=("", ""),
        verdicts=names,
        codes=codes,
        quantity=("largest_real", "1/s", np.reshape(growth, shape)),
        details={
            "verdicts": np.reshape(verdicts, shape).tolist(),
            "basis": basis,
            "extent": extent,
        },
        notes=tuple(notes),
        source=SystemSource(analysis.file, selection, reduction),
    )


def _points(axes: tuple[Axis, Axis], values: list[np.ndarray]) -> list[dict[str, float]]:
    """Both parameters at each point of a grid, the second one varying fastest.

    values: of the first parameter (n1,), and of the second one (n2,).
    """
    points = []
    for first in values[0].tolist():
        for second in values[1].tolist():
            points.append({axes[0].name: first, axes[1].name: second})
    return points


def _verdict_and_growth(
    system: System,
    selection: EigenvalueSelection,
    reduction: Reduction | None,
    parameters: Mapping[str, float],
) -> tuple[str, float]:
    """The verdict and the largest growth rate (1/s, NaN without a root) at one point of a map.

    A task of a process; `parameters` are the two of the axes, with their values there.
    """
    from squeal.queries.systems.all_roots import roots_of_all
    from squeal.queries.systems.verdicts import UNCOUNTED, rounding_of, verdict_of, verdict_of_some
    from squeal.sparse.first_look import FirstLook

    # how far each root (m,) of a first look may lie off, 1/s. Of other roots rounding alone counts:
    # one zero stands for all
    errors = np.zeros(1)
    if isinstance(reduction, FirstLook):
        estimate = reduction.estimate(parameters)
        roots = estimate.values
        errors = estimate.errors
    elif reduction is not None:
        roots = reduction.values(parameters)
    else:
        roots = roots_of_all(system, selection, parameters)
    rounding = np.maximum(errors, rounding_of(system, roots))
    growth = np.nan
    if len(roots):
        growth = float(roots.real.max())
    if reduction is None:
        verdict = verdict_of(roots, rounding)
    else:  # a reduced system may lack roots: without a growing one nothing is decided
        verdict = verdict_of_some(roots, rounding) or UNCOUNTED
    return verdict, growth
