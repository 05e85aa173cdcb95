"""
Eigenvalues and modes of a pad
==============================

The roots in the complex plane, and how the pad moves in each mode.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import squeal
from squeal.examples.files import Size, write_example

folder = Path(mkdtemp())
write_example("pad", folder, Size())
scene = squeal.read_scene(folder / "pad.yaml")
found = squeal.eigenvalues(scene)
found.plot()
print(found.conclusion)
plt.show()
