"""Threads of BLAS, one number for the whole process, and threads that share the work of a verb."""

import threading

import pytest
import scipy.linalg  # noqa: F401  # loads its own BLAS
from threadpoolctl import threadpool_info

from squeal.numerics.threads import (
    one_thread,
    side_by_side,
    stop_if_over,
    threads_of_a_verb,
)


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


def squares(numbers):
    return list(side_by_side(lambda number: number**2, numbers))


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_tasks_side_by_side_give_what_map_gives(workers):
    """Also those that share theirs out in turn, and an exception where its task stands."""
    with threads_of_a_verb(workers):
        rows = [range(k) for k in range(20)]
        assert list(side_by_side(squares, rows)) == list(map(squares, rows))
        assert list(side_by_side(pow, [2, 3], [4, 5])) == [16, 243]
        results = side_by_side(divmod, [6, 7, 8, 9], [2, 3, 0, "nine"])
        assert [next(results), next(results)] == [(3, 0), (2, 1)]
        with pytest.raises(ZeroDivisionError):
            next(results)
        with pytest.raises(ValueError, match="zip"):
            list(side_by_side(pow, [2, 3], [4]))


def test_two_threads_compute_and_end_with_their_verb():
    both = threading.Barrier(2, timeout=60.0)
    before = set(threading.enumerate())
    with threads_of_a_verb(2):
        helper = set(threading.enumerate()) - before
        assert len(list(side_by_side(lambda _: both.wait(), range(2)))) == 2
    for thread in helper:
        thread.join(60.0)
        assert not thread.is_alive()


def test_a_thread_whose_verb_was_interrupted_ends_at_its_next_step():
    is_working = threading.Event()
    is_over = threading.Event()
    before = set(threading.enumerate())

    def work(k):
        if threading.current_thread() is threading.main_thread():
            is_working.wait(60.0)
            raise KeyboardInterrupt
        is_working.set()
        is_over.wait(60.0)
        stop_if_over()
        done.append(k)

    done: list[int] = []
    with pytest.raises(KeyboardInterrupt), threads_of_a_verb(2):
        list(side_by_side(work, range(9)))
    helpers = set(threading.enumerate()) - before
    is_over.set()
    for thread in helpers:
        thread.join(60.0)
        assert not thread.is_alive()
    assert not done


@pytest.mark.parametrize("error", [SystemExit, KeyboardInterrupt])
def test_what_ends_a_helping_thread_ends_the_verb(error):
    """Not an Exception, such as `sys.exit()` in the progress of a caller: nobody waits for it."""
    main = threading.current_thread()
    is_helped = threading.Event()

    def work(k):
        if threading.current_thread() is main:
            is_helped.wait(30.0)
            return k
        is_helped.set()
        raise error

    with pytest.raises(error), threads_of_a_verb(2):
        list(side_by_side(work, range(4)))
