"""Processes that work beside this one, and end with it at an interrupt or its death."""

import os
import pickle
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool, ProcessPoolExecutor
from functools import lru_cache
from multiprocessing import get_context, parent_process
from typing import Any

from squeal.errors import ComputationError
from squeal.io.writing import remaining

_COMMON: list[Any] = []  # in a process of a pool: what its tasks share


def mapped(
    work: Callable[..., Any], tasks: Iterable[Any], workers: int, common: Any = None
) -> Iterator[Any]:
    """The results of all tasks, in their order, from so many processes; of one from this.

    Others are started anew by import and stay for later calls, with what they have compiled. They
    ignore interrupts, also while they import; this process ends them at one, and they end by
    themselves once it is gone. With `common`, which each process is sent once, results are
    work(common, task). Every task has one thread of BLAS, so that any number of processes gives
    the same bits.
    """
    if workers == 1:
        with one_thread():
            yield from (work(task) if common is None else work(common, task) for task in tasks)
        return
    pool = _pool(workers) if common is None else _started(workers, common)
    main = threading.current_thread() is threading.main_thread()  # others may not set signals
    try:
        before = signal.signal(signal.SIGINT, signal.SIG_IGN) if main else None
        try:  # the first task starts the processes
            each = ((task,) if common is None else (work, task) for task in tasks)
            begun = [pool.submit(work if common is None else _with_common, *one) for one in each]
        finally:
            if main:
                signal.signal(signal.SIGINT, before)
        for one in begun:
            yield one.result()
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


def counted(
    results: Iterable[Any], count: int, tell: Callable[[str], None], what: str = "values"
) -> Iterator[Any]:
    """The results; `tell` is called once a second with a line about what remains."""
    begun = said = time.monotonic()
    for done, one in enumerate(results, 1):
        if time.monotonic() > said + 1.0 and done < count:
            said = time.monotonic()
            tell(f"{done} of {count} {what}, {remaining(begun, done, count)}")
        yield one


def one_thread() -> Any:
    """A context with one thread of BLAS, in which the rounding of sums depends on nothing else."""
    import scipy.linalg  # noqa: F401  # loads its own BLAS, which else would keep its threads
    from threadpoolctl import threadpool_limits

    return threadpool_limits(1)


def _begin(sent: Any) -> None:
    """Prepare a process of a pool."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    one_thread()
    _COMMON.append(pickle.loads(sent.get()))


def _end_with_parent() -> None:
    if parent := parent_process():
        parent.join()
        os._exit(1)


def _with_common(work: Callable[[Any, Any], Any], task: Any) -> Any:
    return work(_COMMON[0], task)


def _started(workers: int, common: Any = None) -> ProcessPoolExecutor:
    # by a thread: with what starts a process, which may die before it reads, this one would wait
    # for ever
    context, data = get_context("spawn"), pickle.dumps(common)
    sent = context.SimpleQueue()

    def send() -> None:
        for _ in range(workers):
            sent.put(data)

    threading.Thread(target=send, daemon=True).start()
    return ProcessPoolExecutor(workers, context, _begin, (sent,))


@lru_cache(maxsize=1)
def _pool(workers: int) -> ProcessPoolExecutor:
    return _started(workers)
