"""Arguments of functions, read by the records that read files and refused with the same words."""

import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any, ParamSpec, Protocol, TypeVar

from squeal.schema.place import Place

P = ParamSpec("P")
T = TypeVar("T")


class Reads(Protocol):
    """What `squeal.schema.values.Kind` offers, and the records below."""

    def read(self, value: Any, at: Place) -> Any:
        """The value as it is used. Raises InputError."""


@dataclass(frozen=True)
class Instance:
    """An object of a class, or of one of several; `words` say which."""

    kind: type | tuple[type, ...]
    words: str

    def read(self, value: Any, at: Place) -> Any:
        """The object. Raises InputError."""
        if not isinstance(value, self.kind):
            raise at.must_be(value, self.words)
        return value


@dataclass(frozen=True)
class Several:
    """A sequence, also one that can be gone through once only: of `count`, or of one at least."""

    each: Reads
    words: str
    count: int = 0

    def read(self, value: Any, at: Place) -> tuple[Any, ...]:
        """The entries as a tuple. Raises InputError."""
        try:
            found = () if isinstance(value, str) else tuple(value)
        except TypeError:
            found = ()
        if not found or (self.count and len(found) != self.count):
            raise at.must_be(value, self.words)
        return tuple(self.each.read(one, at) for one in found)


FILE = Instance((str, os.PathLike), "the path of a file")


def takes(**kinds: Reads) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """The same function with the arguments of these names read as given; a default passes."""

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        signature = inspect.signature(function)

        @wraps(function)
        def checked(*args: P.args, **more: P.kwargs) -> T:
            bound = signature.bind(*args, **more)
            for name, kind in kinds.items():
                if name in bound.arguments:
                    at = Place(function.__name__, name)
                    bound.arguments[name] = kind.read(bound.arguments[name], at)
            return function(*bound.args, **bound.kwargs)

        return checked

    return decorate
