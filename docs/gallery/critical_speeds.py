"""
Critical speeds
===============

Where a whirl frequency equals the speed: marks that point up are forward whirl.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import squeal
from squeal.examples.files import Size, write_example

folder = Path(mkdtemp())
write_example("rotor", folder, Size())
rotor = squeal.read_system(folder / "rotor" / "rotor.yaml")
found = squeal.critical_speeds(rotor, 900)
found.plot()
print(len(found.critical), "critical speeds")
plt.show()
