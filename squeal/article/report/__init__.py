"""LaTeX tables and values of the report, made from result files and from the tables of the code."""
