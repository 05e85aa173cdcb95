"""One YAML document from a file: UTF-8, no doubled keys, numbers as YAML 1.2 writes them."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import yaml

from squeal.schema.values import Place, shown

DEEPEST = 50  # levels of brackets or indents
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
    """Tags plain scalars as YAML 1.2 does: 1.0e6 is a number, `on` and 1:30 are not.

    It refuses what is nested too deeply as soon as it meets it, and constructs nothing.
    """

    def fetch_flow_collection_start(self, kind: Any) -> None:
        self._refuse_depth(self.flow_level)
        super().fetch_flow_collection_start(kind)

    def add_indent(self, column: int) -> Any:
        self._refuse_depth(len(self.indents))
        return super().add_indent(column)

    def _refuse_depth(self, depth: int) -> None:
        if depth >= DEEPEST:
            raise _refused(f"nested more than {DEEPEST} times", self.get_mark())


_Loader.yaml_implicit_resolvers = {}
for _name, _pattern, _first, _ in _SCALARS:
    _starts = [*_first, *([""] if _name == "null" else [])]
    _Loader.add_implicit_resolver(_TAG + _name, re.compile(f"^(?:{_pattern})$"), _starts)


def _refused(problem: str, mark: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(None, None, problem, mark)


def _value(node: yaml.Node, left: Iterator[int], depth: int = 0) -> Any:
    """The value of a node; `left` ends after as many as may be, also of aliases."""
    if next(left, None) is None or depth > DEEPEST:
        raise _refused("aliases make it too large", node.start_mark)
    if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
        return [_value(entry, left, depth + 1) for entry in node.value]
    if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
        mapping: dict[str, Any] = {}
        for key_node, entry in node.value:
            key = _value(key_node, left, depth + 1)
            if not isinstance(key, str):
                raise _refused(f"the key {shown(key)} is not a word", key_node.start_mark)
            if key in mapping:
                raise _refused(f"the key {key} stands there twice", key_node.start_mark)
            mapping[key] = _value(entry, left, depth + 1)
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
    node = yaml.compose(text, Loader=_Loader)
    if node is None:
        raise _refused("there is none", None)
    return _value(node, iter(range(max(len(text), MOST))))


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
