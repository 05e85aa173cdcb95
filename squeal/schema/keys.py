"""The keys of a file as a table: one record a key, from which files are read and documented."""

import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from squeal.schema.values import Kind, Place


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

    def schema(self, model: str = "") -> dict[str, Any]:
        """An object that holds no other keys than those that the model uses."""
        used = {name: key for name, key in self.keys.items() if key.used_by(model)}
        described = {name: _described(key, model) for name, key in used.items()}
        needed = {name: key.unless for name, key in used.items() if key.required}
        always = [name for name, other in needed.items() if other not in used]
        either = [[name, other] for name, other in needed.items() if other in used]
        parts: dict[str, Any] = {
            "required": always,
            "allOf": [{"anyOf": [{"required": [name]} for name in pair]} for pair in either],
            "dependentRequired": {n: list(key.needs) for n, key in used.items() if key.needs},
        }
        form: dict[str, Any] = {"type": "object", "additionalProperties": False}
        form |= {"properties": described} | {word: part for word, part in parts.items() if part}
        if self.only_one:
            form |= {"minProperties": 1, "maxProperties": 1}
        return {"anyOf": [form, self.keys[self.short].kind.schema()]} if self.short else form


def check_needs(keys: Mapping[str, Key], given: Mapping[str, Any], at: Place) -> None:
    """Refuse a key that is given without another one that it needs. Raises InputError."""
    for name, key in keys.items():
        for other in key.needs if given.get(name) is not None else ():
            if given.get(other) is None:
                raise keys[other].missing(at / other, name)


def _described(key: Key, model: str) -> dict[str, Any]:
    kind = key.kind
    schema = kind.schema(model) if isinstance(kind, Group) else kind.schema()
    unit = f", {key.unit}" if key.unit else ""
    return schema | {"description": f"{key.meaning}{unit}"}


def listed(names: Iterable[str]) -> str:
    """Names in a row, numbered ones (C0, C1, ...) as a range."""
    parts = []
    for stem, group in itertools.groupby(names, lambda name: name.rstrip("0123456789")):
        members = list(group)
        row = len(members) > 2 and members[0] != stem
        parts += [f"{members[0]} to {members[-1]}"] if row else members
    return ", ".join(parts)
