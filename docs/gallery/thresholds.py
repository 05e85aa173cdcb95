"""
Friction at which a pad starts to squeal
========================================

Two frequencies of the sliding pad move together as friction rises. Where they meet, one mode
starts to grow.
"""

import matplotlib.pyplot as plt
import numpy as np

import squeal

pad = squeal.Pad(
    m=0.2, w=0.04, h=0.014, k1=2.0e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8, L2=0.8,
    alpha1=0.5 * np.pi, alpha2=np.pi, mu=0.4, F_n=4500.0,
)
scene = squeal.Scene("B1", pad)

# %%
# Every change of stability along the equilibrium branch, each as precise as the arithmetic allows:

found = squeal.thresholds(scene)
for point in found.points:
    print(f"{point.kind} from mu = {point.mu:.9f} at {point.frequency_hz:.1f} Hz")

# %%
# The frequencies and growth rates on the way:

mus = np.linspace(0.0, 0.6, 61)
values = np.array([step.roots for step in squeal.sweep(scene, mus).steps])

figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
above.plot(mus, np.abs(values.imag) / (2e3 * np.pi), "k.", markersize=2)
below.plot(mus, values.real, "k.", markersize=2)
for axes in (above, below):
    axes.axvline(found.points[0].mu, color="#C8380E", linewidth=0.8)
above.set_ylabel("frequency [kHz]")
below.set_ylabel("growth rate [1/s]")
below.set_xlabel(r"friction $\mu$")
plt.show()
