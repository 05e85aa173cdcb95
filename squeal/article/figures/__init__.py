"""The figures of the report: functions that take results and return a matplotlib Figure.

Each module is also a program (`python -m squeal.plots.histories --help`) that writes one PDF and,
beside it, a text file with the alternative text.
"""
