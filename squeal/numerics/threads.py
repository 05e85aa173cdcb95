"""Threads of BLAS: on matrices of a few hundred rows they wait for each other."""

import os
import sys
from contextlib import AbstractContextManager, nullcontext

_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")


def one_thread() -> AbstractContextManager[object]:
    """A context with one thread of BLAS, in which the rounding of sums depends on nothing else."""
    import scipy.linalg  # noqa: F401  # loads its own BLAS, which else would keep its threads
    from threadpoolctl import threadpool_limits

    return threadpool_limits(1)


def threads_of_a_verb() -> AbstractContextManager[object]:
    """A context with one thread of BLAS, unless an environment variable gives their number.

    Before SciPy is loaded it changes nothing: a verb about a pad, of three rows, need not wait for
    that import.
    """
    is_chosen = any(os.environ.get(name) for name in _VARIABLES)
    return nullcontext() if is_chosen or "scipy" not in sys.modules else one_thread()
