"""One file a result: results/X.json is what the study X prints."""
