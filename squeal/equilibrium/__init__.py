"""Sliding equilibria of the nonlinear models: all of them, and their branches over mu."""

from squeal.equilibrium.find import Equilibrium, find_all
from squeal.equilibrium.path import Path, sliding_equilibrium

__all__ = ["Equilibrium", "Path", "find_all", "sliding_equilibrium"]
