"""Simulation of models B1 and B2 with located contact changes."""
