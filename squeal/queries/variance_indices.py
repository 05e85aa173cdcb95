"""Sobol indices: which share of the variance of a result each scattering parameter makes.

A. Saltelli et al., "Variance based sensitivity analysis of model output", Computer Physics
Communications 181 (2010) 259-270. Two independent samples A and B are drawn of all d parameters;
sample A with its column i replaced by that of B is called AB_i. The result f is computed for the
d + 2 of them.
"""

from collections.abc import Sequence

import numpy as np

from squeal.linear.matrices import Array
from squeal.results.scatter import CONFIDENCE, Index
from squeal.schema import Place

RESAMPLED = 400  # times, for the confidence intervals
FEWEST = 8  # samples for which indices are computed


def points_for_indices(cube_points: Array) -> Array:
    """Points ((d + 2) n, d) at which the result is needed: A, B, AB_1, ..., AB_d below each other.

    Parameters
    ----------
    cube_points : array (n, 2 d)
        Independent points of the unit cube, each the d coordinates of A beside those of B.
    """
    dimensions = cube_points.shape[1] // 2
    A = cube_points[:, :dimensions]
    B = cube_points[:, dimensions:]
    points = [A, B]
    for column in range(dimensions):
        replaced = A.copy()
        replaced[:, column] = B[:, column]
        points.append(replaced)
    return np.concatenate(points)


def sobol_indices(names: Sequence[str], values: Array, seed: int, same: float) -> tuple[Index, ...]:
    """First-order and total indices of each parameter with bootstrapped intervals.

    Parameters
    ----------
    names : sequence of d str
        The parameters.
    values : array (d + 2, n)
        Results at A, B, AB_1, ..., AB_d. A column with a value that is not finite is left out.
    seed : int
        Of the random numbers of the bootstrap.
    same : float
        Relative difference below which results are equal to rounding.

    Returns
    -------
    tuple of Index
        The largest total index first; empty, with a warning, where nothing varies or too few
        samples are known.
    """
    finite = values[:, np.all(np.isfinite(values), axis=0)]
    n = finite.shape[1]
    if n < FEWEST or np.ptp(finite[:2]) <= same * np.abs(finite[:2]).max():
        reason = "no Sobol indices: fewer than 8 samples are known, or all are one to rounding"
        Place("indices").warn(reason)
        return ()
    random = np.random.default_rng([seed, RESAMPLED])  # not the numbers that drew the samples
    resampled = []  # bootstrap: of each repetition the shares (2, d)
    for _ in range(RESAMPLED):
        drawn = random.integers(n, size=n)
        resampled.append(_shares_of_variance(finite[:, drawn]))
    tails = [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]
    quantiles = np.nanquantile(resampled, tails, axis=0).tolist()
    (first_low, total_low), (first_high, total_high) = quantiles
    first, total = _shares_of_variance(finite).tolist()
    indices = []
    for k, name in enumerate(names):
        indices.append(
            Index(
                parameter=name,
                first=first[k],
                first_interval=(first_low[k], first_high[k]),
                total=total[k],
                total_interval=(total_low[k], total_high[k]),
            )
        )
    return tuple(sorted(indices, key=lambda index: -index.total))


def _shares_of_variance(values: Array) -> Array:
    """First-order and total indices (2, d) from results (d + 2, n) at A, B, AB_1, ..., AB_d.

    First order: ``mean(f(B) (f(AB_i) - f(A))) / var(f)``, with f(B) about the mean of all, which
    changes no expectation and lowers the error. Total: ``mean((f(AB_i) - f(A))^2) / 2 / var(f)``.
    Both are Table 2 of Saltelli et al., (b) and (f). What sampling leaves below 0 or above 1,
    where no share can be, is cut.
    """
    at_A = values[0]
    n = len(at_A)
    differences = values[2:] - at_A
    centred_at_B = values[1] - values[:2].mean()
    first_order = differences @ centred_at_B / n
    total = (differences**2).sum(axis=1) / 2 / n
    variance = np.var(values[:2]) or np.nan
    return np.clip(np.array([first_order, total]) / variance, 0.0, 1.0)
