"""The number of threads of BLAS, one for the whole process, while Python threads come and go."""

import threading

import pytest
import scipy.linalg  # noqa: F401  # loads its own BLAS
from threadpoolctl import threadpool_info

from squeal.numerics.threads import one_thread


def number_of_threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


@pytest.mark.parametrize("leaves_first", [0, 1])
def test_python_threads_leave_blas_as_they_found_it(leaves_first):
    has_entered = [threading.Event(), threading.Event()]
    has_left = threading.Event()
    seen = []

    def work(k):
        if k == 1:
            has_entered[0].wait(60.0)
        with one_thread():
            has_entered[k].set()
            has_entered[1].wait(60.0)
            if k != leaves_first:
                has_left.wait(60.0)
            seen.append(number_of_threads())
        has_left.set()

    before = number_of_threads()
    threads = [threading.Thread(target=work, args=[k]) for k in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert seen == [{1}, {1}]
    assert number_of_threads() == before
