"""Sliding equilibria of the nonlinear models: all of them, and their branches over mu."""

from squeal.equilibrium.branch import Branches, BranchOptions, follow
from squeal.equilibrium.find import Equilibrium, find_all, rests, sliding_equilibrium
from squeal.equilibrium.path import Path

# fmt: off
__all__ = [
    "BranchOptions", "Branches", "Equilibrium", "Path", "find_all", "follow", "rests",
    "sliding_equilibrium",
]
