"""Processes that work beside this one, and end with it at an interrupt or its death."""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import lru_cache
from multiprocessing import get_context, parent_process
from typing import TypeVar

from squeal.errors import ComputationError
from squeal.io.writing import remaining
from squeal.numerics.threads import side_by_side, threads_of_a_verb, workers_of_verb

Task = TypeVar("Task")
Result = TypeVar("Result")
_HELD = ExitStack()  # in a process of a pool: its threads of BLAS, to its end


def mapped(
    work: Callable[[Task], Result], tasks: Iterable[Task], in_threads: bool = False
) -> Iterator[Result]:
    """The results work(task) of all tasks, in their order, by the workers of the verb.

    The workers are processes, or threads if `in_threads`, as tasks of large systems take them. One
    worker is this process itself. Several are new processes, which import the modules anew, and
    stay for later calls, with what they have compiled.

    The processes ignore an interrupt, also while they import: this process then ends them. They end
    by themselves once this process is gone. Every task has as many threads of BLAS as the verb, so
    that any number of processes gives the same bits. An exception of a task is raised here, and
    ends all processes; ComputationError where a process was killed.
    """
    if in_threads:
        yield from side_by_side(work, tasks)
        return
    if workers_of_verb() == 1:
        yield from map(work, tasks)
        return
    pool = _lasting_pool(workers_of_verb())
    try:
        with _interrupts_blocked():  # the first task starts the processes
            futures = [pool.submit(work, task) for task in tasks]
        for future in futures:
            yield future.result()
    except BaseException as error:
        # whatever happened (also a caller that takes no more results), the next call makes a pool
        _lasting_pool.cache_clear()
        if isinstance(error, KeyboardInterrupt):
            for process in list((pool._processes or {}).values()):
                process.terminate()  # as `terminate_workers` of Python 3.14
        pool.shutdown(cancel_futures=True)
        if isinstance(error, BrokenProcessPool):
            raise ComputationError(
                "a process that worked beside this one was killed, for lack of memory perhaps; "
                "fewer `workers` need less. A script that asks for workers needs its "
                'calls below `if __name__ == "__main__":`, since each process imports it'
            ) from None
        raise


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Let processes that are started meanwhile take no interrupts; this one takes its own after."""
    if threading.current_thread() is not threading.main_thread():  # others may not set signals
        yield
        return
    arrived: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: arrived.append(number))
    has_masks = os.name != "nt"
    if has_masks:  # which new processes inherit
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        if has_masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, before)
    if arrived:
        signal.raise_signal(signal.SIGINT)


def with_progress(
    results: Iterable[Result], count: int, tell: Callable[[str], None], what: str = "values"
) -> Iterator[Result]:
    """Pass on the `count` results, and report progress about once a second.

    tell: is called with a line that says how many are done and what time remains; what: are
    counted, in this line.
    """
    begun = time.monotonic()
    last_report = begun
    for done, result in enumerate(results, 1):
        if time.monotonic() > last_report + 1.0 and done < count:
            last_report = time.monotonic()
            tell(f"{done} of {count} {what}, {remaining(begun, done, count)}")
        yield result


def _begin() -> None:
    """Prepare a process of a pool."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    import scipy.linalg  # noqa: F401  # whose BLAS else keeps its threads

    _HELD.enter_context(threads_of_a_verb(1))


def _end_with_parent() -> None:
    """Wait for the end of the process that started this one, and end this one too."""
    parent = parent_process()
    if parent:
        parent.join()
        os._exit(1)


@lru_cache(maxsize=1)
def _lasting_pool(workers: int) -> ProcessPoolExecutor:
    """The pool of so many processes, which stays for later calls."""
    return ProcessPoolExecutor(workers, get_context("spawn"), _begin)
