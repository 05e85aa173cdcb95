"""One family of verbs for a pad and for matrices: eigenvalues, thresholds, sweep, map, and so on.

What is analysed is a `Scene`, what `read_system` gives, or a `System` made from arrays. The rooms
of pads and of systems are loaded by the first question about one.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.answers import Eigenvalues, Map, Sensitivity, Sweep, Thresholds
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula
from squeal.schema.values import Number, Place, Several

Progress = Callable[[str], None]
Band = tuple[float, float]
Region = tuple[float, float, float, float]
VALUES = Several(Number(), "a sequence of finite numbers")


def _answer(verb: str, subject: object, **asked: Any) -> Any:
    """What the room of pads, or that of systems, answers; both hold functions named like verbs.

    Raises InputError for what a room cannot take.
    """
    scene = isinstance(subject, Scene)
    if scene:
        room = importlib.import_module("squeal.analysis.of_pads")
    else:
        room = importlib.import_module("squeal.analysis.of_systems")
    function = getattr(room, verb)
    taken = inspect.signature(function).parameters
    needed = {name for name, one in taken.items() if one.default is one.empty}
    given = {name: v for name, v in asked.items() if v is not None or name in needed}
    if scene:  # a pad is answered at once
        given = {name: value for name, value in given.items() if name not in ("progress", "keep")}
    for name in given.keys() - taken.keys():
        other = "a scene, which has six roots; a system from matrices is allowed"
        owner = other if scene else "a system of matrices; a scene is allowed"
        raise InputError(f"{name}: {given[name]} is not allowed with {owner}")
    return function(subject, **given)


def System(
    M: Any,
    C: Any = None,
    K: Any = None,
    parameters: Mapping[str, float] | None = None,
    parameter: str = "mu",
    name: str = "system",
) -> TermSystem:
    """A system M q'' + C q' + K q = 0 from arrays in memory.

    Parameters
    ----------
    M, C, K : array_like (n, n), SciPy sparse array, or mapping of formulas to such
        A mapping holds terms by their factors, formulas of the parameters, such as
        ``{"1": K0, "mu": K1}``. C may be left out.
    parameters : mapping of str to float
        Named numbers; the free parameter is 0 if it is not among them.
    parameter : str
        The free parameter, in which thresholds are sought.
    name : str
        What the system is called.

    Raises
    ------
    InputError
        For a matrix that is not square or finite, and a formula with unknown names.

    Examples
    --------
    >>> K0, K1 = [[2, -1], [-1, 2]], [[0, 4 / 3], [0, 0]]
    >>> coupled = System([[1, 0], [0, 1]], K={"1": K0, "mu": K1})
    >>> coupled.n, coupled.parameter
    (2, 'mu')
    """

    def terms(given: Any) -> tuple[Term, ...]:
        if given is None:
            return ()
        each = given.items() if isinstance(given, Mapping) else [("1", given)]
        arrays = ((text, X if hasattr(X, "tocsc") else np.asarray(X)) for text, X in each)
        return tuple(
            Term(X if np.iscomplexobj(X) else X.astype(float), Formula(text)) for text, X in arrays
        )

    if K is None:
        raise InputError("System: K: missing; a matrix or a mapping of formulas to matrices is")
    return TermSystem(terms(M), terms(C), terms(K), dict(parameters or {}), parameter, name)


def eigenvalues(
    subject: object,
    at: float | None = None,
    band: Band | None = None,
    region: Region | None = None,
    modes: int | None = None,
    memory: float | None = None,
    progress: Progress | None = None,
) -> Eigenvalues:
    """Compute eigenvalues, and the verdict on them.

    Parameters
    ----------
    subject : Scene, SystemFile or TermSystem
        A scene is linearised about its sliding equilibrium.
    at : float, optional
        Value of the friction or of the free parameter; left out, the subject's own.
    band : (float, float), optional
        Lowest and highest frequency in Hz, of systems; all growth rates are held.
    region : (float, float, float, float), optional
        Real parts (1/s) from, to, imaginary parts (rad/s) from, to, instead of a band.
    modes : int, optional
        The lowest so many, of systems. Of more than 400 rows 20 if nothing else is wanted.
    memory : float, optional
        Bytes that may be used; left out, what is free.
    progress : callable, optional
        Called with a line for each step of long work.

    Returns
    -------
    Eigenvalues
        Roots in rad/s by rising frequency, unstable modes, and whether a count certifies them.

    Raises
    ------
    InputError
        For what does not fit the subject.
    ComputationError
        If no steady sliding exists, or the system does not fit into the memory.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> squeal.eigenvalues(squeal.System([[1, 0], [0, 1]], K=K), at=1.0).verdict
    'flutter'
    """
    found: Eigenvalues = _answer("eigenvalues", **locals())
    return found


def sweep(
    subject: object,
    values: Sequence[float],
    band: Band | None = None,
    region: Region | None = None,
    modes: int | None = None,
    method: str | None = None,
    memory: float | None = None,
    progress: Progress | None = None,
    keep: Path | None = None,
) -> Sweep:
    """Compute eigenvalues at values of the friction or of the free parameter.

    Parameters
    ----------
    subject, band, region, modes, memory, progress
        As `eigenvalues` takes them; a scene is followed along its branch from mu = 0.
    values : sequence of float
        The values.
    method : {"full", "reduced", "modal"}, optional
        Of systems: every value on the system itself, or on a reduced one of complex or of real
        modes; left out, full up to 400 rows.
    keep : Path, optional
        An output beside which unfinished work is kept until it is complete.

    Returns
    -------
    Sweep
        A step for each value, in their order.

    Raises
    ------
    InputError, ComputationError
        As `eigenvalues`.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> found = squeal.sweep(squeal.System([[1, 0], [0, 1]], K=K), [0.5, 1.0])
    >>> [step.verdict for step in found.steps]
    ['marginal', 'flutter']
    """
    values = VALUES.read(values, Place("sweep", "values"))
    found: Sweep = _answer("sweep", **locals())
    return found


def thresholds(
    subject: object,
    high: float = 2.0,
    low: float | None = None,
    band: Band | None = None,
    region: Region | None = None,
    memory: float | None = None,
    progress: Progress | None = None,
    keep: Path | None = None,
) -> Thresholds:
    """Find every change of stability over a range of the friction or of the free parameter.

    Parameters
    ----------
    subject, band, region, memory, progress, keep
        As `sweep` takes them. A system of more than 400 rows needs a band or a region.
    high : float
        Upper end of the range.
    low : float, optional
        Lower end, of systems; left out, 0, or a little above where a factor divides by the
        parameter.

    Returns
    -------
    Thresholds
        Changes of the verdict, and all crossings of the imaginary axis, by rising value.

    Raises
    ------
    InputError
        For an empty range.
    ComputationError
        If there is no equilibrium without friction.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> found = squeal.thresholds(squeal.System([[1, 0], [0, 1]], K=K))
    >>> found.first.kind, round(found.first.mu, 9)
    ('flutter', 0.75)
    """
    found: Thresholds = _answer("thresholds", **locals())
    return found


def map(
    subject: object,
    axes: tuple[Any, Any] | None = None,
    quantity: str | None = None,
    curves: bool = False,
    band: Band | None = None,
    memory: float | None = None,
    progress: Progress | None = None,
    keep: Path | None = None,
) -> Map:
    """Compute the verdict over two parameters.

    Parameters
    ----------
    subject, band, memory, progress, keep
        As `sweep` takes them.
    axes : (Axis, Axis), optional
        The parameters with their ranges; left out, both spring angles of a scene from 0 to pi.
    quantity : {"critical-friction", "growth", "frequency"}, optional
        A number beside the verdict, of scenes.
    curves : bool
        Whether the curves on which stability is lost are continued too, of scenes.

    Returns
    -------
    Map
        Codes (n1, n2) of verdicts, and shares of the area.

    Raises
    ------
    InputError
        For a parameter that the subject does not use.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, 0], [0, 2]], "gap": [[1, 0], [0, -1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"gap": 0.5})
    >>> axes = squeal.Axis("mu", 0, 1, 9), squeal.Axis("gap", 0, 1, 3)
    >>> squeal.map(pair, axes).share["flutter"]
    0.4444444444444444
    """
    quantity, curves = quantity or None, curves or None  # type: ignore[assignment]
    found: Map = _answer("map_over", **locals())
    return found


def sensitivity(
    subject: object, of: str = "eigenvalues", high: float = 2.0, known: Any = None
) -> Sensitivity:
    """Differentiate the eigenvalues, or the first loss of stability, by each parameter.

    Parameters
    ----------
    subject : Scene, SystemFile or TermSystem
        Of a scene the equilibrium moves with its parameters.
    of : {"eigenvalues", "threshold"}
        What is differentiated; thresholds of scenes alone.
    high : float
        Upper end of the range in which the loss is sought.
    known : Eigenvalues or Thresholds, optional
        The answer to differentiate, where it is known already.

    Returns
    -------
    Sensitivity
        Derivatives per unit of each parameter, exact to rounding.

    Raises
    ------
    InputError
        For a threshold of a system, for which `advise` answers.

    Examples
    --------
    >>> import squeal
    >>> one = squeal.System([[1.0]], K={"k": [[1.0]]}, parameters={"k": 4.0})
    >>> squeal.sensitivity(one).slopes["k"].imag  # of +-i sqrt(k)
    array([ 0.25, -0.25])
    """
    if of not in ("eigenvalues", "threshold"):
        raise InputError(f"of: {of} is not allowed; it must be one of eigenvalues, threshold")
    found: Sensitivity = _answer("sensitivity", **locals())
    return found


def reduce(
    subject: object,
    values: Sequence[float] | None = None,
    band: Band | None = None,
    region: Region | None = None,
    method: str = "reduced",
    memory: float | None = None,
    progress: Progress | None = None,
) -> TermSystem:
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
    TermSystem
        The reduced system, dense.

    Raises
    ------
    InputError
        Without a band or region, and for a scene.
    """
    if isinstance(subject, Scene):
        raise InputError("reduce: a scene is not allowed; it must be a system from matrices")
    if values is not None:
        values = VALUES.read(values, Place("reduce", "values"))
    found: TermSystem = _answer("reduced", **locals())[0].system
    return found
