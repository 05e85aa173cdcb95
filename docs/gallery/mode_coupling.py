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


def system(mu):
    """M, C and K at a friction mu; None stands for no damping."""
    return np.eye(2), None, np.array([[2.0, -1.0 + 4.0 * mu / 3.0], [-1.0, 2.0]])


for point in squeal.critical_points(system, 1.0):
    print(f"{point.kind} from mu = {point.mu:.15f}")

# %%
# Modes are followed through the coupling, so that each keeps its curve.

mus = np.linspace(0.0, 1.0, 201)
modes = squeal.track(system, mus)
figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
above.plot(mus, modes.frequencies_hz)
above.set_ylabel("frequency [Hz]")
below.plot(mus, modes.values.real)
below.set_ylabel("growth rate [1/s]")
below.set_xlabel(r"friction $\mu$")

exact = np.sqrt(2.0 + np.sqrt(1.0 - 4.0 * mus.astype(complex) / 3.0)).real / (2.0 * np.pi)
above.plot(mus[::10], exact[::10], "k+", label="closed form")
above.legend()
plt.show()

# %%
# The same in the other sliding direction never flutters:

print(squeal.critical_points(lambda mu: system(-mu), 1.0))
