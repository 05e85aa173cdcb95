"""Many pads at once."""
