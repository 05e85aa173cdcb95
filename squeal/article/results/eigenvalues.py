"""Poles of the sliding equilibria by python-control, held against the own eigenvalues."""

from typing import Annotated

from squeal.article.results.records import Missing, Record, Result


class Pole(Record):
    """Real part in 1/s, imaginary part in rad/s; damping_ratio None for a pole at the origin."""

    real: float
    imag: float
    frequency_hz: float
    damping_ratio: float | None


class EquilibriumPoles(Record):
    """Contact, reaction (N) and tilt (rad) of an equilibrium, its poles with Im >= 0, its verdict.

    free: the reaction (N) without friction; flutter: by factors of k_c, the least friction
    up to `mu_max` at which the equilibrium begins to flutter, None if it does not.
    apart: greatest distance of an own eigenvalue from the nearest of python-control's, over the
    greatest magnitude.
    """

    contact: str
    R_n: float
    free: float
    theta: float
    poles: tuple[Pole, ...]
    verdict: str
    flutter: dict[str, float | None]
    apart: Annotated[float, ".2g"]


class Eigenvalues(Result):
    """By name of the scene; a scene without steady sliding has the reason."""

    scenes: dict[str, EquilibriumPoles | Missing]
    mu_max: float
