"""
Campbell diagram of a rotor
===========================

Whirl frequencies over the speed; the forward whirl that grows is drawn thick.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import squeal
from squeal.examples.files import Size, write_example

folder = Path(mkdtemp())
write_example("rotor", folder, Size())
rotor = squeal.read_system(folder / "rotor" / "rotor.yaml")
squeal.sweep(rotor, range(0, 901, 50), band=(10, 1000)).plot()
print(squeal.thresholds(rotor, 900, band=(10, 1000)).first.kind)
plt.show()
