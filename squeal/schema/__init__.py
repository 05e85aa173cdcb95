"""What values may be: one table of keys that reads, checks and documents files and records."""
