"""A line on standard error that says how far a long answer is, only where somebody watches."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

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
            print(f"\r{done} of {count} {what}", end="", file=sys.stderr, flush=True)

    try:
        yield show
    finally:
        print("\r\033[K", end="", file=sys.stderr, flush=True)
