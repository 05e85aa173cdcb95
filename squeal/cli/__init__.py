"""The commands of the command line, one module each, with functions `options` and `run`."""
