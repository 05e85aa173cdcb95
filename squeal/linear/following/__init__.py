"""Thresholds of systems with more than three degrees of freedom, by following eigenvalues."""
