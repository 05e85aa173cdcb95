"""What the queries answer with: one record a verb, its table, its text and its JSON object."""
