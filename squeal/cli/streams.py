"""Standard streams as users leave them: closed, full, or without the letters of a text."""

import os
import re
import sys
import time
from collections.abc import Callable
from typing import TextIO

from squeal.errors import ComputationError, InputError, missing, visible, within_doubles
from squeal.io.writing import remaining

SILENCE = 10.0  # s
_COLOURS = {"unstable": 31, "stable": 32, "open": 33}
_VERDICT = re.compile(
    r"^(?:(?P<unstable>\d+ unstable mode)|(?P<stable>Stable)"
    r"|(?P<open>Marginal|No growing mode was found|No root was found|Open))\b.*",
    re.M,
)


def exit_code(name: str, work: Callable[[], int]) -> int:
    """The exit code of some work: its own, or of what stops it, said in a line after the name.

    2: the input is refused; 1: the computation could not be completed; 130: an interrupt.
    """
    code = 1
    try:
        with within_doubles():
            return work()
    # a UnicodeEncodeError comes from the name of a file that is no text
    except (InputError, UnicodeEncodeError) as error:
        code = 2
        words = str(error)
    except ComputationError as error:
        words = str(error)
    except MemoryError:
        words = "there is not enough memory for this scene"
    except ImportError as error:
        package = missing(error)
        if package == "squeal":  # a fault of ours, shown with its traceback
            raise
        words = f"the package {package} cannot be imported: {error}"
    except OSError as error:
        words = f"{error.filename or 'output'}: {error.strerror or error}"
    except KeyboardInterrupt:
        code = 130
        words = "stopped"
    say(f"{name}: {' '.join(words.splitlines())}")
    return code


def open_closed() -> None:
    """Replace standard streams that are closed (None), so that nothing else takes their place.

    Without that, a file opened later would have their descriptor, and output would go into it. What
    is said on standard error goes nowhere. Standard output cannot be written to, as on a full disc,
    so that the command fails: somebody meant to read it.
    """
    if sys.stdin is None:
        sys.stdin = os.fdopen(os.open(os.devnull, os.O_RDONLY), "r")
    if sys.stdout is None:
        sys.stdout = os.fdopen(os.open(os.devnull, os.O_RDONLY), "w")
    if sys.stderr is None:
        sys.stderr = os.fdopen(os.open(os.devnull, os.O_WRONLY), "w")


def say(text: str, end: str = "\n") -> None:
    """Print on standard error, in place of the progress there; what fails stops nothing."""
    try:
        print(f"{_erase()}{visible(text)}", end=end, file=sys.stderr, flush=True)
    except OSError:  # a full disc, a terminal that is gone
        _silence(sys.stderr)


def _takes_escapes(stream: TextIO) -> bool:
    """True for a terminal that obeys escape sequences; a dumb one, as in Emacs, prints them."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"


def _erase() -> str:
    return "\r\033[K" if _takes_escapes(sys.stderr) else ""


def _silence(stream: TextIO) -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def steps() -> Callable[[str], None]:
    """A function that prints a step of long work on standard error.

    A terminal shows every step. Elsewhere (a pipe, a file) a step is printed only if more than
    `SILENCE` seconds have passed since the last one that was printed, or since the work began.
    """
    printed_at = time.monotonic()

    def show(text: str) -> None:
        nonlocal printed_at
        if _takes_escapes(sys.stderr) or time.monotonic() > printed_at + SILENCE:
            printed_at = time.monotonic()
            say(f"squeal: {text}")

    return show


def counter(what: str) -> Callable[[int, int], None]:
    """A function of (done, count) that shows the progress on standard error until all is done.

    A terminal shows it on one line, which each call replaces; elsewhere a line is printed as seldom
    as by `steps`.
    """
    begun = time.monotonic()
    show_step = steps()

    def show(done: int, count: int) -> None:
        line = ""
        if done < count:
            line = f"{done} of {count} {what}, {remaining(begun, done, count)}"
        if _takes_escapes(sys.stderr):
            say(line, end="")
        elif line:
            show_step(line)

    return show


def _coloured(verdict: re.Match[str]) -> str:
    colour = _COLOURS[verdict.lastgroup or "open"]
    return f"\033[1;{colour}m{verdict[0]}\033[0m"


def printed(text: str) -> int:
    """Print on standard output, letters that its encoding lacks as escapes; returns the exit code.

    The code is 0 also where the reader has gone (head, less), and 1 where nothing can be written.
    """
    encoding = sys.stdout.encoding or "utf-8"
    shown = visible(text).encode(encoding, "backslashreplace").decode(encoding)
    if _takes_escapes(sys.stdout) and not os.environ.get("NO_COLOR"):
        shown = _VERDICT.sub(_coloured, shown)
    try:
        print(shown, flush=True)
    except OSError as error:
        _silence(sys.stdout)  # nothing is left to say
        if not isinstance(error, BrokenPipeError):
            say(f"squeal: output: {error.strerror}")
            return 1
    return 0
