"""Arguments of functions, read by the records that read files and refused with the same words."""

import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from squeal.schema.place import Place
from squeal.schema.values import Kind

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True)
class Instance(Kind):
    """An object of a class, or of one of several; `named` says which."""

    kind: type | tuple[type, ...]
    named: str

    def read(self, value: Any, at: Place, model: str = "") -> Any:
        """The object. Raises InputError."""
        if not isinstance(value, self.kind):
            raise at.must_be(value, self.named)
        return value


@dataclass(frozen=True)
class Several(Kind):
    """A sequence, also one that can be gone through once only: of `count`, or of one at least."""

    each: Kind
    named: str
    count: int = 0

    def read(self, value: Any, at: Place, model: str = "") -> tuple[Any, ...]:
        """The entries as a tuple. Raises InputError."""
        try:
            found = () if isinstance(value, str) else tuple(value)
        except TypeError:
            found = ()
        if not found or (self.count and len(found) != self.count):
            raise at.must_be(value, self.named)
        return tuple(self.each.read(one, at) for one in found)


FILE = Instance((str, os.PathLike), "the path of a file")


def takes(**kinds: Kind) -> Callable[[Callable[P, T]], Callable[P, T]]:
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
