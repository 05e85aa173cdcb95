"""Where a value stands, and how a refusal of it is worded."""

from __future__ import annotations

import reprlib
from typing import Any

from squeal.errors import InputError

_SHORT = reprlib.Repr()  # aliases can make a short file mean a value of any size
_SHORT.maxstring = _SHORT.maxother = 200


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


def shown(value: Any) -> str:
    """A short printable form of a refused value."""
    plain = isinstance(value, (str, list, dict, set, tuple))
    text = _SHORT.repr(value) if plain else " ".join(str(value).split())
    return text if len(text) <= 60 else text[:57] + "..."
