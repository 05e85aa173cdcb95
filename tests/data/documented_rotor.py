"""Writes documented_rotor.json: the rotor of ROSS's documentation and its printed critical speeds.

`python tests/data/documented_rotor.py tests/data/documented_rotor.json` in an environment of its
own that has ROSS (ross-rotordynamics 2.3.0). Rows along and around the shaft are left out.
"""

import json
import sys
from pathlib import Path

import numpy as np
import ross

SPEEDS = (0.0, 500.0, 1000.0)  # rad/s

rotor = ross.rotor_example()
bending = [row for row in range(rotor.ndof) if row % 6 not in (2, 5)]
matrices = {"M": rotor.M(), "K": rotor.K(0.0), "G": rotor.G()}
data = {
    "made_by": f"ROSS {ross.__version__}",
    "rows": len(bending),
    "matrices": {},
    "critical_speeds": rotor.run_critical_speed(num_modes=8, rtol=1e-10).wd().tolist(),
    "frequencies": {},
}
for name, whole in matrices.items():
    A = whole[np.ix_(bending, bending)]
    places = zip(*np.nonzero(A), strict=True)
    data["matrices"][name] = [[int(i), int(j), float(A[i, j])] for i, j in places]
for speed in SPEEDS:
    campbell = rotor.run_campbell(np.array([speed]), frequencies=4)
    data["frequencies"][str(speed)] = campbell.wd[0].tolist()
Path(sys.argv[1]).write_text(json.dumps(data, separators=(",", ":")) + "\n", encoding="utf-8")
