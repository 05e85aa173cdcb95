"""Threads of BLAS: on matrices of a few hundred rows they wait for each other."""

import os
import sys
from contextlib import AbstractContextManager, nullcontext


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
    is_chosen = any(name.endswith("_NUM_THREADS") for name in os.environ)  # of OMP, OPENBLAS, MKL
    return nullcontext() if is_chosen or "scipy" not in sys.modules else one_thread()
