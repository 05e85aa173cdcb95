"""
scikit-fem: a column under a follower force
===========================================

Beck's column: clamped at its foot, pushed at its tip by a force P that turns with the tip. It has
no static buckling load and flutters from P = 20.05 EI/L^2 on. Matrices of scikit-fem go to squeal
as they are.
"""

import matplotlib.pyplot as plt
import numpy as np
from skfem import Basis, BilinearForm, ElementLineHermite, FacetBasis, MeshLine
from skfem.helpers import d, dd, ddot, dot

import squeal

mesh = MeshLine(np.linspace(0.0, 1.0, 17))
basis = Basis(mesh, ElementLineHermite(), intorder=6)
tip = FacetBasis(mesh, ElementLineHermite(), facets=mesh.facets_satisfying(lambda x: x[0] == 1.0))

mass = BilinearForm(lambda u, v, w: u * v).assemble(basis)
bending = BilinearForm(lambda u, v, w: ddot(dd(u), dd(v))).assemble(basis)
pressed = -BilinearForm(lambda u, v, w: dot(d(u), d(v))).assemble(basis)
turning = BilinearForm(lambda u, v, w: d(u)[0] * v).assemble(tip)  # what makes K unsymmetric

free = basis.complement_dofs(basis.get_dofs(lambda x: x[0] == 0.0))
M, bending, load = (A[free][:, free] for A in (mass, bending, pressed + turning))

# %%
# A term of K for each formula of the load, as in a system file:

column = squeal.System(M, K={"1": bending, "P": load}, parameter="P", name="column")
found = squeal.thresholds(column, 30.0)
print(f"{found.first.kind} from P = {found.first.mu:.4f} on, Beck and others: 20.0510")

# %%
# The two lowest frequencies meet there, and one of two modes grows:

loads = np.linspace(0.0, 30.0, 61)
roots = np.array([step.roots for step in squeal.sweep(column, loads).steps])
figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
above.plot(loads, roots.imag, "k.", markersize=2)
above.set_ylim(0.0, 30.0)
above.set_ylabel(r"circular frequency [$\sqrt{EI/(\rho A L^4)}$]")
below.plot(loads, roots.real, "k.", markersize=2)
below.set_ylabel("growth rate")
below.set_xlabel(r"load $P$ [$EI/L^2$]")
plt.show()
