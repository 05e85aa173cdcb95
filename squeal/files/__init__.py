"""Files: YAML documents, checked values, whole writing, results read back, provenance."""
