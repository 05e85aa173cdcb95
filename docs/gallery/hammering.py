"""
A pad that hammers
==================

The article's case (c) with line contact: the reaction wanders from edge to edge of the pad, and the
surfaces part at times.
"""

import matplotlib.pyplot as plt
import numpy as np

import squeal

pad = squeal.Pad(
    m=0.15, w=0.04, h=0.0129352, I=1.175639e-4, k1=1.5e8, k2=1.825815e8, k_c=1.179481e8,
    L1=0.854552, L2=0.854552, alpha1=0.75 * np.pi, alpha2=0.75 * np.pi,
    mu=0.777648, F_n=1227.168, V=25.0, y0=-5.344002e-05,
)
scene = squeal.Scene(
    "B2",
    pad,
    squeal.Formulation(line_force="mean"),
    initial=(0.0, 1.289467e-05, 0.0, 0.0, 0.0, 0.0),
    stop=0.003,
    samples=2001,
    outputs=("events", "shares", "history"),
)

# %%
# The motion is integrated from one change of contact to the next; each is located to rounding.

run = squeal.simulate(scene)
print(f"{len(run.events)} changes of contact, the first at {1e3 * run.events[0].t:.6f} ms")
print({state: round(share, 3) for state, share in run.shares.items()})

# %%
# Reaction and its place over time. While the surfaces are apart there is no place.

t = 1e3 * run.history["t"]
figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
above.plot(t, run.history["Rn"], "k", linewidth=0.9)
above.set_ylabel("reaction over brake force")
below.plot(t, run.history["delta"], "k", linewidth=0.9)
below.set_ylabel("its place over half length")
below.set_xlabel("time [ms]")
below.set_ylim(-1.05, 1.05)
plt.show()
