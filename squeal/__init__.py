"""squeal: hammering brake squeal of a rigid pad, simulated, linearised and judged."""

__version__ = "0.1.0"
