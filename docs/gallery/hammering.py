"""
A pad that hammers
==================

Case (c) with line contact, the scene of Fig. 11 of the report: the reaction wanders from edge to
edge of the pad, and the surfaces separate at times.
"""

from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt

import squeal

scene = squeal.read_scene(Path(squeal.__file__).parent / "article" / "scenes" / "b2-c.yaml")
scene = replace(scene, outputs=("events", "shares", "history"))

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
