"""Kept until all import `squeal.linear.invariants`."""

from squeal.linear.invariants import VERDICTS, Cubic, Value, code, cubic_of, invariants

__all__ = ["VERDICTS", "Cubic", "Value", "code", "cubic_of", "invariants"]
