"""
A chart over two parameters
===========================

Two modes whose frequencies differ by the gap flutter from mu = gap on: the diagonal.
"""

import matplotlib.pyplot as plt

import squeal

K = {"1": [[2, 0], [0, 2]], "gap": [[1, 0], [0, -1]], "mu": [[0, 1], [-1, 0]]}
pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"gap": 0.5})
found = squeal.map(pair, (squeal.Axis("mu", 0, 1, 60), squeal.Axis("gap", 0, 1, 60)))
found.plot()
print(f"flutter in {found.share['flutter']:.0%} of the area")
plt.show()
