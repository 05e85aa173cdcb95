"""Sliding equilibria of the nonlinear models: all of them, and the branch over mu."""

from squeal.equilibrium.branch import Branch, follow
from squeal.equilibrium.find import Equilibrium, find_all, sliding_equilibrium
from squeal.equilibrium.path import Path
from squeal.equilibrium.settings import ContinuationSettings

# fmt: off
__all__ = [
    "Branch", "ContinuationSettings", "Equilibrium", "Path", "find_all", "follow",
    "sliding_equilibrium",
]
