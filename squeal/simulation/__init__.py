"""Simulation of models B1 and B2 with located contact changes."""

from squeal.simulation.observers import Response
from squeal.simulation.run import Event, Simulation, simulate

__all__ = ["Event", "Response", "Simulation", "simulate"]
