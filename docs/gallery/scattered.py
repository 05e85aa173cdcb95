"""
A threshold that scatters
=========================

A stiffness within 2.9 and 3.1 makes a distribution of thresholds, here (a - b)/2.
"""

import matplotlib.pyplot as plt

import squeal

K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
found = squeal.scatter(pair, {"a": {"within": 0.1}}, samples=32)
found.plot()
print([round(q.value, 1) for q in found.quantiles if q.level == 0.5])
plt.show()
