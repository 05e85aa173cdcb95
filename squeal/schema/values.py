"""What a value may be: one record a kind that reads, checks and words it.

The same record serves a file (`read`: from YAML to the value) and a Python record (`check`: the
value as it stands), so both refuse with the same sentence.
"""

from __future__ import annotations

import inspect
import math
import os
import re
import reprlib
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from numbers import Integral
from typing import Any, ParamSpec, TypeVar

import numpy as np

from squeal.errors import InputError, InputWarning

P = ParamSpec("P")
T = TypeVar("T")
_SHORT = reprlib.Repr()  # aliases can make a short file mean a value of any size
_SHORT.maxstring = _SHORT.maxother = 200
_FACTOR = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_ANGLE = re.compile(rf"\s*([-+]?)\s*(?:({_FACTOR})\s*\*\s*)?pi\s*(?:/\s*({_FACTOR}))?\s*", re.ASCII)
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*", re.ASCII)
_PLAIN = (int, float, np.integer, np.floating)
_NO_NUMBERS = (bool, np.bool_, str, bytes, list, tuple, set, dict)


class Place:
    """Where a value stands: a file or record and the dotted key in it, for messages."""

    def __init__(self, source: str, *path: str) -> None:
        self.source, self.path = source, path

    def __truediv__(self, key: object) -> Place:
        word = str(key)
        return Place(self.source, *self.path, word if word.isprintable() else repr(word))

    def __str__(self) -> str:
        return f"{self.source}: {'.'.join(self.path)}" if self.path else self.source

    def refuse(self, message: str) -> InputError:
        """An InputError whose message starts with source and key."""
        return InputError(f"{self}: {message}")

    def must_be(self, value: Any, allowed: str) -> InputError:
        """The InputError of a value that is not what is allowed."""
        return self.refuse(f"{shown(value)} is not allowed; it must be {allowed}")

    def unused(self, value: Any, owner: str) -> InputError:
        """The InputError of a value that is given in vain."""
        return self.refuse(f"{shown(value)} is not allowed; {owner} does not use it, leave it out")

    @contextmanager
    def named(self) -> Iterator[None]:
        """Let what is refused meanwhile begin with this place."""
        try:
            yield
        except InputError as error:
            raise self.refuse(str(error)) from None


def shown(value: Any) -> str:
    """A short printable form of a refused value."""
    plain = isinstance(value, (str, list, dict, set, tuple))
    text = _SHORT.repr(value) if plain else " ".join(str(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


class Kind:
    """What all kinds of values offer: each says what it allows and reads it."""

    def allowed(self) -> str:
        """What is allowed, to follow "it must be"."""
        raise NotImplementedError

    def convert(self, value: Any) -> Any:
        """The value of a file as it is used, None where it is not allowed."""
        return None

    def read(self, value: Any, at: Place, model: str = "") -> Any:
        """The value of a file, converted; `model`: that of the file. Raises InputError."""
        result = self.convert(value)
        if result is None:
            raise at.must_be(value, self.allowed())
        return result


@dataclass(frozen=True)
class Number(Kind):
    """A finite number in a range whose ends are excluded unless they are allowed."""

    low: float = -math.inf
    high: float = math.inf
    low_allowed: bool = False
    high_allowed: bool = False
    bounds: tuple[float, float] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        low = math.nextafter(self.low, -math.inf) if self.low_allowed else self.low
        high = math.nextafter(self.high, math.inf) if self.high_allowed else self.high
        object.__setattr__(self, "bounds", (low, high))  # both excluded

    def _holds(self, value: Any) -> Any:
        low, high = self.bounds
        return (value > low) & (value < high)

    def admits(self, value: Any) -> bool:
        """True if a number, or every entry of an array, is in the range.

        Symbols, dual numbers, complex steps and more digits are taken on trust.
        """
        if isinstance(value, np.ndarray):
            return value.dtype.kind not in "biuf" or bool(self._holds(value).all())
        if not isinstance(value, _PLAIN) or isinstance(value, bool):
            return not isinstance(value, _NO_NUMBERS)
        try:
            return bool(self._holds(float(value)))
        except OverflowError:  # a whole number may be finite and yet too great for a float
            return False

    def check(self, value: Any, at: Place) -> None:
        """Refuse what is not admitted; of an array the first such entry. Raises InputError."""
        if self.admits(value):
            return
        if isinstance(value, np.ndarray):
            first = tuple(int(i) for i in np.argwhere(~self._holds(value))[0])
            at, value = at / f"entry {', '.join(map(str, first))}", value[first]
        raise at.must_be(value, self.allowed())

    def allowed(self) -> str:
        return f"a finite number{self.range()}"

    def range(self) -> str:
        """The range in words, to follow "number"; empty where there is none."""
        low = f"{'of at least' if self.low_allowed else 'above'} {self.low:.6g}"
        if self.bounds == (-math.inf, math.inf):
            return ""
        if self.high == math.inf:
            return f" {low}"
        if self.high_allowed:
            return f" {low} and at most {self.high:.6g}"
        return f" between {self.low:.6g} and {self.high:.6g}, both excluded"

    def convert(self, value: Any) -> float | None:
        return float(value) if isinstance(value, _PLAIN) and self.admits(value) else None


NOT_NEGATIVE = Number(low=0.0, low_allowed=True)


@dataclass(frozen=True)
class Angle(Number):
    """An angle: a number of radians, in a file also a multiple of pi such as 0.75*pi or pi/2."""

    def convert(self, value: Any) -> float | None:
        match = _ANGLE.fullmatch(value) if isinstance(value, str) else None
        if match is None:
            return super().convert(value)
        sign, factor, divisor = match.groups()
        if divisor is not None and float(divisor) == 0.0:
            return None
        size = float(factor or 1) * math.pi / float(divisor or 1)
        return super().convert(-size if sign == "-" else size)

    def allowed(self) -> str:
        return f"{super().allowed()} (radians) or a multiple of pi such as 0.75*pi"


def warn_of_degrees(value: Any, at: Place) -> None:
    """Warn of an angle beyond a full turn that is not written as a multiple of pi."""
    if isinstance(value, int | float) and abs(value) > 2 * math.pi:
        words = f"{at}: {value:g} rad is more than a full turn; if degrees are meant, write "
        warnings.warn(f"{words}{value / 180:.6g}*pi", InputWarning, stacklevel=2)


@dataclass(frozen=True)
class Whole(Kind):
    """A whole number from low to high."""

    low: int
    high: int

    def allowed(self) -> str:
        return f"a whole number from {self.low} to {self.high}"

    def convert(self, value: Any) -> int | None:
        whole = isinstance(value, Integral) and not isinstance(value, bool)
        return int(value) if whole and self.low <= int(value) <= self.high else None


@dataclass(frozen=True)
class Word(Kind):
    """One of a few words."""

    choices: tuple[str, ...]

    def allowed(self) -> str:
        return f"one of {', '.join(self.choices)}"

    def convert(self, value: Any) -> str | None:
        if value == [None]:  # what YAML makes of a minus sign by itself
            value = "-"
        return value if isinstance(value, str) and value in self.choices else None


@dataclass(frozen=True)
class Words(Word):
    """Some of a few words, in the order of the choices, each once."""

    def allowed(self) -> str:
        return f"a list of {', '.join(self.choices)}"

    def read(self, value: Any, at: Place, model: str = "") -> tuple[str, ...]:
        if not isinstance(value, list | tuple):
            raise at.must_be(value, self.allowed())
        given = [Word(self.choices).read(entry, at) for entry in value]
        return tuple(name for name in self.choices if name in given)


@dataclass(frozen=True)
class Instance(Kind):
    """An object of a class, or of one of several; `named` says which."""

    kind: type | tuple[type, ...]
    named: str

    def allowed(self) -> str:
        return self.named

    def read(self, value: Any, at: Place, model: str = "") -> Any:
        if not isinstance(value, self.kind):
            raise at.must_be(value, self.named)
        return value


TEXT = Instance(str, "text")
FLAG = Instance(bool, "true or false")
FILE = Instance((str, os.PathLike), "the path of a file")


class Name(Kind):
    """A name: letters, digits and underscores, no digit first."""

    def allowed(self) -> str:
        return "a name of letters, digits and underscores"

    def convert(self, value: Any) -> str | None:
        return value if isinstance(value, str) and _NAME.fullmatch(value) else None


class Numbers(Kind):
    """A mapping of names to finite numbers."""

    def allowed(self) -> str:
        return "a mapping of names to finite numbers"

    def read(self, value: Any, at: Place, model: str = "") -> dict[str, float]:
        if not isinstance(value, dict):
            raise at.must_be(value, self.allowed())
        return {Name().read(name, at): Number().read(v, at / name) for name, v in value.items()}


@dataclass(frozen=True)
class Row(Kind):
    """A list of so many numbers."""

    count: int
    each: Number = Number()

    def allowed(self) -> str:
        return f"a list of {self.count} finite numbers{self.each.range()}"

    def convert(self, value: Any) -> tuple[float, ...] | None:
        if not isinstance(value, list | tuple) or len(value) != self.count:
            return None
        entries = tuple(self.each.convert(entry) for entry in value)
        return None if None in entries else entries  # type: ignore[return-value]


@dataclass(frozen=True)
class Square(Kind):
    """A square matrix, a list of rows: of `count` rows like the matrix `like`, or of any number."""

    count: int | None = None
    like: str = ""
    most: int = 100

    def allowed(self) -> str:
        size = f"{self.count} x {self.count}" if self.count else "n x n"
        like = f" like {self.like}" if self.like else ""
        return f"a square matrix of finite numbers, a list of rows, {size}{like}"

    def read(self, value: Any, at: Place, model: str = "") -> tuple[tuple[float, ...], ...]:
        if not isinstance(value, list | tuple) or not value or len(value) > self.most:
            raise at.must_be(value, f"{self.allowed()} with at most {self.most} rows")
        count = self.count or len(value)
        if len(value) != count:
            raise at.refuse(f"{len(value)} rows are not allowed; it must be {self.allowed()}")
        rows = {f"row {i}": row for i, row in enumerate(value, 1)}
        for name, row in rows.items():
            if not isinstance(row, list | tuple) or len(row) != count:
                words = f"{name}, {shown(row)}, is not allowed"
                raise at.refuse(f"{words}; it must be {self.allowed()}")
        return tuple(tuple(Number().read(v, at / n) for v in row) for n, row in rows.items())


@dataclass(frozen=True)
class Several(Kind):
    """A sequence, also one that can be gone through once only: of `count`, or of one at least."""

    each: Kind
    named: str
    count: int = 0

    def allowed(self) -> str:
        return self.named

    def read(self, value: Any, at: Place, model: str = "") -> tuple[Any, ...]:
        try:
            entries = () if isinstance(value, str) else tuple(value)
        except TypeError:
            entries = ()
        if not entries or (self.count and len(entries) != self.count):
            raise at.must_be(value, self.named)
        return tuple(self.each.read(one, at) for one in entries)


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
