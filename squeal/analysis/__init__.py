"""Answers about a scene: eigenvalues, thresholds, maps, sensitivities, advice."""
