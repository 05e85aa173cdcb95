"""Compiled integrators, each lent to one user at a time."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Generic, TypeVar

Machine = TypeVar("Machine")


class Pool(Generic[Machine]):
    """Machines of one kind; another is made whenever all are lent out.

    A machine comes as its last user left it: whoever takes it sets all of its parameters and
    state. Threads, and integrators used in turns, then cannot disturb each other.
    """

    def __init__(self, make: Callable[[], Machine]) -> None:
        self._make, self._lock = make, Lock()
        self._idle: list[Machine] = []

    @contextmanager
    def lease(self) -> Iterator[Machine]:
        """A machine for the time of a `with` block, used by nobody else."""
        try:
            machine = self._idle.pop()
        except IndexError:
            with self._lock:  # the first is compiled once; the others come from it
                machine = self._make()
        try:
            yield machine
        finally:
            self._idle.append(machine)
