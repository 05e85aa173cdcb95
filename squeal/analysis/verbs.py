"""One family of verbs for a pad and for matrices: eigenvalues, thresholds, sweep, map, and so on.

What is analysed is a `Scene`, what `read_system` gives, or a `System` made from arrays. Pads are
answered here; the room of systems is loaded by the first question about one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from squeal.analysis import pads
from squeal.analysis.answers import Eigenvalues, Sweep, Thresholds
from squeal.analysis.maps import Axis, Map, stability_map
from squeal.analysis.sensitivity import Sensitivity
from squeal.analysis.sensitivity import sensitivity as pad_sensitivity
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.linear.system import System
from squeal.schema import Place, Positive, Whole, kind_of, public

Progress = Callable[[str], None]
Modes = Annotated[int, Whole(1, 10**6)]
Workers = Annotated[int, Whole(1, 256)]
Band = tuple[float, float]
Region = tuple[float, float, float, float]

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from squeal.io.system import SystemFile
    from squeal.sparse.components import Assembly

    SystemSubject: TypeAlias = System | SystemFile | Assembly
    Subject: TypeAlias = Scene | SystemSubject
    Values: TypeAlias = Sequence[float] | NDArray[np.floating | np.integer]
else:  # systems are loaded by the first question about one, which refuses what is none of these
    Subject = SystemSubject = object
    Values = Sequence[float]


def _refuse_options(subject: Literal["a scene", "a system"], **options: object) -> None:
    """Refuse options that were set, but that this kind of subject does not have.

    Raises InputError.
    """
    other = "a system" if subject == "a scene" else "a scene"
    for name, value in options.items():
        if value is not None and value is not False:
            raise InputError(f"{name}: is not allowed with {subject}; {other} takes it")


@public
def eigenvalues(
    subject: Subject,
    at: float | None = None,
    band: Band | None = None,
    region: Region | None = None,
    modes: Modes | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
    look: Sweep | None = None,
    prove: bool = True,
) -> Eigenvalues:
    """Compute eigenvalues, and the verdict on them.

    Parameters
    ----------
    subject : Scene, System, Assembly or SystemFile
        A scene is linearised about its sliding equilibrium.
    at : float, optional
        Value of the friction or of the free parameter; left out, the subject's own.
    band : (float, float), optional
        Lowest and highest frequency in Hz, of systems; all growth rates are included.
    region : (float, float, float, float), optional
        Real parts (1/s) from, to, imaginary parts (rad/s) from, to, instead of a band.
    modes : int, optional
        The lowest so many, of systems. Of more than 400 rows 20 if nothing else is given.
    memory : float, optional
        Bytes that may be used; left out, what is free.
    progress : callable, optional
        Called with a line for each step of long work.
    look : Sweep, optional
        A first look over the value: above 400 rows its basis answers, and nothing is certified.
    prove : bool
        Whether the referee judges all roots of a pad, or of a system of up to 400 rows. What it
        proves is certified, what hangs on the last digits of the entries has no verdict, and what
        it refutes is replaced.

    Returns
    -------
    Eigenvalues
        Roots in rad/s by rising frequency, unstable modes, and whether a count certifies them.

    Raises
    ------
    InputError
        For what does not fit the subject, as the other verbs do.
    ComputationError
        If no steady sliding exists, or the system does not fit into the memory.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> squeal.eigenvalues(squeal.System([[1, 0], [0, 1]], K=K), at=1.0).verdict
    'flutter'
    """
    if isinstance(subject, Scene):
        _refuse_options("a scene", band=band, region=region, modes=modes, memory=memory, look=look)
        return pads.eigenvalues(subject, at, prove)
    from squeal.analysis.of_systems import Question

    question = Question.of(subject, band, region, modes, memory, progress)
    return question.eigenvalues(at, look, prove)


@public
def sweep(
    subject: Subject,
    values: Values,
    band: Band | None = None,
    region: Region | None = None,
    modes: Modes | None = None,
    method: Literal["full", "reduced", "modal"] | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
    workers: Workers | None = None,
) -> Sweep:
    """Compute eigenvalues at values of the friction or of the free parameter.

    Parameters
    ----------
    subject, band, region, modes, memory, progress
        As `eigenvalues` takes them; a scene is followed along its branch from mu = 0.
    values : sequence of float
        The values.
    method : {"full", "reduced", "modal"}, optional
        Of systems: every value on the system itself, on a reduced one that solves the full problem,
        or a first look: real modes with corrections, and an error of each root. Left out, full up
        to 400 rows, else modal.
    workers : int, optional
        Processes for systems, 1 if left out; any number gives the same answer. They start by
        import: a script must guard its main part.

    Returns
    -------
    Sweep
        A step for each value, in their order.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> sweep = squeal.sweep(squeal.System([[1, 0], [0, 1]], K=K), [0.5, 1.0])
    >>> [step.verdict for step in sweep.steps]
    ['marginal', 'flutter']
    """
    if isinstance(subject, Scene):
        _refuse_options(
            "a scene",
            band=band,
            region=region,
            modes=modes,
            memory=memory,
            method=method,
            workers=workers,
        )
        return pads.sweep(subject, list(values))
    from squeal.analysis.of_systems import Question

    question = Question.of(subject, band, region, modes, memory, progress)
    return question.sweep(list(values), method, workers)


@public
def thresholds(
    subject: Subject,
    high: float = 2.0,
    low: float | None = None,
    band: Band | None = None,
    region: Region | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
    workers: Workers | None = None,
    prove: bool | None = None,
) -> Thresholds:
    """Find every change of stability over a range of the friction or of the free parameter.

    Parameters
    ----------
    subject, band, region, memory, progress, workers
        As `sweep` takes them. A system of more than 400 rows needs a band or a region.
    high : float
        Upper end of the range.
    low : float, optional
        Lower end, of systems; left out, 0, or a little above where a factor divides by the
        parameter.
    prove : bool, optional
        Whether the referee judges the list, which it does if this is left out: of a pad, and of a
        real system of up to 20 rows. `proof` says what is proved, and of which extent.

    Returns
    -------
    Thresholds
        Changes of the verdict, and all crossings of the imaginary axis, by rising value.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> loss = squeal.thresholds(squeal.System([[1, 0], [0, 1]], K=K)).first
    >>> loss.kind, round(loss.mu, 9)
    ('flutter', 0.75)
    """
    if isinstance(subject, Scene):
        _refuse_options(
            "a scene", band=band, region=region, memory=memory, low=low, workers=workers
        )
        return pads.critical_friction(subject, high, prove)
    from squeal.analysis.of_systems import Question

    question = Question.of(subject, band, region, None, memory, progress)
    return question.thresholds(high, low, workers, prove)


@public
def map(
    subject: Subject,
    axes: tuple[Axis, Axis] | None = None,
    quantity: Literal["critical-friction", "growth", "frequency"] | None = None,
    curves: bool = False,
    band: Band | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
    workers: Workers | None = None,
) -> Map:
    """Compute the verdict over two parameters.

    Parameters
    ----------
    subject, band, memory, progress, workers
        As `sweep` takes them.
    axes : (Axis, Axis), optional
        The parameters with their ranges; left out, both spring angles of a scene from 0 to pi.
    quantity : {"critical-friction", "growth", "frequency"}, optional
        A number beside the verdict, of scenes.
    curves : bool
        Whether the curves on which stability is lost are located too, of scenes.

    Returns
    -------
    Map
        Codes (n1, n2) of verdicts, and shares of the area.

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
        _refuse_options("a scene", band=band, memory=memory, workers=workers)
        return stability_map(subject, axes, quantity, curves)
    _refuse_options("a system", quantity=quantity, curves=curves)
    from squeal.analysis.of_systems import Question

    question = Question.of(subject, band, None, None, memory, progress)
    return question.map(axes, workers)


@public
def sensitivity(
    subject: Subject,
    of: Literal["eigenvalues", "threshold"] = "eigenvalues",
    high: float = 2.0,
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
    high, low : float
        Range that is searched for the loss, as `thresholds` takes it.
    matrices : mapping of str to mapping, optional
        Changes of a system that are no parameters: a name for each, and by the keys ``"M"``,
        ``"C"`` and ``"K"`` what it adds to these (n, n), arrays or names of files.
    known : Eigenvalues or Thresholds, optional
        The answer to differentiate, where it is known already.

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
        If several modes cross the imaginary axis at once, or growth changes hands there.

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
    if known is not None:
        kind_of(Eigenvalues if of == "eigenvalues" else Thresholds).read(known, Place("known"))
    if isinstance(subject, Scene):
        _refuse_options(
            "a scene",
            band=band,
            region=region,
            modes=modes,
            memory=memory,
            low=low,
            matrices=matrices,
        )
        return pad_sensitivity(subject, of, high, known)
    from squeal.analysis.of_systems import Question

    question = Question.of(subject, band, region, modes, memory, progress)
    return question.sensitivity(of, high, low, known, matrices)


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
    from squeal.analysis.of_systems import Question

    question = Question.of(subject, band, region, None, memory, progress)
    reduction, _ = question.reduced(None if values is None else list(values), method)
    return reduction.system
