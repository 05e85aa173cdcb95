"""Simulation of models B1, B2 and BN with located contact changes."""
