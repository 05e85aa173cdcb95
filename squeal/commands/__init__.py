"""The commands of the command line, one module each; also `python -m squeal.commands.NAME`."""
