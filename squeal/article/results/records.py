"""Frozen dataclasses to plain JSON values and back, by the types of their fields."""

import dataclasses
import inspect
import json
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Literal, Self, TypeVar, Union, dataclass_transform

from squeal.errors import InputError
from squeal.io.provenance import Provenance
from squeal.schema.place import Place, shown

T = TypeVar("T")


def to_dict(value: Any) -> Any:
    """A record as JSON writes it: dataclasses become mappings by field, tuples lists.

    A class that has a `to_dict` of its own says itself what it becomes.
    """
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if dataclasses.is_dataclass(value):
        return _fields_of(value)
    if isinstance(value, Mapping):
        return {key: to_dict(entry) for key, entry in value.items()}
    return [to_dict(entry) for entry in value] if isinstance(value, (tuple, list)) else value


def _fields_of(record: Any) -> dict[str, Any]:
    return {f.name: to_dict(getattr(record, f.name)) for f in dataclasses.fields(record)}


def from_dict(kind: type[T], value: Any, file: str = "result") -> T:
    """The record of a class that `to_dict` wrote.

    Raises InputError naming `file`, key and value where the value does not fit the class.
    """
    record: T = _from(kind, value, Place(file))
    return record


def read_json(kind: type[T], file: Path) -> T:
    """What a JSON file holds, as `from_dict` makes it. Raises InputError."""
    try:
        value = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: {error}; a JSON file written by squeal is allowed") from None
    return from_dict(kind, value, str(file))


def call(function: Callable[..., T], words: Sequence[str]) -> T:
    """What a function makes of some words, each as its parameter's annotation wants it.

    A class with a method `read` reads the file of that name; others, Path or str, take the word.
    Raises InputError where there are too many words or too few, or a file is refused.
    """
    signature = inspect.signature(function, eval_str=True)
    try:
        signature.bind(*words)
    except TypeError:
        wanted = ", ".join(signature.parameters) or "nothing"
        raise InputError(
            f"{len(words)} arguments are not allowed; it is made from {wanted}"
        ) from None
    kinds = [parameter.annotation for parameter in signature.parameters.values()]
    kinds += kinds[-1:] * (len(words) - len(kinds))
    given = zip(kinds, words, strict=False)
    return function(*(k.read(Path(w)) if hasattr(k, "read") else k(w) for k, w in given))


_hints = cache(typing.get_type_hints)
_names: Callable[[Any], frozenset[str]] = cache(
    lambda kind: frozenset(f.name for f in dataclasses.fields(kind))
)


def _from(kind: Any, value: Any, at: Place) -> Any:
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if kind in (Any, object):
        return value
    if origin in (Union, types.UnionType):
        return _from(_choose(inner, value), value, at)
    if origin is Literal and value in inner:
        return value
    if kind is float and type(value) in (int, float):
        return float(value)
    if kind in (int, str, bool, type(None)) and type(value) is kind:
        return value
    if origin is tuple and isinstance(value, list):
        kinds = inner[:1] * len(value) if inner[1:] == (...,) else inner
        if len(kinds) == len(value):
            pairs = enumerate(zip(kinds, value, strict=True))
            return tuple(_from(k, entry, at / i) for i, (k, entry) in pairs)
    if origin in (dict, Mapping) and isinstance(value, dict):
        return {key: _from(inner[1], entry, at / key) for key, entry in value.items()}
    if isinstance(value, dict) and isinstance(kind, type):
        own = getattr(kind, "from_dict", None)
        if own and not issubclass(kind, Record):
            return own(value)
        if dataclasses.is_dataclass(kind):
            return _record(kind, value, at)
    raise at.refuse(f"{shown(value)} is not allowed; it must be {_word(kind)}")


def _word(kind: Any) -> str:
    return getattr(kind, "__name__", str(kind)) if typing.get_origin(kind) is None else str(kind)


def _choose(kinds: tuple[Any, ...], value: Any) -> Any:
    """The member of a union that a value belongs to; of several records the one with its keys."""
    if value is None and type(None) in kinds:
        return type(None)
    others = [kind for kind in kinds if kind is not type(None)]
    if isinstance(value, dict):
        fitting = [k for k in others if dataclasses.is_dataclass(k) and _names(k) == value.keys()]
        return (fitting or others)[0]
    return next((kind for kind in others if type(value) is kind), others[0])


def _record(kind: Any, value: dict[str, Any], at: Place) -> Any:
    optional = {f.name for f in dataclasses.fields(kind) if f.default is not dataclasses.MISSING}
    for key in sorted((value.keys() - _names(kind)) | (_names(kind) - optional - value.keys())):
        known = "unknown key" if key in value else "missing"
        raise (at / key).refuse(f"{known}; {_word(kind)} has {', '.join(sorted(_names(kind)))}")
    hints = _hints(kind)
    return kind(**{key: _from(hints[key], entry, at / key) for key, entry in value.items()})


@dataclass_transform(frozen_default=True)
class Record:
    """Its subclasses are frozen dataclasses that go to a JSON file and come back unchanged."""

    def __init_subclass__(cls, kw_only: bool = False) -> None:
        dataclasses.dataclass(frozen=True, kw_only=kw_only)(cls)

    @classmethod
    def of(cls, *sources: Any, **more: Any) -> Self:
        """A record of `more` and, of every other field, the first object's attribute so named."""
        for name in _names(cls) - more.keys():
            for source in sources:
                if (value := getattr(source, name, more)) is not more:  # none is that mapping
                    more[name] = value
                    break
        return cls(**more)

    def to_dict(self) -> dict[str, Any]:
        """Plain mappings, lists, numbers and text."""
        return _fields_of(self)

    @classmethod
    def from_dict(cls, value: dict[str, Any], file: str = "result") -> Self:
        """What `to_dict` gave. Raises InputError naming `file`, key and value."""
        return from_dict(cls, value, file)


class Missing(Record):
    """Stands where something does not exist, and says why."""

    reason: str


class Result(Record, kw_only=True):
    """All that a result file holds; the program that writes the file fills in what made it."""

    provenance: Provenance | None = None

    @property
    def wrong(self) -> str:
        """What came out wrong and must not pass unseen; empty where all is well."""
        return ""

    @classmethod
    def read(cls, file: Path) -> Self:
        """The result that a JSON file holds. Raises InputError where it is of another kind."""
        return read_json(cls, file)


class Plain(Result, kw_only=True):
    """A result that needs no class of its own: numbers and words by key, curves by name."""

    values: dict[str, float | int | str]
    curves: dict[str, tuple[float, ...]] = dataclasses.field(default_factory=dict)
