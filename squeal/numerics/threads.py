"""Threads of a verb: those of BLAS, and those that compute independent tasks side by side.

Threads of BLAS wait for each other on matrices of a few hundred rows. Threads of Python gain where
tasks are calls of BLAS, LAPACK, SuperLU or MKL, which release the lock of the interpreter.
"""

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from contextvars import ContextVar, Token, copy_context
from dataclasses import dataclass
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:  # pads start without it
    from concurrent.futures import ThreadPoolExecutor

Result = TypeVar("Result")
_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")
_LOCK = Lock()
_LIMITS: list[AbstractContextManager[object]] = []  # those in force


@contextmanager
def one_thread() -> Iterator[None]:
    """A context with one thread of BLAS, in which the rounding of sums depends on nothing else.

    BLAS has one number of threads for all Python threads: the last one to leave restores it.
    """
    import scipy.linalg  # noqa: F401  # loads its own BLAS, which else would keep its threads
    from threadpoolctl import threadpool_limits

    with _LOCK:
        _LIMITS.append(threadpool_limits(1))
    try:
        yield
    finally:
        with _LOCK:  # the first limit knows the number before, and is taken last
            _LIMITS.pop().__exit__(None, None, None)


@dataclass
class _Team:
    """The thread of a verb, and the `workers` - 1 of a pool that help it."""

    workers: int = 1
    pool: "ThreadPoolExecutor | None" = None
    is_over: bool = False


_TEAM = ContextVar("team", default=_Team())  # noqa: B039  which is never changed


def side_by_side(work: Callable[..., Result], *tasks: Iterable[Any]) -> Iterator[Result]:
    """As `map(work, *tasks)`, by the threads of the verb; `tasks` are equally long.

    While the next result is not there this thread computes others. A task may itself call
    `side_by_side`. The exception of a task is raised when its result is due, after the results of
    the tasks before it; no further task begins then.
    """
    team = _TEAM.get()
    if team.pool is None:
        for arguments in zip(*tasks, strict=True):
            yield work(*arguments)
        return
    from concurrent.futures import Future  # which few verbs need

    # each task in a copy of the context of this thread, so that it finds the team of the verb
    calls: list[tuple[Future[Result], Callable[[], Result]]] = []
    for arguments in zip(*tasks, strict=True):
        calls.append((Future(), partial(copy_context().run, work, *arguments)))
    untaken = iter(calls)  # all threads take from it: the iterator of a list gives each call once

    def compute_next() -> bool:
        """Compute the next task that no thread has taken; False if none is left."""
        for future, call in untaken:
            try:
                future.set_result(call())
            except BaseException as error:  # without a result the reader would wait for ever
                future.set_exception(error)
                if not isinstance(error, Exception):
                    raise
            return True
        return False

    for _ in calls:
        team.pool.submit(compute_next)  # which finds nothing to do if this thread was faster
    try:
        for future, _ in calls:
            while not future.done() and compute_next():
                pass
            yield future.result()
    finally:
        list(untaken)  # empties the iterator: no thread begins another task


def workers_of_verb() -> int:
    """How many threads compute side by side, or processes."""
    return _TEAM.get().workers


def stop_if_over() -> None:
    """End this thread if the verb that it helps has ended, by an interrupt or an error."""
    if _TEAM.get().is_over:
        raise SystemExit


@contextmanager
def threads_of_a_verb(workers: int) -> Iterator[None]:
    """A context with so many threads (`workers`) for `side_by_side`, and with one thread of BLAS,
    unless an environment variable gives the number of threads of BLAS.

    Before SciPy is loaded BLAS stays as it is: a verb about a pad, of three rows, need not wait for
    that import. With one worker the team stays that of the verb that calls this one, if any.
    """
    is_chosen = any(os.environ.get(name) for name in _VARIABLES)
    with ExitStack() as stack:
        if not is_chosen and "scipy" in sys.modules:
            stack.enter_context(one_thread())
        if workers > 1:
            from concurrent.futures import ThreadPoolExecutor

            team = _Team(workers, ThreadPoolExecutor(workers - 1))
            stack.callback(_end, team, _TEAM.set(team))
        yield


def _end(team: _Team, before: Token[_Team]) -> None:
    """End a team without waiting for its threads, which end at their next step."""
    _TEAM.reset(before)
    team.is_over = True
    if team.pool is not None:
        team.pool.shutdown(wait=False, cancel_futures=True)
