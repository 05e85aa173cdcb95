"""Answers about systems of terms, dense or sparse: roots, sweeps, thresholds, charts."""
