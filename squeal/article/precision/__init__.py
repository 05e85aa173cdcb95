"""Error against run time: our paths, SciPy's, and other libraries' where they are installed."""
