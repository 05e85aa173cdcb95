"""Sliding equilibria of the nonlinear models: all of them, and their branches over mu."""

from squeal.equilibrium.branch import Branches, BranchOptions, follow
from squeal.equilibrium.find import Equilibrium, Path, find_all, rests, sliding_equilibrium

# fmt: off
__all__ = [
    "BranchOptions", "Branches", "Equilibrium", "Path", "find_all", "follow", "rests",
    "sliding_equilibrium",
]
