"""
Where to put the springs
========================

The verdict over the angles of the two springs, each at the sliding equilibrium of a pad of its own.
"""

import io

import matplotlib.pyplot as plt
import numpy as np

import squeal

pad = squeal.Pad(
    m=0.2, w=0.04, h=0.014, k1=2.0e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8, L2=0.8,
    alpha1=0.5 * np.pi, alpha2=np.pi, mu=0.4, F_n=4500.0,
)

axes = squeal.Axis("alpha1", 0.0, np.pi, 60), squeal.Axis("alpha2", 0.0, np.pi, 60)
found = squeal.map(squeal.Scene("B1", pad), axes)
print({name: round(share, 3) for name, share in found.share.items() if share > 0.0})

# %%
# Each cell is a pad. White would be
# stable, light blue is marginal (undamped, nothing grows), red flutters; grey has no equilibrium on
# the branch from the frictionless pad.

picture = io.BytesIO()
found.plot().figure.savefig(picture, dpi=200)
picture.seek(0)
plt.imshow(plt.imread(picture))
plt.axis("off")
plt.show()
