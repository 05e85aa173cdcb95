"""What a user of NumPy, pandas and Matplotlib writes: it must pass `mypy --strict` and run."""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

import squeal


def brake(gap: float) -> squeal.System:
    stiffness = {
        "1": np.array([[2.0, -1.0], [-1.0, 2.0]]),
        "gap": csc_array(np.diag([0.0, 1.0])),
        "mu": [[0, 4 / 3], [0, 0]],
    }
    return squeal.System(np.eye(2), 0.01 * np.eye(2), stiffness, parameters={"gap": gap})


def first_loss(system: squeal.System) -> float:
    found: squeal.Thresholds = squeal.thresholds(system, high=2.0)
    return np.inf if found.first is None else found.first.mu


folder = Path(sys.argv[1])
critical = [first_loss(brake(gap)) for gap in np.linspace(0.0, 0.5, 3)]
roots: NDArray[np.complex128] = squeal.eigenvalues(brake(0.0), at=1.0).values
swept = squeal.sweep(brake(0.0), np.linspace(0.0, 1.0, 11))
growth = [step.roots.real.max() for step in swept.steps if step.roots is not None]
frame = swept.to_dataframe()
swept.save(folder / "swept.csv")
squeal.thresholds(brake(0.0)).save(folder / "thresholds.svg")
squeal.thresholds(brake(0.0)).plot(color="k").set_title("thresholds")
print(f"{critical[0]:.6f} {len(roots)} {len(growth)} {len(frame)}")
