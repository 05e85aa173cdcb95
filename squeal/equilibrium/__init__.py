"""Sliding equilibria of the nonlinear models: all of them, and the branch over mu."""

from squeal.equilibrium.branch import Branch, follow
from squeal.equilibrium.find import Equilibrium, find_all, sliding_equilibrium

__all__ = ["Branch", "Equilibrium", "find_all", "follow", "sliding_equilibrium"]
