"""Keys and values of files and records: one table that reads, checks and documents both.

A kind says what a value may be, for a file (`read`) and a record in Python alike, so both refuse
with the same sentence. YAML is read as version 1.2 writes it: UTF-8, numbers such as 1e6, no key
twice. Our own, not pydantic's or msgspec's: a line of the table also holds unit, models and the
words of a refusal, serves arrays and dual numbers, and loads in no time.
"""

from __future__ import annotations

import inspect
import math
import os
import re
import reprlib
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from numbers import Integral
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np
import yaml

from squeal.errors import InputError, InputWarning

MOST = 100_000  # values that aliases may make of a file, if it is shorter than that
_TAG = "tag:yaml.org,2002:"

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
    """What all kinds of values offer: each says what it allows (`named`) and reads it."""

    named = ""

    def allowed(self) -> str:
        """What is allowed, to follow "it must be"."""
        return self.named

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
    named: str = ""

    def read(self, value: Any, at: Place, model: str = "") -> Any:
        if not isinstance(value, self.kind):
            raise at.must_be(value, self.named)
        return value


TEXT = Instance(str, "text")
FLAG = Instance(bool, "true or false")
FILE = Instance((str, os.PathLike), "the path of a file")


class Name(Kind):
    """A name: letters, digits and underscores, no digit first."""

    named = "a name of letters, digits and underscores"

    def convert(self, value: Any) -> str | None:
        return value if isinstance(value, str) and _NAME.fullmatch(value) else None


class Numbers(Kind):
    """A mapping of names to finite numbers."""

    named = "a mapping of names to finite numbers"

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
    named: str = ""
    count: int = 0

    def read(self, value: Any, at: Place, model: str = "") -> tuple[Any, ...]:
        try:
            entries = () if isinstance(value, str) else tuple(value)
        except TypeError:
            entries = ()
        if not entries or (self.count and len(entries) != self.count):
            raise at.must_be(value, self.named)
        return tuple(self.each.read(one, at / str(i)) for i, one in enumerate(entries, 1))


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


# fmt: off
_SCALARS: tuple[tuple[str, str, str, Callable[[str], Any]], ...] = (
    ("bool", "true|True|TRUE|false|False|FALSE", "tTfF", lambda text: text.lower() == "true"),
    ("null", "~|null|Null|NULL|", "~nN", lambda _: None),
    # a very long whole number is out of every range, and int() refuses it
    ("int", "[-+]?[0-9]+", "-+0123456789", lambda text: (int if len(text) < 300 else float)(text)),
    ("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", "-+.0123456789", float),
    ("float", r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)", "-+.",
     lambda text: float(text.replace(".", ""))),
)
# fmt: on


class _Loader(yaml.SafeLoader):
    """Tags plain scalars as YAML 1.2 does: 1.0e6 is a number, `on` and 1:30 are not."""


_Loader.yaml_implicit_resolvers = {}
for _name, _pattern, _first, _ in _SCALARS:
    _starts = [*_first, *([""] if _name == "null" else [])]
    _Loader.add_implicit_resolver(_TAG + _name, re.compile(f"^(?:{_pattern})$"), _starts)


def _refused(problem: str, mark: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(None, None, problem, mark)


def _value(node: yaml.Node, left: Iterator[int]) -> Any:
    """The value of a node; `left` ends after as many as may be, also of aliases."""
    if next(left, None) is None:
        raise _refused("aliases make it too large", node.start_mark)
    if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
        return [_value(entry, left) for entry in node.value]
    if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
        mapping: dict[str, Any] = {}
        for key_node, entry in node.value:
            key = _value(key_node, left)
            if not isinstance(key, str):
                raise _refused(f"the key {shown(key)} is not a word", key_node.start_mark)
            if key in mapping:
                raise _refused(f"the key {key} stands there twice", key_node.start_mark)
            mapping[key] = _value(entry, left)
        return mapping
    if isinstance(node, yaml.ScalarNode):
        text = str(node.value)
        if node.tag in (_TAG + "str", "!"):
            return text
        for name, pattern, _, made in _SCALARS:
            if node.tag == _TAG + name and re.fullmatch(pattern, text):
                return made(text)
    raise _refused(f"{shown(node.value)} is no {node.tag.rpartition(':')[2]}", node.start_mark)


def _parsed(text: str) -> Any:
    """The value of YAML text. Raises yaml.YAMLError or ValueError."""
    try:
        node = yaml.compose(text, Loader=_Loader)
        if node is None:
            raise _refused("there is none", None)
        return _value(node, iter(range(max(len(text), MOST))))
    except RecursionError:
        raise _refused("nested too deeply", None) from None


def scalar(text: str) -> Any:
    """The value of a plain YAML scalar, such as the value of an option; the text itself if not."""
    try:
        return _parsed(text) if text.strip() else None
    except (yaml.YAMLError, ValueError):
        return text


def read_document(path: Path) -> dict[str, Any]:
    """The single mapping that a YAML file holds. Raises InputError for any other file."""
    at = Place(str(path))
    return parse_document(read_content(path, at), at)


def read_content(path: Path, at: Place) -> bytes:
    """All that a file holds. Raises InputError if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        words = f"cannot be read ({error.strerror}); the name of a readable file is allowed"
        raise at.refuse(words) from None


def parse_document(content: bytes, at: Place) -> dict[str, Any]:
    """The single mapping that YAML text holds; `at` tells messages where it is from.

    Raises InputError if it is not one UTF-8 YAML mapping.
    """
    try:
        document = _parsed(content.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise at.refuse(f"byte {error.start} is not UTF-8; only UTF-8 text is allowed") from None
    except (yaml.YAMLError, ValueError) as error:
        mark = getattr(error, "problem_mark", None)
        line = f"line {mark.line + 1}: " if mark else ""
        reason = getattr(error, "problem", None) or str(error).partition("\n")[0]
        raise at.refuse(f"{line}{reason}; exactly one YAML mapping is allowed") from None
    if not isinstance(document, dict):
        words = f"the content {shown(document)} is not allowed; it must be a mapping of keys to"
        raise at.refuse(f"{words} values")
    return document


def named_files(document: Any) -> Iterator[str]:
    """The files that a document, or a part of it, names as `file: NAME`."""
    entries = document.items() if isinstance(document, dict) else enumerate(document)
    for key, entry in entries:
        if key == "file" and isinstance(entry, str):
            yield entry
        elif isinstance(entry, dict | list):
            yield from named_files(entry)


@dataclass(frozen=True)
class Key:
    """One key: what it means and may be, and in `default` what stands for it if it is left out.

    `models` are the models that use it, all if it is empty; `required` tells whether those need it,
    which the key `unless` does away with; `needs` are the keys that must stand beside it.
    """

    meaning: str
    kind: Kind
    unit: str = ""
    required: bool = False
    default: str = ""
    models: tuple[str, ...] = ()
    unless: str = ""
    needs: tuple[str, ...] = ()

    def used_by(self, model: str) -> bool:
        """True if a model (or a file without one, "") uses the key."""
        return not model or not self.models or model in self.models

    def missing(self, at: Place, owner: str) -> Exception:
        """The InputError of a key that its owner needs and that is left out."""
        unit = f", {self.unit}" if self.unit not in ("", "1") else ""
        return at.refuse(f"missing; {owner} needs it ({self.meaning.partition(';')[0]}{unit})")


@dataclass(frozen=True)
class Group(Kind):
    """A mapping of known keys. `owner` needs them, the scene's model if it is empty.

    `only_one`: exactly one of the keys must be given; `short`: the key whose word may stand alone
    for a mapping of it.
    """

    keys: Mapping[str, Key]
    owner: str = ""
    only_one: bool = False
    short: str = ""

    def allowed(self) -> str:
        alone = f", or {self.keys[self.short].kind.allowed()}" if self.short else ""
        return f"a mapping{alone}"

    def mapping(self, value: Any) -> Any:
        """The mapping that a word alone stands for; any other value as it is."""
        return {self.short: value} if self.short and isinstance(value, str) else value

    def read(self, value: Any, at: Place, model: str = "") -> dict[str, Any]:
        """The values of the keys that are given, in the order of the table. Raises InputError."""
        value = self.mapping(value)
        if not isinstance(value, dict):
            raise at.must_be(value, self.allowed())
        for name in value:
            if name not in self.keys:
                raise (at / name).refuse(f"unknown key; allowed are {', '.join(self.keys)}")
        if self.only_one and len(value) != 1:
            each = " or ".join(f"{name} ({key.meaning})" for name, key in self.keys.items())
            raise at.refuse(f"it must hold one of {each}")
        values: dict[str, Any] = {}
        for name, key in self.keys.items():
            here = at / name
            if name not in value:
                if key.required and key.used_by(model) and key.unless not in value:
                    raise key.missing(here, self.owner or f"model {model}")
            elif not key.used_by(model):
                raise here.unused(value[name], f"model {model}")
            else:
                values[name] = key.kind.read(value[name], here, model)
        check_needs(self.keys, values, at)
        return values

    def find(self, name: str, at: Place) -> tuple[tuple[str, ...], Key]:
        """The keys that lead to a dotted name, or to a name wherever it stands, and the last Key.

        Raises InputError for an unknown name, listing all.
        """
        every = dict(self.paths())
        for keys, key in every.items():
            if name in (".".join(keys), keys[-1]):
                return keys, key
        raise at.refuse(f"unknown key; allowed are {', '.join(keys[-1] for keys in every)}")

    def paths(self, before: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Key]]:
        """Every key in the group and the groups in it, with the keys that lead to it."""
        for name, key in self.keys.items():
            yield (*before, name), key
            if isinstance(key.kind, Group):
                yield from key.kind.paths((*before, name))


def check_needs(keys: Mapping[str, Key], given: Mapping[str, Any], at: Place) -> None:
    """Refuse a key that is given without another one that it needs. Raises InputError."""
    for name, key in keys.items():
        for other in key.needs if given.get(name) is not None else ():
            if given.get(other) is None:
                raise keys[other].missing(at / other, name)
