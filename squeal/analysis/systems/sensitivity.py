"""What moves the roots and the thresholds of a system: its parameters, and given matrices."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from squeal.errors import ComputationError, InputError
from squeal.io.matrices import aligned, read_matrix
from squeal.io.matrix_formats import MatrixFile
from squeal.io.system import SystemFile
from squeal.linear import GROWING
from squeal.linear.matrices import given_matrix
from squeal.linear.sensitivity import Singular, crossing_slopes, sensitivities
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula
from squeal.results.columns import basis_text
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.thresholds import Thresholds
from squeal.schema import NAME, Place
from squeal.sparse.assembly import Assembly
from squeal.sparse.factor import factorise_at
from squeal.sparse.quadratic import ScaledSystem

Matrices = Mapping[str, Mapping[str, Any]]
"""Names of changes, each with the matrices dM, dC, dK (arrays or files) by the keys M, C, K."""
OF_THE_REDUCED = "counts are of reduced components; what these move is estimated in each interval"
NEAR = 1e-6  # relative: how far a root may lie from where it is said to cross


def with_matrices(file: SystemFile, matrices: Matrices) -> TermSystem:
    """The system with a parameter of value 0 for each name, a factor of the given matrices; those
    whose files name their rows stand where the system's do.

    Raises InputError.
    """
    system = file.system
    parts, values = {k: list(X) for k, X in zip("MCK", system.parts, strict=True)}, {}
    for name, given in matrices.items():
        at = Place("matrices", NAME.read(name, Place("matrices")))
        if name in system.parameters:
            raise at.refuse("is a parameter of the system; another name is allowed")
        for key, one in given.items():
            if key not in parts:
                raise (at / key).refuse("is not allowed; it must be one of M, C, K")
            with (at / key).named():
                X = _placed(file, read_matrix(one)) if isinstance(one, str | Path) else one
                X = given_matrix(X, real=key == "M")
            if X.shape != (system.n, system.n):
                words = f"shape {X.shape} is not allowed; the system has {system.n} rows"
                raise (at / key).refuse(words)
            parts[key].append(Term(X, Formula(name)))
        values[name] = 0.0
    M, C, K = (tuple(part) for part in parts.values())
    return replace(system, M=M, C=C, K=K, parameters={**system.parameters, **values})


def _placed(file: SystemFile, given: MatrixFile) -> Any:
    """A matrix from a file on the rows of a system."""
    n = len(file.labels)
    if not (n and given.labels):
        return given.matrix
    if foreign := sorted({*given.labels} - {*file.labels}):
        node, way = foreign[0]
        words = f"{len(foreign)} rows, the first is degree of freedom {way} of node {node}"
        raise InputError(f"the system has no {words}; rows of the system are allowed")
    matrix = aligned([MatrixFile(csc_array((n, n)), file.labels), given])[1]
    matrix.resize((file.system.n, file.system.n))  # modal damping adds rows without a name
    return matrix


def derivatives(system: TermSystem) -> dict[str, tuple[Any, Any, Any]]:
    """dM, dC and dK by each parameter."""
    return {name: system.derivative(name) for name in system.parameters}


def root_sensitivity(system: TermSystem, answer: Eigenvalues) -> Sensitivity:
    """What moves the roots of an answer, which the system has."""
    system = system.replace({system.parameter: answer.value})
    every, each = answer.eigenvalues, []
    for group in [(e,) for e in every] if every and system.follows else [every]:
        own = system.frozen(max((e.value.imag for e in group), default=None))
        slopes, condition = sensitivities(own.at(), derivatives(own), group)
        each.append((at_own_frequency(system, slopes, np.imag), condition))
    slopes = {name: np.concatenate([one[name] for one, _ in each]) for name in system.given}
    condition = np.concatenate([one for _, one in each])
    place = "eigenvalues", system.parameter, answer.values, answer.verdict or ""
    return Sensitivity(*place, slopes, system.given, dict.fromkeys(slopes, ""), condition)


def at_own_frequency(
    system: TermSystem, slopes: Mapping[str, NDArray], turned: Callable[[Any], Any]
) -> dict[str, NDArray]:
    """Derivatives of roots or crossings whose matrices follow their frequency, from those at a
    frequency that is held, that by the frequency among them; `turned` says how it moves with one.

    With v = v_q dq + v_w dw, where dw is what v itself makes of the frequency w.
    """
    if not system.follows:
        return dict(slopes)
    by = sum(share * slopes[name] for name, share in system.frequency(1.0).items())
    each = {name: slopes[name] for name in slopes if name not in system.follows}
    return {name: v + by * (turned(v) / (1.0 - turned(by))) for name, v in each.items()}


def threshold_sensitivity(system: TermSystem, answer: Thresholds) -> Sensitivity:
    """What moves the first loss of stability of an answer; nothing where it is lost from the start.

    Raises ComputationError where several roots cross at once.
    """
    first = None if answer.verdict in GROWING else answer.first
    slopes, values = dict[str, NDArray](), system.given
    if first is not None:
        (slopes,) = threshold_slopes(system, [(first.mu, first.frequency_hz)])
    at, kind = (None, "") if first is None else (first.mu, first.kind)
    units = dict.fromkeys(values, "")
    return Sensitivity("threshold", system.parameter, at, kind, slopes, values, units)


def threshold_slopes(
    system: TermSystem, crossings: Sequence[tuple[float, float]]
) -> list[dict[str, NDArray[np.float64]]]:
    """Derivatives of crossings of the imaginary axis, at values of the free parameter and Hz, and
    of their frequencies (2,), by each other parameter. Raises ComputationError."""
    scaled, slopes = ScaledSystem(system), []
    for value, hertz in crossings:
        own = system.replace({system.parameter: value}).frozen(2 * np.pi * hertz)
        changes = derivatives(own)
        by, at = changes.pop(system.parameter), singular_at(scaled, value, 2j * np.pi * hertz)
        pairs = crossing_slopes(at, own.at(), by, changes).items()
        moved = {name: np.array(pair) for name, pair in pairs}
        slopes.append(at_own_frequency(system, moved, lambda pair: 2 * np.pi * pair[1]))
    return slopes


def widened(system: TermSystem, assembly: Assembly, answer: Thresholds) -> Thresholds:
    """Thresholds of an assembly whose intervals hold what its reduction moves, the whole range
    where that is not known."""
    scaled, basis, name = ScaledSystem(system), assembly.reduction or {}, system.parameter

    def shift(value: float, root: complex) -> float:
        own = system.replace({name: value, **system.frequency(abs(root))})
        at = singular_at(scaled, value, root)
        x, y = at.right[:, None], at.left[:, None]
        lack = sum(abs(part.item()) for part in assembly.lack([root], x, y, own.parameters))
        if not math.isfinite(lack):  # beyond the cutoff
            return math.inf
        D = lack * y @ x.conj().T / (np.linalg.norm(x) * np.linalg.norm(y)) ** 2
        changes = {"real": (None, None, D), "imaginary": (None, None, 1j * D)}
        moves = crossing_slopes(at, own.at(), own.derivative(name), changes).values()
        return math.hypot(*(move for move, _ in moves))

    def wide(c: Any) -> Any:
        more, (low, high) = math.inf, c.interval
        with suppress(ComputationError):
            more = shift(c.mu, 2j * np.pi * c.frequency_hz)
        return replace(c, interval=(max(low - more, answer.low), min(high + more, answer.high)))

    doubts = [OF_THE_REDUCED, *(answer.details.get("doubts") or ())]
    details = {**answer.details, "doubts": doubts, "basis": basis}
    more: Any = {"certified": None if answer.certified is None else False, "details": details}
    more |= {"notes": (*answer.notes, basis_text(basis, errors=True))}
    points, crossings = (tuple(map(wide, each)) for each in (answer.points, answer.crossings))
    return replace(answer, points=points, crossings=crossings, **more)


def singular_at(scaled: ScaledSystem, value: float, root: complex) -> Singular:
    """The system where a root crosses the axis at a value of its free parameter.

    Raises ComputationError if none does, or two do.
    """
    name, scale = scaled.system.parameter, scaled.scale
    problem = scaled.at({name: value, **scaled.system.frequency(abs(root))})
    _, factor = factorise_at(problem, root)

    def solve(b: NDArray, adjoint: bool) -> NDArray:
        return factor.solve(b.conj(), True).conj() if adjoint else factor.solve(b)

    # the inverse and its adjoint by turns: singular vectors, a second pair tells a double root
    x: NDArray = np.random.default_rng(1).standard_normal((problem.n, min(2, problem.n))) + 0j
    for _ in range(3):
        y = np.linalg.qr(solve(x, True))[0]
        x = np.linalg.qr(solve(y, False))[0]
    rest = np.abs(np.sum(y.conj() * problem.apply(np.full(x.shape[1], root), x), axis=0))
    mass = (np.abs(np.sum(v.conj() * (problem.M @ v), axis=0)) for v in (x, y))
    near = rest <= NEAR * 2 * abs(root) ** 2 * np.sqrt(np.prod(list(mass), axis=0))
    if root and near.sum() != 1:
        count = "several modes cross" if near.any() else "no mode crosses"
        place = f"{name} = {value:.9g}, {abs(root) / (2 * np.pi):.6g} Hz"
        raise ComputationError(f"{count} the imaginary axis at {place}: no derivative is known")
    vectors = scale * x[:, 0], scale * y[:, 0]
    return Singular(root, *vectors, lambda b, adjoint: scale * solve(scale * b, adjoint))
