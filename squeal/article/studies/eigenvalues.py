"""Complex eigenvalues of the article's four cases by python-control, for the report's table."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from squeal.analysis.pads import analyse
from squeal.article.records import Missing, Record, Result
from squeal.errors import ComputationError
from squeal.io.scene import Scene, read_scene
from squeal.linear.matrices import state_matrices
from squeal.model.equations import Linearisation

ROUNDING = 1e-9  # real parts below this share of |s| are rounding


class Pole(Record):
    """Real part in 1/s, imaginary part in rad/s; damping_ratio None for a pole at the origin."""

    real: float
    imag: float
    frequency_hz: float
    damping_ratio: float | None


class EquilibriumPoles(Record):
    """Contact, reaction (N) and tilt (rad) of an equilibrium, its poles with Im >= 0, its verdict.

    free: the reaction (N) without friction; apart: greatest distance of an own eigenvalue from the
    nearest of python-control's, over the greatest magnitude.
    """

    contact: str
    R_n: float
    free: float
    theta: float
    poles: tuple[Pole, ...]
    verdict: str
    apart: float


class Eigenvalues(Result):
    """By name of the scene; a scene without steady sliding has the reason."""

    scenes: dict[str, EquilibriumPoles | Missing]


def poles(system: Linearisation) -> tuple[Pole, ...]:
    """Poles with non-negative imaginary part by python-control, in order of frequency.

    Real parts of rounding size are set to zero. The damping ratio is None where python-control
    gives none (a pole at the origin).
    """
    import control

    A, B = state_matrices(*system)
    plant = control.ss(A, B, np.eye(6), np.zeros((6, 3)))
    with np.errstate(invalid="ignore", divide="ignore"):
        _, ratios, values = control.damp(plant, doprint=False)
    rows = []
    for s, ratio in zip(values, ratios, strict=True):
        if s.imag < 0.0:
            continue
        still = abs(s.real) < ROUNDING * abs(s)
        rows.append(
            Pole(
                real=0.0 if still else float(s.real),
                imag=float(s.imag),
                frequency_hz=float(s.imag) / (2 * math.pi),
                damping_ratio=0.0 if still else float(ratio) if math.isfinite(ratio) else None,
            )
        )
    return tuple(sorted(rows, key=lambda p: (p.imag, p.real)))


def examined(scene: Scene) -> EquilibriumPoles | Missing:
    """Equilibrium, poles and verdict of a scene, or the reason why there is none."""
    try:
        analysis, still = analyse(scene), analyse(scene.replace(mu=0.0))
    except ComputationError as error:
        return Missing(str(error))
    rows = poles(analysis.matrices)
    upper = np.array([complex(p.real, p.imag) for p in rows])
    both = np.concatenate([upper, upper.conj()])
    own = np.array([e.value for e in analysis.spectrum.eigenvalues])
    apart = max(float(np.abs(both - s).min()) for s in own) / float(np.abs(own).max())
    assert analysis.R_n is not None
    assert still.R_n is not None  # of the line that all these scenes have
    rest = (analysis.contact, analysis.R_n, still.R_n, analysis.q[2])
    return EquilibriumPoles(*rest, rows, analysis.judgement.verdict, apart)


def study(files: Sequence[Path]) -> Eigenvalues:
    """The poles of each scene given."""
    return Eigenvalues({file.stem: examined(read_scene(file)) for file in files})
