"""The verb `reduce`: a system with the roots of a band or region alone."""

from typing import Literal

from squeal.linear.system import System
from squeal.queries.options import Band, Progress, Region, SystemSubject, Values
from squeal.schema import Positive, public


@public
def reduce(
    subject: SystemSubject,
    values: Values | None = None,
    band: Band | None = None,
    region: Region | None = None,
    method: Literal["reduced", "modal"] = "reduced",
    memory: Positive | None = None,
    progress: Progress | None = None,
) -> System:
    """Reduce a system to the roots of a band or region, with the same parameters.

    Parameters
    ----------
    subject, band, region, memory, progress
        As `eigenvalues` takes them; a band or a region is required.
    values : sequence of float, optional
        Values of the free parameter that it has to serve; left out, its own.
    method : {"reduced", "modal"}
        Complex modes, certified against the full system, or real modes.

    Returns
    -------
    System
        The reduced system, dense.

    Examples
    --------
    >>> import numpy as np, squeal
    >>> chain = squeal.System(np.eye(60), K=np.diag((2 * np.pi * np.arange(1, 61)) ** 2))
    >>> squeal.eigenvalues(squeal.reduce(chain, band=(0.5, 3.7)), modes=3).values.imag.round(6)
    array([ 6.283185, 12.566371, 18.849556])
    """
    from squeal.queries.systems.system_analysis import SystemAnalysis

    analysis = SystemAnalysis.of(subject, band, region, memory=memory, progress=progress)
    reduction = analysis.reduced(None if values is None else list(values), method)
    return reduction.standalone_system
