"""
The motion of a pad
===================

From a knock at the sliding equilibrium to squeal: forces of both edges over time.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import squeal
from squeal.examples.files import Size, write_example

folder = Path(mkdtemp())
write_example("pad", folder, Size())
scene = squeal.read_scene(folder / "pad.yaml")
run = squeal.simulate(scene.replace(outputs=("shares", "history")))
run.plot()
print(f"both edges press {run.shares['1']:.0%} of the time")
plt.show()
