"""Large systems with sparse matrices: roots with a count, thresholds, reduced systems."""
