"""
Matrices of your own
====================

Two modes coupled by friction, against the closed form: with M = 1 and
K = [[2, -1 + 4 mu/3], [-1, 2]] the squared frequencies are 2 +- sqrt(1 - 4 mu/3), so that they meet
at mu = 3/4.
"""

import matplotlib.pyplot as plt
import numpy as np

import squeal

# the factors are formulas of named parameters; C is left out, there is no damping
terms = {"1": [[2.0, -1.0], [-1.0, 2.0]], "4*mu/3": [[0.0, 1.0], [0.0, 0.0]]}
system = squeal.System(np.eye(2), K=terms)
for point in squeal.thresholds(system, 1.0).points:
    print(f"{point.kind} from mu = {point.mu:.15f}")

# %%
# The eigenvalues on the way, beside the closed form.

mus = np.linspace(0.0, 1.0, 201)
roots = np.array([step.roots for step in squeal.sweep(system, mus).steps])
figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
above.plot(mus, np.abs(roots.imag) / (2.0 * np.pi), "k.", markersize=2)
above.set_ylabel("frequency [Hz]")
below.plot(mus, roots.real, "k.", markersize=2)
below.set_ylabel("growth rate [1/s]")
below.set_xlabel(r"friction $\mu$")

exact = np.sqrt(2.0 + np.sqrt(1.0 - 4.0 * mus.astype(complex) / 3.0)).real / (2.0 * np.pi)
above.plot(mus[::10], exact[::10], "r+", label="closed form")
above.legend()
plt.show()

# %%
# The same in the other sliding direction never flutters:

turned = {"1": terms["1"], "-4*mu/3": terms["4*mu/3"]}
print(squeal.thresholds(squeal.System(np.eye(2), K=turned), 1.0))
