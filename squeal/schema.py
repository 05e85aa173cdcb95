"""Keys and values of files and records: one table that reads, checks and documents both.

A kind says what a value may be, for a file (`read`) and a record in Python alike, so both refuse
with the same sentence. YAML is read as version 1.2 writes it: UTF-8, numbers such as 1e6, no key
twice. Our own, not pydantic's or msgspec's: a line of the table also holds unit, models and the
words of a refusal, serves arrays and dual numbers, and loads in no time.
"""

from __future__ import annotations

import math
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import copy_context
from dataclasses import dataclass
from functools import wraps
from inspect import signature
from keyword import iskeyword
from numbers import Integral
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
import yaml

from squeal.errors import InputError, InputWarning, suggestion, within_doubles
from squeal.numerics.differentiation import Formula
from squeal.numerics.threads import threads_of_a_verb

Value = Any
"""Whatever a file or a caller gives, and what it is converted to."""
MOST = 100_000  # values that a document may hold; more only in a file of more characters
_TAG = "tag:yaml.org,2002:"

NO_MATRICES = "; a matrix file is named in a system file, as M: {file: NAME}"
_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")  # a number as some countries write it
_PLAIN = (int, float, np.integer, np.floating)
_Function = TypeVar("_Function", bound=Callable[..., Any])
_CHECKED = (*_PLAIN, np.bool_, str, bytes, list, tuple, set, dict)


def _is_name(text: str) -> bool:
    """Whether formulas, which Python parses, can name a parameter so."""
    return text.isidentifier() and text.isascii() and not iskeyword(text)


class Place:
    """Where a value stands: a file or record and the dotted key in it, for messages."""

    def __init__(self, source: str, *path: str) -> None:
        self.source = source
        self.path = path

    def __truediv__(self, key: object) -> Place:
        word = str(key)
        return Place(self.source, *self.path, word if word.isprintable() else repr(word))

    def __str__(self) -> str:
        return f"{self.source}: {'.'.join(self.path)}" if self.path else self.source

    def refuse(self, message: str) -> InputError:
        """An InputError whose message starts with source and key."""
        return InputError(f"{self}: {message}")

    def must_be(self, value: Value, allowed: str) -> InputError:
        """The InputError of a value that is not what is allowed."""
        if isinstance(value, str) and _COMMA.fullmatch(value):
            allowed += f"; its decimals follow a point: {value.replace(',', '.')}"
        return self.refuse(f"{shown(value)} is not allowed; it must be {allowed}")

    def warn(self, words: str) -> None:
        """Warn of what stands here."""
        warnings.warn(f"{self}: {words}", InputWarning, stacklevel=3)

    @contextmanager
    def prefixing_errors(self) -> Iterator[None]:
        """A context in which the message of an InputError gets this place as its head.

        One that begins with the same source already keeps its message.
        """
        try:
            yield
        except InputError as error:
            if str(error).startswith(f"{self.source}: "):
                raise
            raise self.refuse(str(error)) from None


def shown(value: Value) -> str:
    """A short printable form of a refused value."""
    if isinstance(value, (str, list, dict, set, tuple)):
        text = repr(value)
    else:
        text = " ".join(str(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


def refuse_unit(value: object, at: Place) -> None:
    """Refuse a quantity of pint or astropy, of which NumPy would take the number without its unit.

    Raises InputError.
    """
    if hasattr(value, "to_value") or (hasattr(value, "magnitude") and hasattr(value, "units")):
        raise at.refuse(
            "a quantity with a unit is not allowed; it must be its number, in SI units or, of "
            "matrices, in units that fit together"
        )


class Kind:
    """What a value may be. `allowed` says it in words, which follow "it must be" in messages.

    `convert` gives a value of a file as it is used, None where it is not allowed.
    """

    convert: Callable[[Value], Value]

    def __init__(self, allowed: str = "", convert: Callable[[Value], Value] | None = None) -> None:
        self.allowed = allowed
        if convert is not None:
            self.convert = convert

    def read(self, value: Value, at: Place, model: str = "") -> Value:
        """The value of a file, converted; `model`: that of the file. Raises InputError."""
        refuse_unit(value, at)
        if getattr(value, "shape", None) == ():  # a scalar of NumPy
            value = value.item()
        result = self.convert(value)
        if result is None:
            raise at.must_be(value, self.allowed)
        return result


def instance(kind: type, allowed: str) -> Kind:
    """An object of a class; `allowed` as of `Kind`."""
    return Kind(allowed, lambda value: value if isinstance(value, kind) else None)


TEXT = instance(str, "text")
FLAG = instance(bool, "true or false")
NAME = Kind(
    "a name of letters, digits and underscores, and no keyword of Python such as lambda",
    lambda value: value if isinstance(value, str) and _is_name(value) else None,
)


class Number(Kind):
    """A finite number between two ends.

    low, high: the ends; low_allowed, high_allowed: whether the number may be an end itself; range:
    all that in words, as they follow "a finite number", empty without ends.
    """

    def __init__(
        self,
        low: float = -math.inf,
        high: float = sys.float_info.max,
        low_allowed: bool = False,
        high_allowed: bool = True,
    ) -> None:
        self.low = low
        self.high = high
        self.low_allowed = low_allowed
        self.high_allowed = high_allowed
        # of 0.0 and 1.0 the range reads " above 0 and at most 1"
        above = "of at least" if low_allowed else "above"
        self.range = f" {above} {low:.6g}" if low > -math.inf else ""
        if high < sys.float_info.max:
            self.range += f" and {'at most' if high_allowed else 'below'} {high:.6g}"
        super().__init__(f"a finite number{self.range}")

    def _holds(self, value: Value) -> Value:
        above = value >= self.low if self.low_allowed else value > self.low
        below = value <= self.high if self.high_allowed else value < self.high
        return above & below

    def check(self, value: Value, at: Place, name: str) -> None:
        """Refuse a number, or the first entry of an array, out of the range. Raises InputError.

        Symbols, dual numbers, complex steps and more digits are taken on trust.
        """
        refuse_unit(value, at / name)
        if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
            outside = np.argwhere(~self._holds(value))
            if len(outside):
                entry = tuple(outside[0])
                place = at / f"{name}.entry {', '.join(map(str, entry))}"
                raise place.must_be(value[entry], self.allowed)
        if isinstance(value, _CHECKED) and Number.convert(self, value) is None:
            raise (at / name).must_be(value, self.allowed)

    def convert(self, value: Value) -> float | None:
        if not isinstance(value, _PLAIN) or isinstance(value, bool):
            return None
        try:
            return float(value) if self._holds(float(value)) else None
        except OverflowError:  # a whole number may be finite and yet too great for a float
            return None


ANY = Number()
POSITIVE = Number(low=0.0)
NOT_NEGATIVE = Number(low=0.0, low_allowed=True)
Positive = Annotated[float, POSITIVE]


class Angle(Number):
    """An angle: a number of radians, in a file also a formula of pi such as 0.75*pi or pi/2."""

    def __init__(
        self,
        low: float = -math.inf,
        high: float = sys.float_info.max,
        high_allowed: bool = True,
    ) -> None:
        super().__init__(low, high, high_allowed=high_allowed)
        self.allowed += " (radians) or a multiple of pi such as 0.75*pi"

    def convert(self, value: Value) -> float | None:
        if isinstance(value, str):
            with suppress(InputError):
                return super().convert(Formula(value).value({"pi": math.pi}))
        return super().convert(value)


def warn_of_degrees(value: Value, at: Place) -> None:
    """Warn of an angle beyond a full turn that is not written as a multiple of pi."""
    if isinstance(value, int | float) and abs(value) > math.tau:
        words = f"{value:g} rad is more than a full turn; if degrees are meant, write "
        at.warn(f"{words}{value / 180:.6g}*pi")


class Whole(Kind):
    """A whole number from low to high."""

    def __init__(self, low: int, high: int) -> None:
        self.low = low
        self.high = high
        super().__init__(f"a whole number from {low} to {high}")

    def convert(self, value: Value) -> int | None:
        if not isinstance(value, Integral) or isinstance(value, bool):
            return None
        return int(value) if self.low <= int(value) <= self.high else None


class Word(Kind):
    """One of a few words."""

    def __init__(self, choices: tuple[str, ...]) -> None:
        self.choices = choices
        super().__init__(f"one of {', '.join(choices)}")

    def convert(self, value: Value) -> str | None:
        if isinstance(value, list) and value == [None]:  # what YAML makes of a minus sign by itself
            value = "-"
        return value if isinstance(value, str) and value in self.choices else None


class Several(Kind):
    """A sequence, or an iterator, of `count` entries of a kind, or of `least` at least."""

    def __init__(self, entry: Kind, allowed: str, count: int | None = None, least: int = 1) -> None:
        self.entry = entry
        self.count = count
        self.least = least
        super().__init__(allowed)

    def read(self, value: Value, at: Place, model: str = "") -> Value:
        refuse_unit(value, at)
        if isinstance(value, str | dict):
            raise at.must_be(value, self.allowed)
        try:
            entries = tuple(value)
        except TypeError:
            raise at.must_be(value, self.allowed) from None
        if len(entries) < self.least or self.count not in (None, len(entries)):
            raise at.must_be(value, self.allowed)
        return tuple(self.entry.read(one, at / str(i)) for i, one in enumerate(entries, 1))


def row(count: int, entry: Number = ANY) -> Several:
    """A list of so many numbers."""
    return Several(entry, f"a list of {count} finite numbers{entry.range}", count)


class Named(Several):
    """A mapping of names to values of one kind."""

    def read(self, value: Value, at: Place, model: str = "") -> Value:
        if not isinstance(value, Mapping):
            raise at.must_be(value, self.allowed)
        values = {}
        for name, entry in value.items():
            values[NAME.read(name, at)] = self.entry.read(entry, at / name)
        return values


class Square(Kind):
    """A square matrix, a list of rows: of `count` rows, or of any number up to `most`."""

    def __init__(self, count: int | None = None, most: int = 100) -> None:
        self.count = count
        self.most = most
        size = f"{count} x {count}" if count else f"n x n with at most {most} rows"
        super().__init__(f"a square matrix of finite numbers, a list of rows, {size}")

    def read(self, value: Value, at: Place, model: str = "") -> tuple[tuple[float, ...], ...]:
        is_array = isinstance(value, np.ndarray) and value.ndim > 0
        rows = value if is_array or isinstance(value, list | tuple) else ()
        if not 0 < len(rows) <= self.most or self.count not in (None, len(rows)):
            raise at.must_be(value, self.allowed)
        row_kind = row(len(rows))
        return tuple(row_kind.read(one, at / f"row {i}") for i, one in enumerate(rows, 1))


# the end of a tag, the texts that have it, and what makes the value of such a text
# fmt: off
_SCALARS: tuple[tuple[str, str, Callable[[str], Value]], ...] = (
    ("bool", "true|True|TRUE|false|False|FALSE", lambda text: text.lower() == "true"),
    ("null", "~|null|Null|NULL|", lambda _: None),
    # a very long whole number is out of every range, and int() refuses it
    ("int", "[-+]?[0-9]+", lambda text: (int if len(text) < 300 else float)(text)),
    ("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", float),
    ("float", r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)", lambda text: float(text.replace(".", ""))),
)
# fmt: on


class _Loader(yaml.BaseLoader):
    """Gives all scalars without quotes and tag the tag "plain": `_SCALARS` says what they are.

    YAML 1.2 is read so, in which `on` and 1:30 are texts.
    """


_Loader.add_implicit_resolver("plain", re.compile(""), None)


def _refused(problem: str, mark: yaml.Mark | None) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(None, None, problem, mark)


def _value(node: yaml.Node, budget: Iterator[int]) -> Value:
    """The value of a node of YAML. Raises yaml.YAMLError.

    budget: yields once for each value that may still be made. A small file may make a huge document
    by aliases, which is refused where the budget ends.
    """
    if next(budget, None) is None:
        raise _refused("aliases make it too large", node.start_mark)
    if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
        return [_value(entry, budget) for entry in node.value]
    if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
        return _mapping(node, budget)
    if isinstance(node, yaml.ScalarNode):
        text = str(node.value)
        for name, pattern, convert in _SCALARS:
            # a tag may also be written in the file, as in !!float 1
            if node.tag in ("plain", _TAG + name) and re.fullmatch(pattern, text):
                return convert(text)
        if node.tag in ("plain", _TAG + "str"):  # quoted text has the tag of texts
            return text
    raise _refused(f"{shown(node.value)} is no {node.tag.rpartition(':')[2]}", node.start_mark)


def _mapping(node: yaml.MappingNode, budget: Iterator[int]) -> dict[str, Value]:
    """The mapping of a node, whose keys are words and stand once. Raises yaml.YAMLError."""
    mapping: dict[str, Value] = {}
    for key_node, entry in node.value:
        key = _value(key_node, budget)
        if not isinstance(key, str):
            is_number = isinstance(key, (int, float))
            hint = "; decimals follow a point, as in 0.4" if is_number else ""
            raise _refused(f"the key {shown(key)} is not a word{hint}", key_node.start_mark)
        if key in mapping:
            raise _refused(f"the key {key} stands there twice", key_node.start_mark)
        mapping[key] = _value(entry, budget)
    return mapping


def _parsed(text: str) -> Value:
    """The value of YAML text. Raises yaml.YAMLError or ValueError."""
    try:
        node = yaml.compose(text, Loader=_Loader)
        if node is None:
            raise _refused("the file is empty", None)
        return _value(node, iter(range(max(len(text), MOST))))
    except RecursionError:
        raise _refused("nested too deeply", None) from None


def scalar(text: str) -> Value:
    """The value of a plain YAML scalar, such as the value of an option; the text itself if not."""
    try:
        return _parsed(text) if text.strip() else None
    except (yaml.YAMLError, ValueError):
        return text


class _Dumper(yaml.SafeDumper):
    """Quotes each text that `scalar` reads as something else: 08 and 1e5 may be names."""


_Dumper.add_representer(
    str,
    lambda dumper, text: dumper.represent_scalar(
        _TAG + "str", text, None if scalar(text) == text else "'"
    ),
)


def document_text(document: Mapping[str, Value]) -> str:
    """A mapping as YAML text that `parse_document` reads as the same mapping."""
    return yaml.dump(document, Dumper=_Dumper, sort_keys=False)


def read_document(path: Path | str) -> tuple[dict[str, Value], Place]:
    """The single mapping that a YAML file holds, and its place. Raises InputError."""
    if not isinstance(path, str | Path):
        raise Place("path").must_be(path, "the path of a file")
    at = Place(str(path))
    return parse_document(read_content(Path(path), at), at), at


def read_content(path: Path, at: Place) -> bytes:
    """All that a file holds. Raises InputError if it cannot be read."""
    try:
        # a pipe by name or a device may never end; a shell's own pipe, <(...), has no such place
        if not path.is_file() and os.path.exists(os.path.realpath(path)):
            raise OSError(0, "no plain file")
        return path.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "no such name"
        words = f"cannot be read ({reason}); the name of a readable file is allowed"
        raise at.refuse(words) from None


def parse_document(content: bytes, at: Place) -> dict[str, Value]:
    """The single mapping that YAML text holds; `at` tells messages where it is from.

    Raises InputError if it is not one UTF-8 YAML mapping.
    """
    try:
        document = _parsed(content.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise at.refuse(
            f"byte {error.start} is not UTF-8; only UTF-8 text is allowed{NO_MATRICES}"
        ) from None
    except (yaml.YAMLError, ValueError) as error:
        mark = getattr(error, "problem_mark", None)
        line = f"line {mark.line + 1}: " if mark else ""
        reason = getattr(error, "problem", None) or str(error).partition("\n")[0]
        # as files of matrices and of meshes begin
        hint = NO_MATRICES if content.startswith((b"%", b"*")) else ""
        raise at.refuse(f"{line}{reason}; exactly one YAML mapping is allowed{hint}") from None
    if not isinstance(document, dict):
        raise at.must_be(document, f"a mapping of keys to values{NO_MATRICES}")
    return document


@dataclass(frozen=True)
class Key:
    """One key: its meaning, the kind of its value, and the `default`, in words, if it is left out.

    `models` are the models that use it, all if it is empty. If it is `required`, these models need
    it, but for a mapping that has the key `unless` in its place. It is refused without the keys
    `needs`, and beside the key `instead`. `unless` and `instead` are "" where there is no such key.
    """

    meaning: str
    kind: Kind
    unit: str = ""
    required: bool = False
    default: str = ""
    models: tuple[str, ...] = ()
    unless: str = ""
    needs: tuple[str, ...] = ()
    instead: str = ""

    def is_used_by(self, model: str) -> bool:
        """Whether a model takes this key; every key is taken where there is no model ("")."""
        return not model or not self.models or model in self.models

    def missing(self, at: Place, owner: str) -> InputError:
        """The InputError of a key that its owner needs and that is left out."""
        unit = f", {self.unit}" if self.unit not in ("", "1") else ""
        return at.refuse(f"missing; {owner} needs it ({self.meaning.partition(';')[0]}{unit})")


class Group(Kind):
    """A mapping of known keys. `owner` needs them, the scene's model if it is empty.

    `only_one`: exactly one of the keys must be given; `short`: the key whose word may stand alone
    for a mapping of it.
    """

    def __init__(
        self, keys: Mapping[str, Key], owner: str = "", only_one: bool = False, short: str = ""
    ) -> None:
        self.keys = keys
        self.owner = owner
        self.only_one = only_one
        self.short = short
        super().__init__("a mapping" + (f", or {keys[short].kind.allowed}" if short else ""))

    def mapping(self, value: Value) -> Value:
        """The mapping that a word alone stands for; any other value as it is."""
        return {self.short: value} if self.short and isinstance(value, str) else value

    def read(self, value: Value, at: Place, model: str = "") -> dict[str, Value]:
        """The values of the keys that are given, in the order of the table.

        value: the mapping, or the word that may stand for it (`short`); at: its place, for
        messages; model: that of the scene, which does not use every key. Raises InputError.
        """
        entries = self.mapping(value)
        if not isinstance(entries, dict):
            raise at.must_be(entries, self.allowed)
        for name in entries:
            if name not in self.keys:
                raise (at / name).refuse(f"unknown key; {suggestion(name, self.keys)}")
        if self.only_one and len(entries) != 1:
            choices = " or ".join(f"{name} ({key.meaning})" for name, key in self.keys.items())
            raise at.refuse(f"it must hold one of {choices}")
        values: dict[str, Value] = {}
        for name, key in self.keys.items():
            here = at / name
            is_used = key.is_used_by(model)
            if name not in entries:
                if key.required and is_used and key.unless not in entries:
                    # a key that is given without another one is the better reason to refuse
                    check_needs(self.keys, entries, at)
                    raise key.missing(here, self.owner or f"model {model}")
                continue
            if not is_used:
                words = f"model {model} does not use it, leave it out"
                raise here.refuse(f"{shown(entries[name])} is not allowed; {words}")
            if key.instead in entries:
                raise here.refuse(f"is not allowed beside {key.instead}")
            values[name] = key.kind.read(entries[name], here, model)
        check_needs(self.keys, values, at)
        return values

    def find(self, name: str, at: Place, more: str = "") -> tuple[tuple[str, ...], Key]:
        """The keys that lead to a key, and its `Key`.

        name: the dotted keys, such as "parameters.mu", or the last of them alone. Raises InputError
        for an unknown name; `more` is added to its message.
        """
        key_at = dict(self._paths())
        for path, key in key_at.items():
            if name in (".".join(path), path[-1]):
                return path, key
        allowed = suggestion(name, [path[-1] for path in key_at])
        raise at.refuse(f"unknown key; {allowed}{more}")

    def _paths(self, before: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Key]]:
        """Every key in the group and the groups in it, with the keys that lead to it."""
        for name, key in self.keys.items():
            yield (*before, name), key
            if isinstance(key.kind, Group):
                yield from key.kind._paths((*before, name))


def check_needs(keys: Mapping[str, Key], entries: Mapping[str, Value], at: Place) -> None:
    """Refuse a key that is given without another one that it needs. Raises InputError."""
    for name, key in keys.items():
        if entries.get(name) is None:
            continue
        for other in key.needs:
            if entries.get(other) is None:
                raise keys[other].missing(at / other, name)


# kinds of value by the annotation of a parameter
_KINDS: dict[Any, Kind] = {
    Any: Kind("anything but None", lambda value: value), str: TEXT, bool: FLAG, float: ANY,
    int: Kind("a whole number", Whole(-sys.maxsize, sys.maxsize).convert),
    Callable: Kind("a function", lambda value: value if callable(value) else None),
}  # fmt: skip


def kind_of(hint: object) -> Kind:
    """The kind of value that an annotation of a parameter allows.

    ``Annotated[float, POSITIVE]`` names its kind itself; a ``Literal`` is one of words, not of
    numbers. ``X | None`` allows what X allows, since a default of None is not checked.
    """
    origin: Value = get_origin(hint) or hint  # list, of list[int]
    parts = get_args(hint)  # int, of list[int]
    if origin is Annotated:
        return parts[1]
    if origin is Literal:
        return Word(parts)
    if origin in _KINDS:
        return _KINDS[origin]
    if not parts:
        return instance(origin, f"an instance of {origin.__name__}")
    if origin in (Union, UnionType):
        return _common_kind(parts)
    if issubclass(origin, Mapping):
        entry = _common_kind(parts[1:])  # the keys are names
        return Named(entry, f"a mapping of names to values, each {entry.allowed}")
    entry = _common_kind(parts)
    if origin is tuple and Ellipsis not in parts:
        return Several(
            entry, f"a sequence of {len(parts)} values, each {entry.allowed}", len(parts)
        )
    return Several(entry, f"a sequence of some values, each {entry.allowed}")


def _common_kind(hints: tuple[Any, ...]) -> Kind:
    """The kind of the only type among some hints; of several types anything but None is allowed.

    None and ... (of tuples) among the hints are no types.
    """
    types = set(hints) - {NoneType, Ellipsis}
    return kind_of(types.pop()) if len(types) == 1 else _KINDS[Any]


def public(function: _Function) -> _Function:
    """Decorate a function of the interface: check its arguments, and turn overflows into errors.

    It raises InputError for arguments that are not as annotated, see `kind_of`, and
    ComputationError where numbers leave the range of doubles. The function computes with the
    threads of `threads_of_a_verb`.
    """
    declared = signature(function)
    parameters = declared.parameters
    hints = get_type_hints(function, include_extras=True)

    @wraps(function)
    def checked(*values: Value, **named: Value) -> Value:
        # refuse unknown names, check and convert the arguments, then call `function` with them
        for name in named.keys() - parameters.keys():
            raise TypeError(
                f"{function.__name__}: {name} is no argument; {suggestion(name, parameters)}"
            )
        call = declared.bind(*values, **named)
        for name, value in call.arguments.items():
            hint = hints.get(name, object)
            is_default = value is parameters[name].default  # which may be None whatever the hint
            if hint not in (Any, object) and not is_default:
                call.arguments[name] = kind_of(hint).read(value, Place(function.__name__, name))
        workers = call.arguments.get("workers") or 1
        with threads_of_a_verb(workers), within_doubles():
            # changes of context variables do not outlive the call
            return copy_context().run(function, *call.args, **call.kwargs)

    return checked  # type: ignore[return-value]
