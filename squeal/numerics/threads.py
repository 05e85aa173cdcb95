"""Threads of BLAS: on matrices of a few hundred rows they wait for each other."""

import os
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from threading import Lock

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


def threads_of_a_verb() -> AbstractContextManager[object]:
    """A context with one thread of BLAS, unless an environment variable gives their number.

    Before SciPy is loaded it changes nothing: a verb about a pad, of three rows, need not wait for
    that import.
    """
    is_chosen = any(os.environ.get(name) for name in _VARIABLES)
    return nullcontext() if is_chosen or "scipy" not in sys.modules else one_thread()
