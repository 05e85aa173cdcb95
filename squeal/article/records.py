"""Results: frozen dataclasses that go to JSON files and come back, by the types of their fields."""

import dataclasses
import inspect
import json
import math
import types
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from decimal import ROUND_CEILING, Decimal
from functools import cache
from pathlib import Path
from typing import Any, Literal, Self, TypeVar, Union, dataclass_transform

from squeal.errors import InputError
from squeal.io.provenance import Provenance
from squeal.schema import Place, shown

T = TypeVar("T")
_hints = cache(typing.get_type_hints)


def to_dict(value: Any) -> Any:
    """A record as JSON writes it: dataclasses become mappings by field, tuples lists."""
    if dataclasses.is_dataclass(value):
        method = getattr(value, "to_dict", None)
        return method() if method else _fields(value)
    if isinstance(value, Mapping):
        return {key: to_dict(entry) for key, entry in value.items()}
    if isinstance(value, (tuple, list)):
        return [to_dict(entry) for entry in value]
    return value


def _fields(record: Any) -> dict[str, Any]:
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
    """Call a function with words of a command line, each converted by the annotation of its
    parameter; the last parameter may take several. Returns what the function returns.

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
    kinds += kinds[-1:] * (len(words) - len(kinds))  # of each further word that of the last one
    arguments = []
    for kind, word in zip(kinds, words, strict=False):  # those with a default may be left out
        reads_file = hasattr(kind, "read")
        arguments.append(kind.read(Path(word)) if reads_file else kind(word))
    return function(*arguments)


def _from(kind: Any, value: Any, at: Place) -> Any:
    """A JSON value as a type wants it: a class, a union, a literal, a tuple or a dictionary.

    at: the place in the file that a message names. Raises InputError where it does not fit.
    """
    origin = typing.get_origin(kind)
    inner = typing.get_args(kind)  # members of a union or a tuple, values of a literal
    if kind is Any:
        return value
    if origin in (Union, types.UnionType):
        return _from(_member(inner, value), value, at)
    if origin is Literal and value in inner:
        return value
    if kind is float and type(value) in (int, float):
        return float(value)
    if kind in (int, str, bool, type(None)) and type(value) is kind:
        return value
    if origin is tuple and isinstance(value, list):
        # tuple[T, ...] holds any number of T, another one a kind for each entry
        kinds = inner[:1] * len(value) if inner[1:] == (...,) else inner
        if len(kinds) == len(value):
            pairs = enumerate(zip(kinds, value, strict=True))
            return tuple(_from(k, entry, at / i) for i, (k, entry) in pairs)
    if origin is dict and isinstance(value, dict):
        _, kind_of_entry = inner  # keys are text, as in every JSON file
        return {key: _from(kind_of_entry, entry, at / key) for key, entry in value.items()}
    if dataclasses.is_dataclass(kind) and isinstance(value, dict):
        # some classes that are no records, such as outlines, have a reader of their own
        if not issubclass(kind, Record) and hasattr(kind, "from_dict"):  # type: ignore[arg-type]
            try:
                return kind.from_dict(value)
            except (KeyError, TypeError, ValueError):
                raise at.must_be(value, "as squeal wrote it") from None
        return _record(kind, value, at)
    raise at.refuse(f"{shown(value)} is not allowed; it must be {getattr(kind, '__name__', kind)}")


def _member(kinds: tuple[Any, ...], value: Any) -> Any:
    """The member of a union that a value belongs to; of several records the one with its keys."""
    candidates: list[Any] = [kind for kind in kinds if type(value) is kind]
    if isinstance(value, dict):
        records: list[Any] = [kind for kind in kinds if dataclasses.is_dataclass(kind)]
        with_its_keys = [kind for kind in records if _hints(kind).keys() >= value.keys()]
        candidates = with_its_keys or records
    return (candidates or kinds)[0]  # any member refuses what is of none


def _record(kind: Any, value: dict[str, Any], at: Place) -> Any:
    """A record from its keys, of which none may be unknown and none without default missing."""
    fields = {field.name for field in dataclasses.fields(kind)}
    needed = {f.name for f in dataclasses.fields(kind) if f.default is dataclasses.MISSING}
    wrong = (value.keys() - fields) | (needed - value.keys())
    if wrong:
        key = min(wrong)
        fault = "unknown key" if key in value else "missing"
        raise (at / key).refuse(f"{fault}; {kind.__name__} has {', '.join(sorted(fields))}")
    hints = _hints(kind)
    return kind(**{key: _from(hints[key], entry, at / key) for key, entry in value.items()})


@dataclass_transform(frozen_default=True)
class Record:
    """A base of frozen dataclasses that go to a JSON file and come back unchanged."""

    def __init_subclass__(cls, kw_only: bool = False) -> None:
        dataclasses.dataclass(frozen=True, kw_only=kw_only)(cls)

    @classmethod
    def of(cls, *sources: Any, **more: Any) -> Self:
        """A record with the fields in `more`; every other field is the attribute of that name of
        the first of the objects that has one."""
        for name in {f.name for f in dataclasses.fields(cls)} - more.keys():  # type: ignore[arg-type]
            source = next((s for s in sources if hasattr(s, name)), None)
            if source is not None:
                more[name] = getattr(source, name)
        return cls(**more)

    def to_dict(self) -> dict[str, Any]:
        """Plain mappings, lists, numbers and text."""
        return _fields(self)


class Missing(Record):
    """Stands where something does not exist, and says why."""

    reason: str


def first_reason(entries: Iterable[Any]) -> str:
    """Why the first missing one of some entries is missing, empty where none is."""
    return next((entry.reason for entry in entries if isinstance(entry, Missing)), "")


class Moved(Record):
    """A number that moved when its motion was repeated, and its least and greatest value.

    key: the keys and places that lead to the number in the result, with dots between, see
    `squeal.article.studies._spread`.
    """

    key: str
    low: int | float
    high: int | float


class Result(Record, kw_only=True):
    """All that a result file holds; the program that writes the file fills in what made it."""

    provenance: Provenance | None = None
    spread: tuple[Moved, ...] = ()

    def ends(self, key: str) -> tuple[float, float] | None:
        """Least and greatest value of a number that moved, None for any other."""
        return next(((moved.low, moved.high) for moved in self.spread if moved.key == key), None)

    @property
    def wrong(self) -> str:
        """What came out wrong and must not pass unseen; empty where all is well."""
        return ""

    @classmethod
    def read(cls, file: Path) -> Self:
        """The result that a JSON file holds. Raises InputError where it is of another kind."""
        return read_json(cls, file)


def rounded_up(value: float, digits: int = 2) -> float:
    """The least number of so many significant digits that is not below the value."""
    if not math.isfinite(value) or value == 0.0:
        return value
    exact = Decimal(value)
    step = Decimal(1).scaleb(exact.adjusted() - digits + 1)
    return float(exact.quantize(step, ROUND_CEILING))


def bound(residual: float) -> str:
    """A power of ten as text ("1e-15"), at least twice a residual of rounding.

    Each processor has residuals of its own; what they stay below is the same, as a rule.
    """
    if residual == 0.0:
        return "1e-16"
    return f"1e{math.ceil(math.log10(2.0 * abs(residual)))}"
