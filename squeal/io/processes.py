"""Processes that work beside this one, and end with it at an interrupt."""

import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import lru_cache
from multiprocessing import get_context
from typing import Any


def mapped(work: Callable[[Any], Any], tasks: Iterable[Any], workers: int) -> Iterator[Any]:
    """The results of all tasks, in their order, from so many processes; of one from this.

    Others are started anew by import and stay for later calls, with what they have compiled. They
    ignore interrupts, also while they import; this process ends them at one.
    """
    if workers == 1:
        yield from map(work, tasks)
        return
    pool = _pool(workers)
    main = threading.current_thread() is threading.main_thread()  # others may not set signals
    before = signal.signal(signal.SIGINT, signal.SIG_IGN) if main else None
    try:
        begun = [pool.submit(work, task) for task in tasks]  # starts the processes
    finally:
        if main:
            signal.signal(signal.SIGINT, before)
    try:
        for one in begun:
            yield one.result()
    except BaseException as error:
        _pool.cache_clear()
        if isinstance(error, KeyboardInterrupt):
            for process in list((pool._processes or {}).values()):
                process.terminate()  # as `terminate_workers` of Python 3.14
        pool.shutdown(cancel_futures=True)
        raise


@lru_cache(maxsize=1)
def _pool(workers: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(workers, get_context("spawn"))
