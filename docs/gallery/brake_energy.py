"""
Which term feeds the squeal
===========================

The work of each term of M, C and K on the fastest mode: friction puts in, damping takes.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import squeal
from squeal.examples.files import Size, write_example

folder = Path(mkdtemp())
write_example("brake", folder, Size())
brake = squeal.read_system(folder / "brake" / "system.yaml")
energy = squeal.energy(squeal.eigenvalues(brake, band=(6500, 7000)))
energy.plot()
print(energy.sentence(energy.modes[0]))
plt.show()
