"""
The shape of a mode that squeals
================================

The mode of 6697 Hz on the nodes of disc and pad.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import squeal
from squeal.examples.files import Size, write_example

folder = Path(mkdtemp())
write_example("brake", folder, Size())
brake = squeal.read_system(folder / "brake" / "system.yaml")
found = squeal.eigenvalues(brake, band=(6500, 7000))
found.plot(shape=2)
print(found.conclusion)
plt.show()
