"""This machine: its free memory, and processes that end with this one at an interrupt."""

import math
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
from multiprocessing import get_context, resource_tracker
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")


def available_memory() -> float:
    """Bytes that are free on this machine; unlimited where it does not say."""
    try:
        with open("/proc/meminfo", encoding="ascii") as stream:
            for line in stream:
                if line.startswith("MemAvailable:"):
                    return 1024.0 * float(line.split()[1])
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (OSError, ValueError, AttributeError):
        return math.inf


def mapped(work: Callable[[A], B], tasks: Iterable[A], workers: int) -> Iterator[B]:
    """The results of all tasks, in their order, from so many processes; of one from this.

    Others are started anew by import and stay for later calls, with what they have compiled.
    """
    if workers == 1:
        yield from map(work, tasks)
        return
    pool = _pool(workers)
    try:
        with _held_back():
            begun = [pool.submit(work, task) for task in tasks]
        for one in begun:
            yield one.result()
    except BaseException as error:
        _pool.cache_clear()
        if isinstance(error, KeyboardInterrupt):  # which may have met this process alone
            for process in list((pool._processes or {}).values()):
                process.terminate()  # as `terminate_workers` of Python 3.14
        pool.shutdown(cancel_futures=True)
        raise


@contextmanager
def _held_back() -> Iterator[None]:
    """Processes that begin here meet an interrupt only when they are `_ready`.

    One that still imports would tell of it in a traceback.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # started in between, it would let the signal in again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@lru_cache(maxsize=1)
def _pool(workers: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(workers, get_context("spawn"), _ready)


def _ready() -> None:
    """First words of a process that has imported all: from now on an interrupt ends it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
