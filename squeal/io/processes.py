"""Processes that work beside this one, and end with it at an interrupt or its death."""

import os
import pickle
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from functools import lru_cache
from multiprocessing import get_context, parent_process
from typing import TYPE_CHECKING, Any, TypeVar

from squeal.errors import ComputationError
from squeal.io.writing import remaining

if TYPE_CHECKING:
    from multiprocessing.queues import SimpleQueue

Task = TypeVar("Task")
Result = TypeVar("Result")
_COMMON: list[Any] = []  # in a process of a pool: what its tasks share


def mapped(
    work: Callable[..., Result], tasks: Iterable[object], workers: int, common: object = None
) -> Iterator[Result]:
    """The results of all tasks, in their order, from so many processes; from this one if `workers`
    is 1.

    Others are started anew by import and stay for later calls, with what they have compiled. They
    ignore interrupts, also while they import; this process ends them at one, and they end by
    themselves once it is gone. With `common`, which each process is sent once, results are
    work(common, task). Every task has one thread of BLAS, so that any number of processes gives
    the same bits.
    """
    if workers == 1:
        with one_thread():
            for task in tasks:
                yield work(task) if common is None else work(common, task)
        return
    pool = _pool(workers) if common is None else _started(workers, common)
    try:
        with _interrupts_ignored():  # the first task starts the processes
            if common is None:
                futures = [pool.submit(work, task) for task in tasks]
            else:
                futures = [pool.submit(_with_common, work, task) for task in tasks]
        for future in futures:
            yield future.result()
    except BaseException as error:
        _pool.cache_clear()
        if isinstance(error, KeyboardInterrupt):
            for process in list((pool._processes or {}).values()):
                process.terminate()  # as `terminate_workers` of Python 3.14
        pool.shutdown(cancel_futures=True)
        if isinstance(error, BrokenProcessPool):
            raise ComputationError(
                "a process that worked beside this one was killed, for lack of memory perhaps; "
                "fewer of them (--workers) need less. A script that asks for workers needs its "
                'calls below `if __name__ == "__main__":`, since each process imports it'
            ) from None
        raise
    if common is not None:
        pool.shutdown()


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Let processes that are started meanwhile ignore interrupts, as this one does."""
    if threading.current_thread() is not threading.main_thread():  # others may not set signals
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def counted(
    results: Iterable[Result], count: int, tell: Callable[[str], None], what: str = "values"
) -> Iterator[Result]:
    """The results; `tell` is called once a second with a line about what remains."""
    begun = told = time.monotonic()
    for done, result in enumerate(results, 1):
        if time.monotonic() > told + 1.0 and done < count:
            told = time.monotonic()
            tell(f"{done} of {count} {what}, {remaining(begun, done, count)}")
        yield result


def one_thread() -> AbstractContextManager[object]:
    """A context with one thread of BLAS, in which the rounding of sums depends on nothing else."""
    import scipy.linalg  # noqa: F401  # loads its own BLAS, which else would keep its threads
    from threadpoolctl import threadpool_limits

    return threadpool_limits(1)


def _begin(sent: "SimpleQueue[bytes]") -> None:
    """Prepare a process of a pool."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    one_thread()
    _COMMON.append(pickle.loads(sent.get()))


def _end_with_parent() -> None:
    parent = parent_process()
    if parent:
        parent.join()
        os._exit(1)


def _with_common(work: Callable[[Any, Task], Result], task: Task) -> Result:
    return work(_COMMON[0], task)


def _started(workers: int, common: object = None) -> ProcessPoolExecutor:
    """Processes that are sent what their tasks share.

    A thread sends it. As an argument of the pool it would be sent by this thread, which would wait
    for ever for a process that dies before it has read.
    """
    context = get_context("spawn")
    data = pickle.dumps(common)
    sent = context.SimpleQueue()

    def send() -> None:
        for _ in range(workers):
            sent.put(data)

    threading.Thread(target=send, daemon=True).start()
    return ProcessPoolExecutor(workers, context, _begin, (sent,))


@lru_cache(maxsize=1)
def _pool(workers: int) -> ProcessPoolExecutor:
    return _started(workers)
