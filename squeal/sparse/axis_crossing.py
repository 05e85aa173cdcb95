"""One crossing of the imaginary axis by a root of the full system, from a guess close by.

On the axis lambda = i omega. Newton's method looks for the frequency omega and the parameter p at
which P(i omega, p) is singular, with right and left vectors x, y: P x = 0 and y^H P = 0. The
complex equation y^H P(i omega, p) x = 0 has two real unknowns, and because y^H P and P x vanish at
the solution, errors of the vectors change it in second order only. Each step also corrects the
vectors by inverse iteration, x = P^-1 y and y = P^-H x, or by their residuals, with the factor of
an earlier step (residual inverse iteration, Neumaier, SIAM J. Numer. Anal. 22, 1985).

The interval of a crossing holds what rounding of P x may move p. Without a root near the guess, or
where two crossings coincide (the Jacobian is singular there), no crossing is returned; the caller
then reports the guess.
"""

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, InputError
from squeal.linear.events import Event
from squeal.linear.matrices import EPS
from squeal.sparse.factor import factorise_at
from squeal.sparse.quadratic import ComplexArray, ScaledSystem

SAME_SHARE = 1e-7  # relative: crossings closer than this are one
NEWTON_STEPS = 20  # to a crossing, at most
STEPS_PER_FACTOR = 3  # steps of Newton's method: the later ones correct vectors by residuals
STAGNANT_STEP = 1e-9  # relative to p: after all steps, one so small is rounding
CONVERGED_STEP = 1e-12  # step relative to p and omega; its error is the square


class CrossingGuess(NamedTuple):
    """Where a crossing of the imaginary axis is expected nearby."""

    value: float  # of the parameter
    omega: float  # rad/s, 0 of a real root
    right: NDArray  # vector (n,) in the scaled coordinates
    left: NDArray  # as `right`


@dataclass(frozen=True, eq=False, kw_only=True)
class AxisCrossing(Event):
    """A pair or a real root (omega 0) of the full system on the imaginary axis.

    `interval` holds the parameter's value with rounding taken into account, `residual` is the
    backward error there, `slope` is d Re lambda / dp (1/s per unit of p), `right` and
    `left` (n,) are its vectors in the scaled coordinates, of unit length.
    """

    slope: float
    right: ComplexArray = field(repr=False)
    left: ComplexArray = field(repr=False)


def is_same_crossing(crossing: AxisCrossing, other: AxisCrossing) -> bool:
    """Whether two crossings agree in parameter, direction, frequency and mode."""
    distance = SAME_SHARE * max(abs(crossing.value), abs(other.value))
    distance += crossing.width + other.width
    return bool(
        crossing.direction == other.direction
        and abs(crossing.value - other.value) <= distance
        and abs(crossing.omega - other.omega) <= SAME_SHARE * max(crossing.omega, other.omega)
        and abs(np.vdot(crossing.right, other.right)) > 0.5
    )


def axis_crossing(scaled: ScaledSystem, name: str, guess: CrossingGuess) -> AxisCrossing:
    """The crossing of the imaginary axis next to a guess, along the parameter p called `name`.

    There P = P(i omega, p) is singular, P x = 0 and y^H P = 0. Newton's method for p and omega with
    y^H P x = 0 alternates with inverse iteration for the unit vectors: x = P^-1 y and y = P^-H x
    lead to the singular vectors of the smallest singular value of P, which becomes zero. A factor
    of P serves `STEPS_PER_FACTOR` steps; in the later ones it corrects x by the residual P x and y
    by P^H y (residual inverse iteration, Neumaier 1985).

    Raises ComputationError if it does not converge: no crossing is near, or two coincide.
    """
    value = guess.value
    omega = guess.omega
    x = guess.right / np.linalg.norm(guess.right)
    y = guess.left / np.linalg.norm(guess.left)
    for k in range(NEWTON_STEPS):
        try:
            problem = scaled.at({name: value, **scaled.system.frequency(omega)})
        except InputError:
            break  # a step led beyond a table of the parameter, or to a pole
        # P^-H b is computed as the conjugate of P^-T conj(b)
        if k % STEPS_PER_FACTOR == 0:
            _, factor = factorise_at(problem, complex(0.0, omega))
            right = factor.solve(y)
            left = factor.solve(x.conj(), transposed=True).conj()
        else:  # with the factor of an earlier step
            P = problem.at(complex(0.0, omega))
            right = x - factor.solve(P @ x)
            left = y - factor.solve(P.T @ y.conj(), transposed=True).conj()
        x = _unit(right, x)
        y = _unit(left, y)
        step = _newton_step(scaled, name, CrossingGuess(value, omega, x, y))
        if step is None:
            break
        crossing = step.crossing
        if step.is_converged:
            return crossing
        change = abs(crossing.value - value)
        value = crossing.value
        omega = crossing.omega
    else:  # after the last step: none has converged, and none has failed
        # terms that cancel round more than their sum: such steps do not shrink any further. Their
        # size, with a margin of 16, is added to the interval
        if change <= STAGNANT_STEP * abs(value):
            low, high = crossing.interval
            return replace(crossing, interval=(low - 16 * change, high + 16 * change))
    raise ComputationError(
        f"no crossing of the imaginary axis was found near {name} = {guess.value:.9g} at "
        f"{guess.omega / math.tau:.6g} Hz"
    )


def _unit(corrected: ComplexArray, vector: ComplexArray) -> ComplexArray:
    """A corrected vector (n,) with unit length; the `vector` itself where the correction leaves
    nothing, as of an exact vector that the factor and P share."""
    length = np.linalg.norm(corrected)
    return corrected / length if 0.0 < length < np.inf else vector


class _Linearised(NamedTuple):
    """y^H P(z, omega, p) x at z = i omega, with unit vectors x, y, and its derivatives."""

    product: complex  # y^H P x
    by_root: complex  # by z, the matrices unchanged
    by_frequency: complex  # by the frequency omega that the matrices depend on; 0 if on none
    by_parameter: complex  # by p
    size: float  # a bound of |P|
    residual: float  # |P x| / size

    @property
    def growth_slope(self) -> float:
        """d Re z/dp of a root z.

        by_root dz + by_parameter dp + by_frequency domega = 0 with domega = Im dz: the parameter
        moves the root, and the root's frequency the matrices, which move the root again.
        """
        direct = -self.by_parameter / self.by_root
        by_own_frequency = -self.by_frequency / self.by_root
        frequency_slope = direct.imag / (1.0 - by_own_frequency.imag)  # domega/dp
        return float((direct + by_own_frequency * frequency_slope).real)


def _linearised(scaled: ScaledSystem, name: str, guess: CrossingGuess) -> _Linearised:
    """y^H P x and its derivatives at a guess with unit vectors x, y; `name` is that of p."""
    system = scaled.system
    x = guess.right
    y = guess.left.conj()  # so that y @ is the product with y^H
    root = complex(0.0, guess.omega)
    parameters = {name: guess.value, **system.frequency(guess.omega)}
    problem = scaled.at(parameters)
    # the parameters that hold the frequency are proportional to omega, so that their values at
    # 1 rad/s are their derivatives by omega
    by_frequency = 0j
    for frequency_name, d_by_omega in system.frequency(1.0).items():
        derivative = scaled.slope(frequency_name, parameters, root)
        by_frequency = by_frequency + d_by_omega * (y @ (derivative @ x))
    image = problem.apply(np.array([root]), x[:, None])[:, 0]
    size = float(problem.size(np.array(root)))
    return _Linearised(
        product=complex(y @ image),
        by_root=y @ (problem.slope(root) @ x),
        by_frequency=by_frequency,
        by_parameter=y @ (scaled.slope(name, parameters, root) @ x),
        size=size,
        residual=float(np.linalg.norm(image) / size),
    )


class _NewtonStep(NamedTuple):
    """Where a step of Newton's method ends."""

    crossing: AxisCrossing
    is_converged: bool  # True if the steps of p and of omega are rounding


def _newton_step(scaled: ScaledSystem, name: str, guess: CrossingGuess) -> _NewtonStep | None:
    """One step of Newton's method for p and omega from a guess with unit vectors x, y (n,).

    p is the parameter `name`, omega is in rad/s.

    The complex equation (i by_root + by_frequency) domega + by_parameter dp = -y^H P x, see
    `_Linearised`, has two real unknowns. Its real and imaginary part are the two rows of the
    Jacobian (2, 2). The crossing has the value, omega and interval after the step, but the
    residual, slope and vectors of the guess. None where the Jacobian is singular.
    """
    system = scaled.system
    p = guess.value
    at_guess = _linearised(scaled, name, guess)
    product = at_guess.product
    columns = [1j * at_guess.by_root + at_guess.by_frequency, at_guess.by_parameter]
    if guess.omega == 0.0:
        # a real root stays real, and so does y^H P x: the rows become domega = 0 and
        # Re(by_parameter) dp = -Re(y^H P x)
        columns = [1.0, 1j * at_guess.by_parameter.real]
        product = complex(0.0, product.real)
    jacobian = np.array([np.real(columns), np.imag(columns)])
    sizes = np.abs(jacobian).max(axis=0)  # of the columns, whose units differ
    # above a condition of 1e12 a step has less than four true digits; NaN counts as above
    if not (sizes.all() and np.linalg.cond(jacobian / sizes) <= 1e12):
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        inverse = np.linalg.inv(jacobian / sizes) / sizes[:, None]
        omega_step, step = (-inverse @ [product.real, product.imag]).tolist()
    if not math.isfinite(step) or not math.isfinite(omega_step):
        return None  # the parameter hardly moves the root: the inverse overflows
    # how far rounding of P x, in both equations, may move the two unknowns
    errors = 2 * EPS * at_guess.size * np.abs(inverse).sum(axis=1)
    omega_error, p_error = errors.tolist()
    new_p = p + step
    new_omega = guess.omega + omega_step
    # steps are relative to p (to at least 1 where it was 0), and to omega (to at least 1 rad/s)
    p_limit = max(p_error, CONVERGED_STEP * max(abs(new_p), abs(p) or 1.0))
    omega_limit = max(omega_error, CONVERGED_STEP * max(abs(new_omega), 1.0))
    is_converged = abs(step) <= p_limit and abs(omega_step) <= omega_limit
    if system.follows:  # matrices depend on the frequency by tables, which end
        least, most = system.covered  # Hz
        new_omega = min(max(new_omega, math.tau * least), math.tau * most)
    slope = at_guess.growth_slope
    half_width = p_error + abs(step) + 2 * EPS * abs(new_p)
    crossing = AxisCrossing(
        value=new_p,
        omega=abs(new_omega),  # a step beyond zero ends at the conjugate root
        direction=1 if slope > 0 else -1,
        interval=(new_p - half_width, new_p + half_width),
        residual=at_guess.residual,
        slope=slope,
        right=guess.right,
        left=guess.left,
    )
    return _NewtonStep(crossing, is_converged)
