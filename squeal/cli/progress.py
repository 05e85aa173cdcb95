"""A line on standard error that says how far a long answer is, only where somebody watches."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from squeal.cli.streams import say

EVERY = 0.2  # s between two lines


@contextmanager
def progress_line(what: str) -> Iterator[Callable[[int, int], None] | None]:
    """A function of (done, count) that shows both on a terminal; None where there is none."""
    if not sys.stderr.isatty():
        yield None
        return
    last = 0.0

    def show(done: int, count: int) -> None:
        nonlocal last
        if done == count or time.monotonic() - last > EVERY:
            last = time.monotonic()
            say(f"\r{done} of {count} {what}", end="")

    try:
        yield show
    finally:
        say("\r\033[K", end="")
