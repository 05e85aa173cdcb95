"""Writes rotor.json: matrices and eigenvalues of a small rotor by ROSS (ross-rotordynamics 2.3.0).

`python tests/data/rotor.py squeal/examples/rotor.json` in an environment of its own that has ROSS.
"""

import json
import sys
from pathlib import Path

import numpy as np
import ross

SPEEDS = (0.0, 300.0, 900.0)  # rad/s

steel = ross.Material(name="steel", rho=7810.0, E=2.11e11, G_s=8.12e10)
shaft = [ross.ShaftElement(L=0.25, idl=0.0, odl=0.05, material=steel) for _ in range(2)]
disc = ross.DiskElement.from_geometry(n=1, material=steel, width=0.07, i_d=0.05, o_d=0.28)
bearings = [
    ross.BearingElement(n=n, kxx=1e7, kyy=9e6, kxy=k, kyx=-k, cxx=100.0, cyy=80.0)
    for n, k in ((0, 1.2e6), (2, 8e5))
]
rotor = ross.Rotor(shaft, [disc], bearings)
matrices = {"M": rotor.M(0.0), "K": rotor.K(0.0), "C": rotor.C(0.0), "G": rotor.G()}
roots = {}
for speed in SPEEDS:
    found = rotor.run_modal(speed, num_modes=2 * rotor.ndof, sparse=False).evalues
    found = found[np.abs(found) > 1.0]  # without the rigid ones along and around the shaft
    roots[str(speed)] = [[float(v.real), float(v.imag)] for v in found]
entries = {}
for name, A in matrices.items():
    rows, columns = np.nonzero(A)
    entries[name] = [[int(i), int(j), float(A[i, j])] for i, j in zip(rows, columns, strict=True)]
data = {
    "made_by": f"ROSS {ross.__version__}",
    "rows": int(rotor.ndof),
    "matrices": entries,
    "eigenvalues": roots,
}
Path(sys.argv[1]).write_text(json.dumps(data, separators=(",", ":")) + "\n", encoding="utf-8")
