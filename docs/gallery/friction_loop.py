"""
Friction as a loop gain
=======================

The root locus of python-control over the friction coefficient, and its gain margin.
"""

import control
import matplotlib.pyplot as plt

import squeal

K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
system = squeal.System([[1, 0], [0, 1]], [[0.1, 0], [0, 0.1]], K)
plant = squeal.state_space(system, loop="mu")
control.root_locus(plant, gains=[0.01 * step for step in range(151)])
print(f"gain margin {control.margin(plant)[0]:.6f}")  # 3/4 (1 + 2 c^2), c = 0.1
plt.show()
