"""Derivatives of the roots and thresholds of a system, by parameters and by changes of matrices."""

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
from squeal.io.matrices import OTHER_ROWS, on_rows, precision_of_file, read_matrix
from squeal.io.system import SystemFile
from squeal.linear import GROWING, CriticalPoint, Crossing
from squeal.linear.digits import data_errors
from squeal.linear.labels import labels_of, refuse_other_labels
from squeal.linear.matrices import MCK, Array, given_matrix
from squeal.linear.precision import precision_of_floats, short_floats
from squeal.linear.sensitivity import Singular, crossing_slopes, sensitivities
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.linear.verdicts import ACCEPTED
from squeal.numerics.differentiation import Formula
from squeal.queries.systems.data_precision import digits_of_files
from squeal.results.columns import basis_text
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.thresholds import Thresholds
from squeal.schema import NAME, Place
from squeal.sparse.assembly import Assembly
from squeal.sparse.factor import factorise_at
from squeal.sparse.quadratic import ComplexArray, ScaledProblem, ScaledSystem

Matrices = Mapping[str, Mapping[str, Any]]
"""Names of changes, each with the matrices dM, dC, dK (arrays or files) by the keys M, C, K."""
ITERATIONS = 3
"""How often the inverse and its adjoint are applied for singular vectors."""
NEAR = 1e-6
"""The relative distance within which a root has to lie from the point where it is said to cross."""
ROUNDED = 1e-12
"""Of the sizes of its terms: up to it y^H K x is zero to rounding, so that a root is zero."""
Located = TypeVar("Located", CriticalPoint, Crossing)


def with_matrices(file: SystemFile, matrices: Matrices) -> TermSystem:
    """Add given changes of matrices to a system, each multiplied by a new parameter of value 0.

    At 0 the system is the given one; the derivatives by the new parameters are the effects of the
    changes.

    Parameters
    ----------
    file : SystemFile
        The system.
    matrices : mapping of str to mapping
        For each new parameter what it adds to M, C and K: arrays (n, n), data frames with the
        system's labels, or files whose labelled rows are placed where the system has them.

    Raises
    ------
    InputError
        For a name that is a parameter already, and for matrices that do not fit the system.
    """
    system = file.system
    parts = {"M": list(system.M), "C": list(system.C), "K": list(system.K)}
    parameters = dict(system.parameters)
    assumptions: tuple[str, ...] = ()
    for name, changes in matrices.items():
        at = Place("matrices", NAME.read(name, Place("matrices")))
        if name in system.parameters:
            raise at.refuse("is a parameter of the system; another name is allowed")
        for part, source in changes.items():
            if part not in parts:
                raise (at / part).refuse("is not allowed; it must be one of M, C, K")
            with (at / part).prefixing_errors():  # a refusal inside begins with this key
                array = source
                # to how many digits the entries are known (None: exactly), and how far each may be
                # off where that is not half a unit of the last digit
                precision = None
                if isinstance(source, str | Path):
                    content = read_matrix(source)
                    array = _on_rows_of(system, content)
                    precision = precision_of_file(content, array)
                    assumptions += content.assumptions
                _refuse_frame_of_other_rows(system, source)
                matrix = given_matrix(array, real=part == "M")  # C and K may be complex
                if precision is None:
                    precision = precision_of_floats(matrix, short_floats(source))
            if matrix.shape != (system.n, system.n):
                reason = f"shape {matrix.shape} is not allowed; the system has {system.n} rows"
                raise (at / part).refuse(reason)
            digits, errors = precision
            parts[part].append(Term(matrix, Formula(name), digits, errors=errors))
        parameters[name] = 0.0
    return replace(
        system,
        M=tuple(parts["M"]),
        C=tuple(parts["C"]),
        K=tuple(parts["K"]),
        parameters=parameters,
    ).assuming(*assumptions)


def _refuse_frame_of_other_rows(system: TermSystem, source: object) -> None:
    """Raise InputError for a data frame whose labels are not those of the system's rows."""
    labels = labels_of(source)
    if labels is not None and system.labels:
        index, columns = labels
        refuse_other_labels({"rows": list(system.labels), "index": index, "columns": columns})


def _on_rows_of(system: TermSystem, file: MatrixFile) -> csc_array:
    """A matrix from a file on the rows of a system, by their labels where both have them.

    Rows that a file without a size leaves out at its end are empty. Raises InputError for labelled
    rows that the system has not.
    """
    if not (system.labels and file.labels):
        matrix = file.matrix
        if file.open_ended and matrix.shape[0] < system.n:  # the caller refuses a larger matrix
            matrix.resize((system.n, system.n))
        return matrix
    if file.numbered and file.labels != system.labels:  # some labels are mere numbers of rows
        raise InputError(OTHER_ROWS)
    foreign = sorted({*file.labels} - {*system.labels})
    if foreign:
        node, direction = foreign[0]
        rows = f"{len(foreign)} rows, the first is degree of freedom {direction} of node {node}"
        raise InputError(f"the system has no {rows}; rows of the system are allowed")
    matrix = on_rows(file, system.labels)
    # a system with modal damping has rows without labels behind the labelled ones: they stay empty
    matrix.resize((system.n, system.n))
    return matrix


def derivatives(system: TermSystem) -> dict[str, MCK]:
    """dM, dC and dK by each parameter."""
    return {name: system.derivative(name) for name in system.parameters}


def root_sensitivity(system: TermSystem, answer: Eigenvalues) -> Sensitivity:
    """Compute the derivatives of the eigenvalues of an answer by each parameter of its system.

    Derivatives are in rad/s per unit of the parameter; the real part is the derivative of the
    growth rate. Where matrices follow the frequency the derivatives are total: each root keeps
    matrices at its own frequency. Derivatives of a root that does not solve the equations are NaN.
    """
    at_value = system.replace({system.parameter: answer.value})
    groups = [answer.eigenvalues]  # roots that share their matrices; one empty group if no roots
    if answer.eigenvalues and system.follows:  # each root has matrices of its own frequency
        groups = [(root,) for root in answer.eigenvalues]
    slopes_of_groups = []
    conditions = []
    for group in groups:
        # rad/s, of the only root of a group; of more roots `frozen` makes no use of it, as then no
        # matrix follows the frequency
        omega = max((root.value.imag for root in group), default=None)
        frozen = at_value.frozen(omega)
        at_held_frequency, condition = sensitivities(frozen.at(), derivatives(frozen), group)
        # of a root v the frequency in rad/s is Im v
        slopes_of_groups.append(at_own_frequency(at_value, at_held_frequency, np.imag))
        conditions.append(condition)
    is_solved = [root.residual <= ACCEPTED for root in answer.eigenvalues]
    values = at_value.given
    slopes = {}
    for name in values:
        slopes_of_roots = np.concatenate([slopes_of[name] for slopes_of in slopes_of_groups])
        slopes[name] = np.where(is_solved, slopes_of_roots, np.nan)
    return Sensitivity(
        what="eigenvalues",
        parameter=system.parameter,
        at=answer.values,
        kind=answer.verdict or "",
        slopes=slopes,
        values=values,
        units=dict.fromkeys(values, ""),
        condition=np.where(is_solved, np.concatenate(conditions), np.nan),
        modes=answer.modes,
    )


def at_own_frequency(
    system: TermSystem,
    slopes: Mapping[str, NDArray],
    frequency_slope: Callable[[NDArray], NDArray],
) -> dict[str, NDArray]:
    """Total derivatives of roots or crossings whose matrices depend on their own frequency.

    A root v depends on a parameter q directly and by its frequency w: dv = v_q dq + v_w dw. The
    frequency is that of the root, w = f(v) with a linear f, so that dw = f(v_q) / (1 - f(v_w)) dq.

    Parameters
    ----------
    system : TermSystem
        The system; without matrices that follow the frequency the slopes are returned as they are.
    slopes : mapping of str to array
        Partial derivatives at a held frequency: v_q by each parameter, also by the parameters that
        are the frequency: `omega` in rad/s, `frequency` in Hz, or both. v_w is the sum of the
        derivatives by `omega` and by `frequency`, each converted to rad/s.
    frequency_slope : callable
        f: the derivative of the frequency in rad/s from a derivative of v.

    Returns
    -------
    dict of str to array
        Total derivatives by each parameter but those that are the frequency.
    """
    if not system.follows:
        return dict(slopes)
    per_omega = system.frequency(1.0)  # their values at 1 rad/s: {"omega": 1, "frequency": 1/2pi}
    v_omega = np.asarray(sum(per_omega[name] * slopes[name] for name in per_omega))
    total = {}
    for name, v_q in slopes.items():
        if name not in system.follows:
            slope_of_omega = frequency_slope(v_q) / (1.0 - frequency_slope(v_omega))
            total[name] = v_q + v_omega * slope_of_omega
    return total


def threshold_sensitivity(system: TermSystem, answer: Thresholds) -> Sensitivity:
    """Compute the derivatives of the first loss of stability of an answer by each parameter.

    There are no derivatives where the system is unstable from the start of the range, or nowhere in
    it. Raises ComputationError where several modes cross at once, or none crosses at that point.
    """
    # a verdict in `GROWING` says that the system is unstable from the start of the range
    first = None if answer.verdict in GROWING else answer.first
    slopes: dict[str, NDArray] = {}
    if first is not None:  # first.mu is the value of the free parameter, whatever its name
        # one crossing is passed, so that the list holds one dictionary
        (slopes,) = threshold_slopes(system, [(first.mu, first.frequency_hz)])
    values = system.given  # the parameters with their values
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
) -> list[dict[str, Array]]:
    """Compute how crossings of the imaginary axis move with each parameter but the free one.

    Parameters
    ----------
    system : TermSystem
        The system, real and not reduced.
    crossings : sequence of (float, float)
        Of each crossing the value of the free parameter and the frequency in Hz.

    Returns
    -------
    list of dict
        For each crossing, by parameter, the derivatives (2,) of its value and of its frequency.

    Raises
    ------
    ComputationError
        Where several modes cross at once, or none does.
    """
    scaled = ScaledSystem(system)
    slopes = []
    for value, hertz in crossings:
        omega = math.tau * hertz
        frozen = system.replace({system.parameter: value}).frozen(omega)
        matrix_slopes = derivatives(frozen)  # dM, dC, dK by each parameter
        del matrix_slopes[system.parameter]
        null = singular_at(scaled, value, 1j * omega)
        slopes.append(_slopes_of_crossing(system, null, frozen, matrix_slopes))
    return slopes


def _slopes_of_crossing(
    system: TermSystem, null: Singular, frozen: TermSystem, matrix_slopes: dict[str, MCK]
) -> dict[str, Array]:
    """For each change of the matrices the derivatives (2,) of a crossing: of the value of the free
    parameter, and of the frequency in Hz.

    null: P of the root on the imaginary axis, with its null vectors; frozen: the system at the
    crossing; matrix_slopes: dM, dC and dK of each change, by its name.
    Where matrices follow the frequency, their derivatives by it are among `matrix_slopes`.
    """
    by_free_parameter = frozen.derivative(system.parameter)
    at_held_frequency = {}
    pairs = crossing_slopes(null, frozen.at(), by_free_parameter, matrix_slopes)
    for name, pair in pairs.items():
        at_held_frequency[name] = np.array(pair)
    # pair[1] is the derivative of the frequency in Hz
    return at_own_frequency(system, at_held_frequency, lambda pair: math.tau * pair[1])


def widened(file: SystemFile, system: TermSystem, answer: Thresholds) -> Thresholds:
    """Widen the interval of each threshold by how far it may move, to first order; a note says so.

    The reduction of components may move it, and what the digits of data leave open. The distance is
    not known where several modes cross at once, and above the cutoff of reduced components. There
    the interval becomes the whole range, and the thresholds are no longer certified.
    Proved thresholds keep their intervals, which hold for all data within the digits.

    system: that of the file, as it was analysed.
    """
    assembly = file.assembly
    basis = None if assembly is None else assembly.reduction
    notes = list(answer.notes)
    details = dict(answer.details)
    if basis:
        notes.append(basis_text(basis, errors=True))
        details["basis"] = basis
    if system.digits and (answer.crossings or answer.points):
        note = f"intervals include what {digits_of_files(file)} leave open"
        if not answer.is_proved:
            note += ", to first order"
        notes.append(note)
    answer = replace(answer, notes=tuple(notes), details=details)
    if answer.is_proved or not (basis or system.digits):
        return answer
    scaled = ScaledSystem(system)

    def widened_one(located: Located) -> Located:
        distance = math.inf  # of several modes that cross at once `_shift` gives none
        with suppress(ComputationError):
            omega = math.tau * located.frequency_hz
            distance = _shift(scaled, assembly if basis else None, located.mu, omega)
        low, high = located.interval
        interval = (max(low - distance, answer.low), min(high + distance, answer.high))
        return replace(located, interval=interval)

    points = tuple(map(widened_one, answer.points))
    crossings = tuple(map(widened_one, answer.crossings))
    certified = answer.certified
    # crossings alone are tested: each point of a certified answer is a crossing, too
    whole_range = (answer.low, answer.high)  # the interval where the distance is infinite
    if certified and any(crossing.interval == whole_range for crossing in crossings):
        certified = False
        doubt = f"how far {digits_of_files(file)} may move a threshold is not known"
        details = details | {"doubts": [doubt, *answer.doubts]}
    return replace(answer, points=points, crossings=crossings, certified=certified, details=details)


def _shift(scaled: ScaledSystem, reduced: Assembly | None, value: float, omega: float) -> float:
    """Bound how far reduction and digits may move a crossing, in units of the parameter.

    Reduction and digits leave open a part dP of P. Of r = y^H dP x, with the mode x and its left
    vector y, the size |r| is known and the phase is not. The smallest change of K with
    y^H dK x = r is dK = r y x^H / (|x| |y|)^2. It moves the crossing by s for a real r, by t for an
    imaginary one (dK and i dK), and by s cos(phase) + t sin(phase) for another: by (s^2 + t^2)^1/2
    at most. Where matrices follow the frequency, s and t include that the frequency of the crossing
    moves too.

    Parameters
    ----------
    scaled : ScaledSystem
        The system.
    reduced : Assembly or None
        The assembly if its components were reduced.
    value, omega : float
        The free parameter and the frequency (rad/s) at the crossing.

    Returns
    -------
    float
        Infinite where |r| is not known, as above the cutoff of components.

    Raises
    ------
    ComputationError
        Where several modes cross at once, or none does.
    """
    system = scaled.system
    root = 1j * omega
    frozen = system.replace({system.parameter: value, **system.frequency(omega)})
    null = singular_at(scaled, value, root)
    size = _open_residual(frozen, reduced, null, root)  # |r|
    if not math.isfinite(size):
        return math.inf
    x = null.right[:, None]
    y = null.left[:, None]
    dK = size * y @ x.conj().T / (np.linalg.norm(x) * np.linalg.norm(y)) ** 2
    matrix_slopes: dict[str, MCK] = {"real": (None, None, dK), "imaginary": (None, None, 1j * dK)}
    for name in system.follows:  # `omega` or `frequency`
        matrix_slopes[name] = frozen.derivative(name)
    slopes = _slopes_of_crossing(system, null, frozen, matrix_slopes)
    # the first derivative is that of the value
    return math.hypot(slopes["real"][0], slopes["imaginary"][0])


def _open_residual(
    frozen: TermSystem, reduced: Assembly | None, null: Singular, root: complex
) -> float:
    """A bound of |y^H dP x| at a root, rad/s, on the axis: dP is what reduction and digits leave
    open of P = root^2 M + root C + K, x and y are the null vectors of P."""
    x = np.abs(null.right)
    y = np.abs(null.left)
    dM, dC, dK = data_errors(frozen)
    bound = float(y @ (abs(root) ** 2 * (dM @ x) + abs(root) * (dC @ x) + dK @ x))
    if reduced is not None:
        vectors = null.right[:, None], null.left[:, None]
        truncation = reduced.truncation_term([root], *vectors, frozen.parameters)
        bound += abs(truncation.value.item()) + abs(truncation.uncertainty.item())
    return bound


def singular_at(scaled: ScaledSystem, value: float, root: complex) -> Singular:
    """Compute the null vectors of P = z^2 M + z C + K at a root z on the imaginary axis.

    Inverse iteration, by turns with P^-1 and P^-H: P is nearly singular, so that the singular
    vectors of its least singular value dominate. A second pair of vectors is iterated too: if it
    also solves the equations, two roots cross at once.

    Parameters
    ----------
    scaled : ScaledSystem
        The system.
    value : float
        The value of the free parameter at which the root crosses the axis.
    root : complex
        z in rad/s, which may be 0.

    Returns
    -------
    Singular
        Right and left vectors x and y (n,) with P x = 0 and y^H P = 0, and the solution with P.

    Raises
    ------
    ComputationError
        If no root crosses there, which at zero is not checked, or two do.
    """
    system = scaled.system
    changes = {system.parameter: value, **system.frequency(abs(root))}
    problem = scaled.at(changes)
    _, factor = factorise_at(problem, root)  # next to the root where P is exactly singular

    def solve(b: NDArray, adjoint: bool) -> NDArray:
        """P^-1 b, or P^-H b."""
        if adjoint:  # P^H is the conjugate of the transpose, which the factor solves with
            return factor.solve(b.conj(), transposed=True).conj()
        return factor.solve(b)

    pairs = min(2, problem.n)
    x: NDArray = np.random.default_rng(1).standard_normal((problem.n, pairs)) + 0j
    for _ in range(ITERATIONS):
        # the first factor of QR is an orthonormal basis of the columns
        y = np.linalg.qr(solve(x, adjoint=True))[0]
        x = np.linalg.qr(solve(y, adjoint=False))[0]
    # of each pair |y^H P x| (pairs,), and how large it is at most for a root to cross here
    residuals = np.abs(np.sum(y.conj() * problem.apply(np.full(pairs, root), x), axis=0))
    if root:
        largest = _residuals_nearby(problem, root, x, y)
    else:
        # at a root of zero P is K, and `NEAR` |z| is 0: y^H K x is compared with rounding of its
        # terms instead. The term of the parameter may cancel others, so that it counts by its size
        parameter_term = abs(value) * abs(scaled.slope(system.parameter, changes, root))
        sizes = (abs(problem.K) + parameter_term) @ np.abs(x)
        largest = ROUNDED * np.sum(np.abs(y) * sizes, axis=0)
        largest[0] = np.inf  # the first pair counts as a root: only the second one is checked
    crosses_here = residuals <= largest  # (pairs,)
    if crosses_here.sum() != 1:
        crosses = "several modes cross" if crosses_here.any() else "no mode crosses"
        where = f"{system.parameter} = {value:.9g}, {abs(root) / math.tau:.6g} Hz"
        raise ComputationError(f"{crosses} the imaginary axis at {where}: no derivative is known")
    scale = scaled.scale  # of the rows and columns: back to the coordinates of the system

    def solve_unscaled(b: NDArray, adjoint: bool) -> NDArray:
        return scale * solve(scale * b, adjoint)

    return Singular(root, scale * x[:, 0], scale * y[:, 0], solve_unscaled)


def _residuals_nearby(
    problem: ScaledProblem, root: complex, x: ComplexArray, y: ComplexArray
) -> NDArray[np.float64]:
    """How large |y^H P x| (k,) is if a root lies `NEAR` |z| away from z, for columns x, y (n, k).

    A root that lies dz away has y^H P x = dz y^H (2 z M + C) x. The larger of both terms is taken:
    of a mode without mass that is the one of C.
    """

    def magnitude(X: csc_array) -> NDArray[np.float64]:
        """(|x^H X x| |y^H X y|)^1/2 (k,), in place of |y^H X x|, which is 0 at a double root."""
        x_form = np.abs(np.sum(x.conj() * (X @ x), axis=0))
        y_form = np.abs(np.sum(y.conj() * (X @ y), axis=0))
        return np.sqrt(x_form * y_form)

    by_mass = 2 * abs(root) ** 2 * magnitude(problem.M)
    by_damping = abs(root) * magnitude(problem.C)
    return NEAR * np.maximum(by_mass, by_damping)
