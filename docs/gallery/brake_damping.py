"""
Damping ratio over frequency
============================

The picture of complex eigenvalue analysis: what lies left of zero may squeal.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import squeal
from squeal.examples.files import Size, write_example

folder = Path(mkdtemp())
write_example("brake", folder, Size())
brake = squeal.read_system(folder / "brake" / "system.yaml")
sweep = squeal.sweep(brake, [0.0, 0.2, 0.4, 0.6], band=(3500, 7000))
sweep.plot(damping=True)
print(len(sweep.steps), "values of friction")
plt.show()
