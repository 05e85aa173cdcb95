"""Complex eigenvalues of the article's four cases by python-control, for the report's table."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.eigenvalues import analyse
from squeal.errors import ComputationError
from squeal.files.provenance import provenance
from squeal.files.writing import to_json
from squeal.model.linear import Linearisation
from squeal.scene import Scene, read_scene

ROUNDING = 1e-9  # real parts below this share of |s| are rounding


def state_matrix(system: Linearisation) -> np.ndarray:
    """A of z' = A z with z = (q, q'), shape (6, 6)."""
    inverse = np.linalg.inv(system.M)
    return np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ system.K, -inverse @ system.C]])


def poles(system: Linearisation) -> list[dict[str, float | None]]:
    """Poles with non-negative imaginary part by python-control, in order of frequency.

    Real parts of rounding size are set to zero. The damping ratio is None where python-control
    gives none (a pole at the origin).
    """
    import control

    plant = control.ss(state_matrix(system), np.zeros((6, 1)), np.eye(6), np.zeros((6, 1)))
    with np.errstate(invalid="ignore", divide="ignore"):
        _, ratios, values = control.damp(plant, doprint=False)
    found = []
    for s, ratio in zip(values, ratios, strict=True):
        if s.imag < 0.0:
            continue
        still = abs(s.real) < ROUNDING * abs(s)
        found.append(
            {
                "real": 0.0 if still else float(s.real),
                "imag": float(s.imag),
                "frequency_hz": float(s.imag) / (2 * math.pi),
                "damping_ratio": 0.0 if still else float(ratio) if math.isfinite(ratio) else None,
            }
        )
    return sorted(found, key=lambda p: (p["imag"], p["real"]))


def examined(scene: Scene) -> dict[str, Any]:
    """Equilibrium, poles and verdict of a scene, or the reason why there is none.

    `apart` is the greatest distance of an eigenvalue of `squeal eigenvalues` from the nearest of
    python-control's, over the greatest magnitude.
    """
    try:
        found = analyse(scene)
    except ComputationError as error:
        return {"reason": str(error)}
    rows = poles(found.matrices)
    upper = np.array([complex(p["real"] or 0.0, p["imag"] or 0.0) for p in rows])
    both = np.concatenate([upper, upper.conj()])
    own = np.array([e.value for e in found.spectrum.eigenvalues])
    apart = max(float(np.abs(both - s).min()) for s in own) / float(np.abs(own).max())
    return {
        "contact": found.contact,
        "R_n": found.R_n,
        "theta": found.q[2],
        "poles": rows,
        "verdict": found.judgement.verdict,
        "apart": apart,
    }


def main() -> int:
    """Examine scenes and print one JSON object, keyed by the scenes' names."""
    parser = argparse.ArgumentParser(description="Poles of sliding equilibria by python-control.")
    parser.add_argument("scenes", type=Path, nargs="+", metavar="SCENE.yaml")
    given = parser.parse_args()
    result: dict[str, Any] = {path.stem: examined(read_scene(path)) for path in given.scenes}
    made = provenance(given.scenes, "squeal.article.studies.eigenvalues")
    print(to_json(result | {"provenance": made.to_dict()}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
