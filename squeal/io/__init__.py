"""Files: YAML documents, scene and system files, matrices, records, whole writing, provenance."""
