"""Numerical tools that know nothing of pads."""
