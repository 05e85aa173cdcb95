"""Tables of the paper, a module per table: `table` from records of results, and its `CAPTION`."""
