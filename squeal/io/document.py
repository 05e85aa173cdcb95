"""One YAML document from a file: UTF-8, no doubled keys, numbers as YAML 1.2 writes them."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from squeal.schema.place import Place, shown

DEEPEST = 50  # levels of brackets or indents; the loader takes long over many


class _Loader(yaml.SafeLoader):
    """Safe loader with the plain YAML 1.2 scalars: 1.0e6 is a number, `on` and 1:30 are not.

    It refuses what is nested too deeply as soon as it meets it.
    """

    def fetch_flow_collection_start(self, kind: Any) -> None:
        self._refuse_depth(self.flow_level)
        super().fetch_flow_collection_start(kind)

    def add_indent(self, column: int) -> Any:
        self._refuse_depth(len(self.indents))
        return super().add_indent(column)

    def _refuse_depth(self, depth: int) -> None:
        if depth >= DEEPEST:
            raise yaml.scanner.ScannerError(
                None, None, f"nested more than {DEEPEST} times", self.get_mark()
            )


_Loader.yaml_implicit_resolvers = {}
for _tag, _pattern, _first in (
    ("bool", r"true|True|TRUE|false|False|FALSE", "tTfF"),
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("int", r"[-+]?[0-9]+", "-+0123456789"),
    ("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", "-+.0123456789"),
    ("float", r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)", "-+."),
):
    _Loader.add_implicit_resolver(
        f"tag:yaml.org,2002:{_tag}", re.compile(rf"^(?:{_pattern})$"), list(_first)
    )


def _decimal(loader: _Loader, node: yaml.ScalarNode) -> float | int:
    text = str(node.value)
    # very long integers would be refused by int(); they are out of every range anyway
    return int(text) if len(text) < 300 else float(text)


def _mapping(loader: _Loader, node: yaml.MappingNode) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key_node, value_node in node.value:
        key = loader.construct_object(key_node, deep=True)
        if not isinstance(key, str):
            raise yaml.constructor.ConstructorError(
                None, None, f"the key {shown(key)} is not a word", key_node.start_mark
            )
        if key in result:
            raise yaml.constructor.ConstructorError(
                None, None, f"the key {key} stands there twice", key_node.start_mark
            )
        result[key] = loader.construct_object(value_node, deep=True)
    return result


_Loader.add_constructor("tag:yaml.org,2002:map", _mapping)
_Loader.add_constructor("tag:yaml.org,2002:int", _decimal)


def scalar(text: str) -> Any:
    """The value of a plain YAML scalar, such as the value of an option; the text itself if not."""
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.YAMLError:
        return text


def read_document(path: Path) -> dict[str, Any]:
    """The single mapping that a YAML file holds.

    Raises InputError if the file cannot be read or is not one UTF-8 YAML mapping.
    """
    at = Place(str(path))
    return parse_document(read_content(path, at), at)


def read_content(path: Path, at: Place) -> bytes:
    """All that a file holds. Raises InputError if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise at.refuse(
            f"cannot be read ({error.strerror}); the name of a readable file is allowed"
        ) from None


def parse_document(content: bytes, at: Place) -> dict[str, Any]:
    """The single mapping that YAML text holds; `at` tells messages where it is from.

    Raises InputError if it is not one UTF-8 YAML mapping.
    """
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise at.refuse(f"byte {error.start} is not UTF-8; only UTF-8 text is allowed") from None
    try:
        documents = list(yaml.load_all(text, Loader=_Loader))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = f"line {mark.line + 1}: " if mark else ""
        raise at.refuse(
            f"{line}{error.problem or error.context}; one YAML mapping is allowed"
        ) from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        reason = str(error).splitlines()[0] if str(error) else "nested too deeply"
        raise at.refuse(f"{reason}; one YAML mapping is allowed") from None
    if len(documents) != 1:
        raise at.refuse(f"{len(documents)} documents; exactly one is allowed")
    if not isinstance(documents[0], dict):
        raise at.refuse(
            f"the content {shown(documents[0])} is not allowed; it must be a mapping of keys to "
            "values"
        )
    return documents[0]


def named_files(said: Any) -> Iterator[str]:
    """The files that a document, or a part of it, names as `file: NAME`."""
    for key, entry in said.items() if isinstance(said, dict) else enumerate(said):
        if key == "file" and isinstance(entry, str):
            yield entry
        elif isinstance(entry, dict | list):
            yield from named_files(entry)


def with_named_files(path: Path) -> list[str]:
    """A document's file and those that it names, which lie beside it.

    Raises InputError if the document cannot be read.
    """
    beside = (str(path.parent / name) for name in named_files(read_document(path)))
    return list(dict.fromkeys([str(path), *beside]))
