"""Which units a model seems to have, by its size, its density and its speeds.

Numbers of a file do not tell their units, and only units that go together give true frequencies: a
mass unit times a length unit over a second squared has to be the force unit, as of m, kg, N.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.spatial import KDTree

from squeal.io.coordinates import Coordinates
from squeal.linear.matrices import Matrix

Units: TypeAlias = tuple[float, float, float]
"""Of length, mass and stiffness: how many of them are 1 m, 1 kg and 1 N/m."""
UNITS: dict[str, Units] = {
    "m, kg, N/m": (1.0, 1.0, 1.0),
    "mm, t, N/mm": (1e3, 1e-3, 1e-3),
    "mm, kg, N/m": (1e3, 1.0, 1.0),
    "mm, kg, N/mm": (1e3, 1.0, 1e-3),
    "mm, kg, kN/mm": (1e3, 1.0, 1e-6),
    "m, kg, N/mm": (1.0, 1.0, 1e-3),
    "m, g, N/m": (1.0, 1e3, 1.0),
    "mm, g, N/m": (1e3, 1e3, 1.0),
    "m, t, N/m": (1.0, 1e-3, 1.0),
    "mm, t, N/m": (1e3, 1e-3, 1.0),
    "mm, g, N/mm": (1e3, 1e3, 1e-3),
    "mm, kg/m3 mm3, N/mm": (1e3, 1e9, 1e-3),
    "mm, kg/m3 mm3, Pa mm": (1e3, 1e9, 1e3),
}
CONSISTENT = list(UNITS)[:2]  # those that go together
LBF = 4.448222  # N
OTHER_CONSISTENT: list[tuple[str, Units]] = [  # rarer ones, with the name of their length
    ("inches", (1 / 0.0254, 0.0254 / LBF, 0.0254 / LBF)),  # in, lbf s2/in, lbf/in
    ("feet", (1 / 0.3048, 0.3048 / LBF, 0.3048 / LBF)),  # ft, slug, lbf/ft
    ("centimetres", (1e2, 1e3, 1e3)),  # cm, g, dyn/cm
    ("centimetres", (1e2, 1e-2, 1e-2)),  # cm, N s2/cm, N/cm
]
# limits of size, of density (mass over the volume of the box around all nodes), and of speed
LARGEST = 50.0  # m, as of a rail
LIGHTEST = 0.02  # kg/m^3, of the box around a frame or shell
HEAVIEST = 2.3e4  # kg/m^3, above that of any solid metal in use
METAL = 1300.0  # kg/m^3: a box of more holds metal, since rubber and wood are lighter
METAL_SPEED = 300.0  # m/s: waves in a box of metal are faster
BRAKE = 500.0  # kg/m^3: a box around a brake holds as much metal
METAL_SPEEDS = (3000.0, 1e4)  # m/s: waves in iron, steel, aluminium as meshes give them
SLOWEST = 10.0  # m/s: waves in soft rubber, or size times lowest frequency of a pad on springs
FASTEST = 5e4  # m/s, of waves; those in metal reach 10,000


def mesh_speed(coordinates: Coordinates, M: Matrix, K: Matrix) -> float:
    """The speed of waves in a mesh, in its unit of length per second, from matrices (n, n).

    A row that moves along its element has about the stiffness K_ii = E A / h and the mass
    M_ii = rho A h, with the distance h to the next node: h (K_ii / M_ii)^(1/2) is the speed
    (E / rho)^(1/2). Unlike a frequency times the size, it does not fall with slenderness. Rows that
    bend the part are slower. So the upper quartile of all rows is taken: two rows of three move in
    the plane of a shell, one of three along a beam. NaN if all rows are rotations, as of torsion.
    """
    moves = (coordinates.directions >= 0) & (M.diagonal().real > 0.0)  # (n,), without rotations
    if not moves.any():
        return math.nan
    # two nodes are asked for: the nearest one to a node is the node itself
    distances, _ = KDTree(coordinates.places).query(coordinates.places, 2)
    to_next_node = distances[coordinates.nodes[moves], 1]
    squares = np.abs(K.diagonal()[moves]) / M.diagonal()[moves].real
    return float(np.quantile(to_next_node * np.sqrt(squares), 0.75))


def hints_of_units(size: float, density: float, speed: float, fastest: float) -> list[str]:
    """Name the units that a model seems to have, if they do not go together.

    All units of `UNITS` are tried in turn, until size, density and speed, converted from them to SI
    units, are those of a brake or of a part. The limits are wide, so that no sound model is blamed.
    Nothing is said of what is a part of metal in `OTHER_CONSISTENT` units; these are named where
    the model may be another part in them.

    Parameters
    ----------
    size : float
        The largest length, in the unit of length of the model.
    density : float
        Mass over volume of the box around it, in its units; NaN, of a plane model, is not judged.
    speed : float
        Of waves, or size times lowest frequency, in its unit of length per second.
    fastest : float
        The largest speed that may occur, m/s.

    Returns
    -------
    list of str
        One sentence; none if the units go together, or if none of `UNITS` fits.
    """
    exceptions = ["all is soft lining"]
    for length, units in OTHER_CONSISTENT:
        model = _InSI.of(units, size, density, speed)
        if model.is_metal:
            return []
        if model.is_possible(fastest):
            exceptions.append(f"lengths are in {length}")
    for name, units in UNITS.items():
        if not _InSI.of(units, size, density, speed).is_possible(fastest):
            continue
        if name in CONSISTENT:
            return []
        effect = f"frequencies are {_frequency_factor(units):.3g} times the true ones"
        unless = " or ".join(dict.fromkeys(exceptions))
        return [
            f"looks like {name}: {effect}, unless {unless}; {' or '.join(CONSISTENT)} go together"
        ]
    return []


def _frequency_factor(units: Units) -> float:
    """By what the frequencies (K / M)^(1/2) from numbers in these units are wrong."""
    _, kilogram, newton_per_metre = units
    return math.sqrt(newton_per_metre / kilogram)


class _InSI(NamedTuple):
    """What a model is if its numbers have some units."""

    size: float  # m
    density: float  # kg/m^3, NaN where it is unknown
    speed: float  # m/s

    @classmethod
    def of(cls, units: Units, size: float, density: float, speed: float) -> _InSI:
        """From the numbers of the model, as `hints_of_units` takes them."""
        metre, kilogram, _ = units
        true_speed = speed / metre / _frequency_factor(units)
        return cls(size / metre, density * metre**3 / kilogram, true_speed)

    def is_possible(self, fastest: float) -> bool:
        """Whether there are such brakes or parts; `fastest` is the largest speed, m/s."""
        slowest = METAL_SPEED if self.density > METAL else SLOWEST
        has_wrong_density = self.density < LIGHTEST or self.density > HEAVIEST  # False of NaN
        return self.size < LARGEST and not has_wrong_density and slowest < self.speed < fastest

    @property
    def is_metal(self) -> bool:
        """Whether it is a brake, or a part of metal, without doubt."""
        slowest, fastest = METAL_SPEEDS
        is_dense = BRAKE < self.density < HEAVIEST
        return self.size < LARGEST and is_dense and slowest < self.speed < fastest
