"""Figures that a query can ask for, and the style of all figures."""
