"""
Modes of a brake over friction
==============================

Frequencies and growth rates of a brake of solids: pairs of modes meet, and one of each grows.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import squeal
from squeal.examples.files import Size, write_example

folder = Path(mkdtemp())
write_example("brake", folder, Size())
brake = squeal.read_system(folder / "brake" / "system.yaml")
sweep = squeal.sweep(brake, [0.05 * step for step in range(13)], band=(3500, 7000))
sweep.plot()
print(f"{max(mode.growth_rate for mode in sweep.modes):.0f} 1/s at most")
plt.show()
