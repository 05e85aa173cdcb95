"""The two ways in which squeal says no; the command line turns them into exit codes."""

# why a computation with numbers of wild size fails
BEYOND = "the numbers of the scene are too large or too small for double precision"


class InputError(ValueError):
    """The input is refused; one sentence names file, key, value and what is allowed."""


class MatrixError(InputError):
    """The matrices of a system are refused; who knows their file names it before."""


class InputWarning(UserWarning):
    """The input is taken as it stands, but something else may be meant."""


class ComputationError(RuntimeError):
    """A valid request could not be completed; the message gives the reason."""
