"""Tables of the paper, a module a table: `table` from records of results, and its `CAPTION`."""
