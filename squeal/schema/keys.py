"""Documents and their keys: a YAML mapping from a file, and the keys that it may have as a table.

YAML is read as version 1.2 writes it: UTF-8, numbers such as 1e6, no key twice. The table has one
record a key, from which files are read and documented.
"""

import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from squeal.schema.values import Kind, Place, shown

MOST = 100_000  # values that aliases may make of a file, if it is shorter than that
_TAG = "tag:yaml.org,2002:"

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
                raise (at / name).refuse(f"unknown key; allowed are {listed(self.keys)}")
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

    def find(
        self, name: str, at: Place, allowed: Iterable[str] = ()
    ) -> tuple[tuple[str, ...], Key]:
        """The keys that lead to a dotted name, or to a name wherever it stands, and the last Key.

        Raises InputError for an unknown name, listing what is `allowed` or all names.
        """
        every = dict(self.paths())
        for keys, key in every.items():
            if name in (".".join(keys), keys[-1]):
                return keys, key
        names = [*allowed] or [keys[-1] for keys in every]
        raise at.refuse(f"unknown key; allowed are {listed(names)}")

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


def listed(names: Iterable[str]) -> str:
    """Names in a row, numbered ones (C0, C1, ...) as a range."""
    parts = []
    for stem, group in itertools.groupby(names, lambda name: name.rstrip("0123456789")):
        members = list(group)
        row = len(members) > 2 and members[0] != stem
        parts += [f"{members[0]} to {members[-1]}"] if row else members
    return ", ".join(parts)
