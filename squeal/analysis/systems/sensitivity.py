"""What moves the roots and the thresholds of a system: its parameters, and given matrices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.analysis.answers import Eigenvalues, Sensitivity, Thresholds
from squeal.errors import ComputationError
from squeal.io.matrices import read_matrix
from squeal.linear import GROWING
from squeal.linear.matrices import is_sparse
from squeal.linear.sensitivity import Singular, crossing_slopes, sensitivities
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula
from squeal.schema import NAME, Place
from squeal.sparse.quadratic import ScaledSystem, factorise_at

Matrices = Mapping[str, Mapping[str, Any]]
"""Names of changes, each with the matrices dM, dC, dK (arrays or files) by the keys M, C, K."""
NEAR = 1e-6  # relative: how far a root may lie from where it is said to cross


def with_matrices(system: TermSystem, matrices: Matrices) -> TermSystem:
    """The system with a parameter of value 0 for each name, a factor of the given matrices.

    Raises InputError.
    """
    parts, values = {k: list(X) for k, X in zip("MCK", system.parts, strict=True)}, {}
    for name, given in matrices.items():
        at = Place("matrices", NAME.read(name, Place("matrices")))
        if name in system.parameters:
            raise at.refuse("is a parameter of the system; another name is allowed")
        for key, one in given.items():
            if key not in parts:
                raise (at / key).refuse("is not allowed; it must be one of M, C, K")
            with (at / key).named():
                X = read_matrix(one).matrix if isinstance(one, str | Path) else one
            X = X if is_sparse(X) else np.asarray(X)
            if X.shape != (system.n, system.n):
                words = f"shape {X.shape} is not allowed; the system has {system.n} rows"
                raise (at / key).refuse(words)
            parts[key].append(Term(X, Formula(name)))
        values[name] = 0.0
    M, C, K = (tuple(part) for part in parts.values())
    return replace(system, M=M, C=C, K=K, parameters={**system.parameters, **values})


def derivatives(system: TermSystem) -> dict[str, tuple[Any, Any, Any]]:
    """dM, dC and dK by each parameter."""
    return {name: system.derivative(name) for name in system.parameters}


def root_sensitivity(system: TermSystem, answer: Eigenvalues) -> Sensitivity:
    """What moves the roots of an answer, which the system has."""
    system = system.replace({system.parameter: answer.value})
    slopes, condition = sensitivities(system.at(), derivatives(system), answer.eigenvalues)
    values = dict(system.parameters)
    place = "eigenvalues", system.parameter, answer.values, answer.verdict or ""
    return Sensitivity(*place, slopes, values, dict.fromkeys(values, ""), condition)


def threshold_sensitivity(system: TermSystem, answer: Thresholds) -> Sensitivity:
    """What moves the first loss of stability of an answer; nothing where it is lost from the start.

    Raises ComputationError where several roots cross at once.
    """
    first = None if answer.verdict in GROWING else answer.first
    slopes, values = dict[str, Any](), dict(system.parameters)
    if first is not None:
        (moved,) = threshold_slopes(system, [(first.mu, first.frequency_hz)])
        slopes = {name: np.array(pair) for name, pair in moved.items()}
    at, kind = (None, "") if first is None else (first.mu, first.kind)
    units = dict.fromkeys(values, "")
    return Sensitivity("threshold", system.parameter, at, kind, slopes, values, units)


def threshold_slopes(
    system: TermSystem, crossings: Sequence[tuple[float, float]]
) -> list[dict[str, tuple[float, float]]]:
    """Derivatives of crossings of the imaginary axis, at values of the free parameter and Hz, and
    of their frequencies, by each other parameter. Raises ComputationError."""
    scaled, slopes = ScaledSystem(system), []
    for value, hertz in crossings:
        own = system.replace({system.parameter: value})
        changes = derivatives(own)
        by, at = changes.pop(system.parameter), singular_at(scaled, value, 2j * np.pi * hertz)
        slopes.append(crossing_slopes(at, own.at(), by, changes))
    return slopes


def singular_at(scaled: ScaledSystem, value: float, root: complex) -> Singular:
    """The system where a root crosses the axis at a value of its free parameter.

    Raises ComputationError if none does, or two do.
    """
    name, scale = scaled.system.parameter, scaled.scale
    problem = scaled.at({name: value})
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
    return Singular(
        root,
        scale * x[:, 0],
        scale * y[:, 0],
        lambda b, adjoint: scale * solve(scale * b, adjoint),
    )
