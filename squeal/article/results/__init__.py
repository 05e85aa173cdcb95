"""Result files as records: results/X.json is read and written by the class of module X.

Light on purpose: figures and tables that read a result do not depend on what computes it.
"""
