"""The two ways in which squeal says no; the command line turns them into exit codes.

What they say holds names, keys and values from outside, and reaches terminals.
"""

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

BEYOND = "some numbers are too large or too small for double precision"
NO_BALLS = "python-flint is not installed (`pip install 'brake-squeal[proof]'` brings it)"
# packages that a plain install lacks, and the extra of brake-squeal that brings each
EXTRAS = {"ansys": "ansys", "cma": "search", "h5py": "matlab", "pyyeti": "nastran"}


def missing(error: ImportError) -> str:
    """The name of a package that is not installed, with what installs it."""
    package = (error.name or "squeal").partition(".")[0]
    extra = EXTRAS.get(package)
    return f"{package} (pip install 'brake-squeal[{extra}]')" if extra else package


def visible(text: str) -> str:
    r"""A text with what cannot be printed as escapes, but tabs: names and keys may hold any.

    >>> print(visible("a\x1b[2Jb"))
    a\x1b[2Jb
    """
    lines = text.split("\n")
    return "\n".join(line if line.isprintable() else _escaped(line) for line in lines)


def _escaped(text: str, kept: str = "\t") -> str:
    """A text with escapes for what cannot be printed, but for the characters `kept`."""
    return "".join(c if c.isprintable() or c in kept else ascii(c)[1:-1] for c in text)


def suggestion(unknown: object, known: Iterable[str]) -> str:
    """What is allowed in place of an unknown name or key: a name that is near, or all.

    >>> suggestion("facter", ["file", "factor"]), suggestion("x", ["file", "factor"])
    ('did you mean factor?', 'allowed are file, factor')
    >>> suggestion("x", [])
    'none is allowed'
    >>> suggestion("my", ["m", "mu", "k1"]), suggestion("k5", ["k1", "k2"])
    ('did you mean mu?', 'allowed are k1, k2')
    """
    name = str(unknown)
    names = list(known)
    close = difflib.get_close_matches(name, names, 1, 0.7)  # the nearest one that is alike by 0.7
    if not close:  # two letters of which one is wrong are alike by a half only, not by 0.7
        close = [other for other in names if _differ_in_one_letter(name, other)]
    if len(close) == 1:
        return f"did you mean {close[0]}?"
    return f"allowed are {', '.join(names)}" if names else "none is allowed"


def _differ_in_one_letter(name: str, other: str) -> bool:
    """Whether two names of the same length begin alike and differ in one letter behind."""
    if len(name) != len(other) or name[:1] != other[:1]:
        return False
    return sum(a != b for a, b in zip(name, other, strict=True)) == 1


class _OneLine(Exception):
    """An error or warning that is told in one line, which any terminal can show."""

    def __str__(self) -> str:
        return _escaped(" ".join(super().__str__().splitlines()), kept="")


class InputError(_OneLine, ValueError):
    """The input is refused; one sentence names file, key, value and what is allowed.

    Examples
    --------
    >>> import squeal
    >>> try:
    ...     squeal.System([[1.0]], K=[[1.0, 2.0]])
    ... except squeal.InputError as error:
    ...     print(error)
    K: shape (1, 2); every matrix must be square and of the shape of the first M, (1, 1)
    """


class MatrixError(InputError):
    """The matrices of a system are refused; who knows their file names it before."""


class InputWarning(_OneLine, UserWarning):
    """The input is taken as it stands, but something else may be meant."""


class ComputationError(_OneLine, RuntimeError):
    """A valid request could not be completed; the message gives the reason.

    Examples
    --------
    >>> import squeal
    >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=0.0, k2=0.0, k3=1e7, k4=1e7, L1=1.0,
    ...                  L2=1.0, alpha1=1.57, alpha2=3.14, mu=0.1, F_n=1000.0)
    >>> try:
    ...     squeal.eigenvalues(squeal.Scene("B1", pad))  # no spring holds it against friction
    ... except squeal.ComputationError as error:
    ...     print(str(error).partition(":")[0])
    no steady sliding exists
    """


@contextmanager
def within_doubles() -> Iterator[None]:
    """Turn overflows and failures of linear algebra into a ComputationError.

    Numbers of valid type but extreme size cause them. A LinAlgError of NumPy or SciPy is a
    ValueError; it is told by its name, since this module imports neither.
    """
    try:
        yield
    except (ArithmeticError, ValueError) as error:
        if not isinstance(error, ArithmeticError) and type(error).__name__ != "LinAlgError":
            raise
        words = error.args[-1] if error.args else type(error).__name__
        raise ComputationError(f"{words}; {BEYOND}") from error
