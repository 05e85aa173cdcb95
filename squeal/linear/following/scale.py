"""The system's own scale of its parameter; ranges far beyond it are divided.

Where the matrix has changed by W in its eigenvectors, a root z_k has moved by about W_kk and two
roots exchange sqrt(W_kl W_lk). Where the greatest of sqrt(|W_kl W_lk / (z_k z_l)|) is one, the
parameter matters as much as all that is there without it. In a range of many times that scale all
thresholds lie at one end, below what steps and tolerances in units of the range resolve.
"""

import math

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.linear.following.line import Line
from squeal.linear.matrices import Array
from squeal.linear.system import System

FAR = 3e3  # own scales that are searched as one range
FIRST, RATIO = 30.0, 100.0  # own scales in the first part, and how much longer each one is
ROUNDED = 1e13  # own scales beyond which the parameter's part is all that rounding leaves
MOST = 1e100  # own scales that a range may have
NEAR, BESIDE = 1e-300, 1e-9  # of the range and of the origin: where the matrix is taken apart
DEFECTIVE = 1e-3  # left times right vector: eigenvectors that nearly coalesce tell no scale
PARTS = 200  # shorter ranges looked at for the own scale


def divided(system: System, low: float, high: float) -> list[float]:
    """Rising values from low to high between which a system is searched: the ends alone unless the
    range is far longer than the system's own scale of the parameter. Raises InputError for one that
    is longer than can be computed with."""
    origin = min(max(0.0, low), high)
    inner = [x for end in (low, high) if end != origin for x in _inner(system, origin, end)]
    if inner and low < origin < high:
        inner.append(origin)
    return [low, *sorted(inner), high]


def _inner(system: System, origin: float, end: float) -> list[float]:
    """Values that divide what lies between an origin and an end."""
    way = end - origin
    near = max(NEAR * abs(way), BESIDE * abs(origin))
    try:
        line = Line(system, *sorted((origin, origin + math.copysign(near, way))))
        found = share(line, origin, end)
    except InputError:  # there is no matrix at zero: a factor divides by the parameter
        return []
    if found <= FAR:
        return []
    x = way
    for _ in range(PARTS):
        if found <= 1.0:
            break
        x /= RATIO
        found = share(line, origin, origin + x)
    unit = x / found if found > 0.0 else x
    if abs(way) > MOST * abs(unit):
        raise InputError(
            f"thresholds: a range up to {end:g} is not allowed; it must be at most {MOST:g} times "
            f"the system's own scale of the parameter, {abs(unit):.2g}"
        )
    inner = []
    step = FIRST * unit
    while abs(step) < min(abs(way) / 3, ROUNDED * abs(unit)):
        inner.append(origin + step)
        step *= RATIO
    return inner


def share(line: Line, origin: float, p: float) -> float:
    """How much of what there is at the origin changes up to p; infinite beyond double precision."""
    state, first = line.at(origin), line.both(origin)[0]
    moves = np.abs(state.roots) > 8 * state.noise  # what is free has no scale
    across = np.abs(np.sum(state.left.conj() * state.right, axis=0))
    if across.min() < DEFECTIVE:
        return _moved(line, np.abs(state.roots), moves, p)
    with np.errstate(all="ignore"):
        W = state.left.conj().T @ ((line.both(p)[0] - first) @ state.right)
        W = np.abs(W) / across[:, None] / np.abs(state.roots)[:, None]
        W = W[np.ix_(moves, moves)]
        greatest = float(np.max(np.sqrt(W) * np.sqrt(W.T), initial=0.0))
    return greatest if np.isfinite(greatest) else np.inf


def _moved(line: Line, sizes: Array, moves: NDArray[np.bool_], p: float) -> float:
    """The same by how much the roots themselves change in size."""
    A = line.both(p)[0]
    if not np.isfinite(A).all():
        return np.inf
    order = np.argsort(sizes)
    change = np.abs(np.sort(np.abs(np.linalg.eigvals(A))) - sizes[order])[moves[order]]
    greatest = float(np.max(change / sizes[order][moves[order]], initial=0.0))
    return max(greatest, greatest**2) if line.damped else greatest
