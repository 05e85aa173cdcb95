"""Integrators that carry a motion on within one contact state."""
