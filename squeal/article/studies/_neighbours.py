"""Growth of deviations from neighbouring motions: exponents without variational equations.

Each motion runs beside one that starts a little off. After each stretch of time the neighbour is
put back to the first distance, along the deviation that it has then.
"""

from collections.abc import Sequence

import numpy as np

from squeal.model.equations import PadModel
from squeal.model.units import natural_units
from squeal.simulation.ensemble import DONE, simulate_many, stack

SIZE = 1e-6  # of a motion's own size, the first distance
TOLERANCE = 1e-10
SETTLING = 0.2  # share of the stretches in which deviations turn to where they grow


def damping_of(models: Sequence[PadModel]) -> np.ndarray:
    """Damping matrices (n, 3, 3) of models, zero where there is none."""
    none = np.zeros((3, 3))
    return np.array([none if one.damping is None else one.damping for one in models])


def directions(n: int) -> np.ndarray:
    """Unit vectors (n, 6) in natural units: where the neighbours of n motions start."""
    away = np.random.default_rng(0).normal(size=(n, 6))
    return np.asarray(away / np.linalg.norm(away, axis=1)[:, None])


def neighbours(
    models: Sequence[PadModel], states: np.ndarray, stretch: float, count: int
) -> np.ndarray:
    """Logarithms (count, n) of the growth of deviations from n motions, a row a stretch (s).

    The pads are of one model; states (n, 6) in SI units. A motion whose model ends gives NaN from
    then on. Raises ComputationError without heyoka.
    """
    n, first = len(states), models[0]
    scale = np.array(
        [
            natural_units(one, state).to_si(np.ones(6))
            for one, state in zip(models, states, strict=True)
        ]
    )
    away = SIZE * directions(n)
    here = np.array(states, dtype=float)
    going = np.arange(n)
    pads, damping = stack([one.pad for one in models] * 2), np.tile(damping_of(models), (2, 1, 1))
    logs = np.full((count, n), np.nan)
    for row in logs:
        both = np.concatenate([here[going], here[going] + away[going] * scale[going]])
        many = simulate_many(
            first.name, pads, both, stretch, TOLERANCE, first.formulation, damping=damping
        )
        good = np.all(many["outcome"].reshape(2, -1) == DONE, axis=0)
        one, other = many["final"].reshape(2, -1, 6)[:, good]
        if not good.all():
            going = going[good]
            if not going.size:
                break
            some = [models[i] for i in going.tolist()]
            pads = stack([one.pad for one in some] * 2)
            damping = np.tile(damping_of(some), (2, 1, 1))
        here[going] = one
        away[going] = (other - one) / scale[going]
        size = np.linalg.norm(away[going], axis=1)
        row[going] = np.log(size / SIZE)
        away[going] *= (SIZE / size)[:, None]
    return logs


def growth(logs: np.ndarray, stretch: float) -> tuple[np.ndarray, float]:
    """Rates (n,) in 1/s of the columns (count, n) of `neighbours`, without their first stretches.

    They are the slopes of straight lines through the logarithms of the deviations over time, which
    oscillations disturb less than differences of ends do. Also the slope that deviations have that
    grow in proportion to time.
    """
    t = stretch * np.arange(1, len(logs) + 1)
    late = slice(int(SETTLING * len(logs)), None)
    away = t[late] - t[late].mean()
    weights = away / (away @ away)
    return weights @ np.cumsum(logs, axis=0)[late], float(weights @ np.log(t[late]))
