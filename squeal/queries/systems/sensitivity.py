"""What moves the roots and the thresholds of a system: its parameters, and given matrices."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from squeal.errors import ComputationError, InputError
from squeal.io.formats.matrix_file import MatrixFile
from squeal.io.matrices import aligned, read_matrix
from squeal.io.system import SystemFile
from squeal.linear import GROWING, CriticalPoint, Crossing
from squeal.linear.matrices import Change, given_matrix
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
ITERATIONS = 3  # of the inverse and its adjoint, for singular vectors
NEAR = 1e-6  # relative: how far a root may lie from where it is said to cross
Located = TypeVar("Located", CriticalPoint, Crossing)


def with_matrices(file: SystemFile, matrices: Matrices) -> TermSystem:
    """The system with a parameter of value 0 for each name, a factor of the given matrices; those
    whose files name their rows stand where the system's do.

    Raises InputError.
    """
    system = file.system
    parts = {"M": list(system.M), "C": list(system.C), "K": list(system.K)}
    parameters = dict(system.parameters)
    for name, changes in matrices.items():
        at = Place("matrices", NAME.read(name, Place("matrices")))
        if name in system.parameters:
            raise at.refuse("is a parameter of the system; another name is allowed")
        for part, given in changes.items():
            if part not in parts:
                raise (at / part).refuse("is not allowed; it must be one of M, C, K")
            with (at / part).named():
                if isinstance(given, str | Path):
                    given = _on_rows_of(file, read_matrix(given))
                matrix = given_matrix(given, real=part == "M")
            if matrix.shape != (system.n, system.n):
                words = f"shape {matrix.shape} is not allowed; the system has {system.n} rows"
                raise (at / part).refuse(words)
            parts[part].append(Term(matrix, Formula(name)))
        parameters[name] = 0.0
    return replace(
        system,
        M=tuple(parts["M"]),
        C=tuple(parts["C"]),
        K=tuple(parts["K"]),
        parameters=parameters,
    )


def _on_rows_of(file: SystemFile, given: MatrixFile) -> Any:
    """A matrix from a file on the rows of a system."""
    labelled = len(file.labels)
    if not (labelled and given.labels):
        return given.matrix
    foreign = sorted({*given.labels} - {*file.labels})
    if foreign:
        node, direction = foreign[0]
        words = f"{len(foreign)} rows, the first is degree of freedom {direction} of node {node}"
        raise InputError(f"the system has no {words}; rows of the system are allowed")
    empty = MatrixFile(csc_array((labelled, labelled)), file.labels)
    _, matrix = aligned([empty, given])
    matrix.resize((file.system.n, file.system.n))  # modal damping adds rows without a name
    return matrix


def derivatives(system: TermSystem) -> dict[str, Change]:
    """dM, dC and dK by each parameter."""
    return {name: system.derivative(name) for name in system.parameters}


def root_sensitivity(system: TermSystem, answer: Eigenvalues) -> Sensitivity:
    """What moves the roots of an answer, which the system has."""
    system = system.replace({system.parameter: answer.value})
    roots = answer.eigenvalues
    # of matrices that follow the frequency each root has its own
    groups = [(root,) for root in roots] if roots and system.follows else [roots]
    slopes_of_groups = []
    conditions = []
    for group in groups:
        omega = max((root.value.imag for root in group), default=None)
        frozen = system.frozen(omega)
        slopes, condition = sensitivities(frozen.at(), derivatives(frozen), group)
        slopes_of_groups.append(at_own_frequency(system, slopes, np.imag))
        conditions.append(condition)
    values = system.given
    return Sensitivity(
        what="eigenvalues",
        parameter=system.parameter,
        at=answer.values,
        kind=answer.verdict or "",
        slopes={
            name: np.concatenate([slopes[name] for slopes in slopes_of_groups]) for name in values
        },
        values=values,
        units=dict.fromkeys(values, ""),
        condition=np.concatenate(conditions),
    )


def at_own_frequency(
    system: TermSystem,
    slopes: Mapping[str, NDArray],
    frequency_slope: Callable[[NDArray], NDArray],
) -> dict[str, NDArray]:
    """Derivatives of roots or crossings whose matrices follow their frequency, from those at a
    frequency that is held, that by the frequency among them.

    With v = v_q dq + v_w dw, where dw is what v itself makes of the frequency w:
    `frequency_slope` of a derivative of v.
    """
    if not system.follows:
        return dict(slopes)
    shares = system.frequency(1.0)
    by_frequency = np.asarray(sum(shares[name] * slopes[name] for name in shares))
    moved = {}
    for name, held in slopes.items():
        if name not in system.follows:
            turned = frequency_slope(held) / (1.0 - frequency_slope(by_frequency))
            moved[name] = held + by_frequency * turned
    return moved


def threshold_sensitivity(system: TermSystem, answer: Thresholds) -> Sensitivity:
    """What moves the first loss of stability of an answer; nothing where it is lost from the start.

    Raises ComputationError where several roots cross at once.
    """
    first = None if answer.verdict in GROWING else answer.first
    slopes: dict[str, NDArray] = {}
    if first is not None:
        (slopes,) = threshold_slopes(system, [(first.mu, first.frequency_hz)])
    values = system.given
    return Sensitivity(
        what="threshold",
        parameter=system.parameter,
        at=None if first is None else first.mu,
        kind="" if first is None else first.kind,
        slopes=slopes,
        values=values,
        units=dict.fromkeys(values, ""),
    )


def threshold_slopes(
    system: TermSystem, crossings: Sequence[tuple[float, float]]
) -> list[dict[str, NDArray[np.float64]]]:
    """Derivatives of crossings of the imaginary axis, at values of the free parameter and Hz, and
    of their frequencies (2,), by each other parameter. Raises ComputationError."""
    scaled = ScaledSystem(system)
    slopes = []
    for value, hertz in crossings:
        omega = 2 * np.pi * hertz
        frozen = system.replace({system.parameter: value}).frozen(omega)
        changes = derivatives(frozen)
        by_parameter = changes.pop(system.parameter)
        at = singular_at(scaled, value, 1j * omega)
        moved = {}
        for name, pair in crossing_slopes(at, frozen.at(), by_parameter, changes).items():
            moved[name] = np.array(pair)
        slopes.append(at_own_frequency(system, moved, lambda pair: 2 * np.pi * pair[1]))
    return slopes


def widened_by_reduction(system: TermSystem, assembly: Assembly, answer: Thresholds) -> Thresholds:
    """Thresholds of an assembly whose intervals hold what its reduction moves, the whole range
    where that is not known."""
    scaled = ScaledSystem(system)
    parameter = system.parameter

    def shift(value: float, root: complex) -> float:
        frozen = system.replace({parameter: value, **system.frequency(abs(root))})
        at = singular_at(scaled, value, root)
        x = at.right[:, None]
        y = at.left[:, None]
        residuals = assembly.lack([root], x, y, frozen.parameters)
        residual = sum(abs(part.item()) for part in residuals)
        if not math.isfinite(residual):  # beyond the cutoff
            return math.inf
        dK = residual * y @ x.conj().T / (np.linalg.norm(x) * np.linalg.norm(y)) ** 2
        changes = {"real": (None, None, dK), "imaginary": (None, None, 1j * dK)}
        moves = crossing_slopes(at, frozen.at(), frozen.derivative(parameter), changes)
        return math.hypot(moves["real"][0], moves["imaginary"][0])

    def widened(located: Located) -> Located:
        distance = math.inf
        with suppress(ComputationError):
            distance = shift(located.mu, 2j * np.pi * located.frequency_hz)
        low, high = located.interval
        interval = (max(low - distance, answer.low), min(high + distance, answer.high))
        return replace(located, interval=interval)

    basis = assembly.reduction or {}
    doubts = [OF_THE_REDUCED, *(answer.details.get("doubts") or ())]
    return replace(
        answer,
        points=tuple(widened(point) for point in answer.points),
        crossings=tuple(widened(crossing) for crossing in answer.crossings),
        certified=None if answer.certified is None else False,
        details={**answer.details, "doubts": doubts, "basis": basis},
        notes=(*answer.notes, basis_text(basis, errors=True)),
    )


def singular_at(scaled: ScaledSystem, value: float, root: complex) -> Singular:
    """The system where a root crosses the axis at a value of its free parameter.

    Raises ComputationError if none does, or two do.
    """
    system = scaled.system
    problem = scaled.at({system.parameter: value, **system.frequency(abs(root))})
    _, factor = factorise_at(problem, root)

    def solve(b: NDArray, adjoint: bool) -> NDArray:
        return factor.solve(b.conj(), True).conj() if adjoint else factor.solve(b)

    # the inverse and its adjoint by turns: singular vectors, a second pair tells a double root
    count = min(2, problem.n)
    x: NDArray = np.random.default_rng(1).standard_normal((problem.n, count)) + 0j
    for _ in range(ITERATIONS):
        y = np.linalg.qr(solve(x, True))[0]
        x = np.linalg.qr(solve(y, False))[0]
    residual = np.abs(np.sum(y.conj() * problem.apply(np.full(count, root), x), axis=0))
    mass_of_x = np.abs(np.sum(x.conj() * (problem.M @ x), axis=0))
    mass_of_y = np.abs(np.sum(y.conj() * (problem.M @ y), axis=0))
    near = residual <= NEAR * 2 * abs(root) ** 2 * np.sqrt(mass_of_x * mass_of_y)
    if root and near.sum() != 1:
        crosses = "several modes cross" if near.any() else "no mode crosses"
        where = f"{system.parameter} = {value:.9g}, {abs(root) / (2 * np.pi):.6g} Hz"
        raise ComputationError(f"{crosses} the imaginary axis at {where}: no derivative is known")
    scale = scaled.scale
    return Singular(
        root,
        scale * x[:, 0],
        scale * y[:, 0],
        lambda b, adjoint: scale * solve(scale * b, adjoint),
    )
