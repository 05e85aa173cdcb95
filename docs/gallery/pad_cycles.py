"""
Periodic motions beside stable sliding
======================================

A branch of cycles over friction: how far the pad moves, and which cycles are stable.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import squeal
from squeal.examples.files import Size, write_example

folder = Path(mkdtemp())
write_example("pad", folder, Size())
scene = squeal.read_scene(folder / "pad.yaml")
damped = scene.replace(damping=squeal.Damping(ratios=(0.02, 0.02, 0.02)))
branch = squeal.cycles(damped, over=("mu", 0.3, 0.5))
branch.plot()
print(len(branch.orbits), "cycles")
plt.show()
