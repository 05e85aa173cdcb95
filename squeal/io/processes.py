"""Processes that work beside this one, and end with it at an interrupt or its death."""

import os
import pickle
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import lru_cache, partial
from multiprocessing import get_context, parent_process
from typing import TYPE_CHECKING, Any, TypeVar

from squeal.errors import ComputationError
from squeal.io.writing import remaining
from squeal.numerics.threads import one_thread

if TYPE_CHECKING:
    from multiprocessing.queues import SimpleQueue

Task = TypeVar("Task")
Result = TypeVar("Result")
_HELD = ExitStack()  # in a process of a pool: its one thread of BLAS, to its end
_COMMON: list[Any] = []  # in a process of a pool: what its tasks share


def mapped(
    work: Callable[..., Result], tasks: Iterable[object], workers: int, common: object = None
) -> Iterator[Result]:
    """The results work(task) of all tasks, in their order, computed by so many processes.

    One worker is this process itself. Several are new processes, which import the modules anew.
    Without `common` they stay for later calls, with what they have compiled. With it the results
    are work(common, task): the processes are made for this call, and `common` is sent to each once.

    The processes ignore an interrupt, also while they import: this process then ends them. They end
    by themselves once this process is gone. Every task has one thread of BLAS, so that any number
    of processes gives the same bits. An exception of a task is raised here, and ends all processes;
    ComputationError where a process was killed.
    """
    if workers == 1:
        with one_thread():
            for task in tasks:
                yield work(task) if common is None else work(common, task)
        return
    if common is None:
        pool = _lasting_pool(workers)
        task_work = work
    else:
        pool = _new_pool(workers, common)
        task_work = partial(_with_common, work)
    try:
        with _interrupts_ignored():  # the first task starts the processes
            futures = [pool.submit(task_work, task) for task in tasks]
        for future in futures:
            yield future.result()
    except BaseException as error:
        # whatever happened (also a caller that takes no more results), the pool is shut down below
        if common is None:  # the next call must make a new one that lasts
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


def _begin(sent: "SimpleQueue[bytes]") -> None:
    """Prepare a process of a pool, which takes what its tasks share from a queue."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _HELD.enter_context(one_thread())
    _COMMON.append(pickle.loads(sent.get()))


def _end_with_parent() -> None:
    """Wait for the end of the process that started this one, and end this one too."""
    parent = parent_process()
    if parent:
        parent.join()
        os._exit(1)


def _with_common(work: Callable[[Any, Task], Result], task: Task) -> Result:
    """The result of a task, in a process that was sent what its tasks share."""
    return work(_COMMON[0], task)


def _new_pool(workers: int, common: object = None) -> ProcessPoolExecutor:
    """A pool of processes that are sent what their tasks share.

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
def _lasting_pool(workers: int) -> ProcessPoolExecutor:
    """The pool of so many processes that stays for later calls, whose tasks share nothing."""
    return _new_pool(workers)
