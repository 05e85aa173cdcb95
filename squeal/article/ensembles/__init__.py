"""Populations of pads for each of the eight formulations, drawn with equal effort."""
