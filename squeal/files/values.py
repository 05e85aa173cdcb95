"""Reading single values: numbers, angles, choices; each refusal says what is allowed."""

from __future__ import annotations

import math
import re
import reprlib
from typing import Any

from squeal.errors import InputError

_FACTOR = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_ANGLE = re.compile(rf"\s*([-+]?)\s*(?:({_FACTOR})\s*\*\s*)?pi\s*(?:/\s*({_FACTOR}))?\s*", re.ASCII)
_SHORT = reprlib.Repr()  # aliases can make a short file mean a value of any size
_SHORT.maxstring = _SHORT.maxother = 200


class Keys:
    """Where a value stands: file and dotted key, for messages."""

    def __init__(self, file: str, *path: str) -> None:
        self.file, self.path = file, path

    def __truediv__(self, key: object) -> Keys:
        word = str(key)
        return Keys(self.file, *self.path, word if word.isprintable() else repr(word))

    def refuse(self, message: str) -> InputError:
        """An InputError whose message starts with file and key."""
        where = f"{self.file}: {'.'.join(self.path)}" if self.path else self.file
        return InputError(f"{where}: {message}")


def shown(value: Any) -> str:
    """A short printable form of a refused value."""
    text = _SHORT.repr(value) if isinstance(value, (str, list, dict, set, tuple)) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."


def number(value: Any, at: Keys, allowed: str = "a finite number") -> float:
    """A finite float."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise at.refuse(f"{shown(value)} is not allowed; it must be {allowed}")
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise at.refuse(f"{shown(value)} is not allowed; it must be {allowed}")
    return result


def angle(value: Any, at: Keys, allowed: str = "a finite number") -> float:
    """An angle: a number of radians, or a multiple of pi such as "0.75*pi" or "pi/2"."""
    allowed = f"{allowed} (radians) or a multiple of pi such as 0.75*pi"
    if not isinstance(value, str):
        return number(value, at, allowed)
    match = _ANGLE.fullmatch(value)
    if not match:
        raise at.refuse(f"{shown(value)} is not allowed; it must be {allowed}")
    sign, factor, divisor = match.groups()
    if divisor is not None and float(divisor) == 0.0:
        raise at.refuse(f"{shown(value)} is not allowed; it must be {allowed}")
    result = float(factor or 1) * math.pi / float(divisor or 1)
    return number(-result if sign == "-" else result, at, allowed)


def mapping(value: Any, at: Keys, known: list[str]) -> dict[str, Any]:
    """A mapping all of whose keys are known."""
    if not isinstance(value, dict):
        raise at.refuse(f"{shown(value)} is not allowed; it must be a mapping")
    for key in value:
        if key not in known:
            raise (at / key).refuse(f"unknown key; allowed are {', '.join(known)}")
    return value


def choice(value: Any, at: Keys, choices: tuple[str, ...]) -> str:
    """One of a few words."""
    if not isinstance(value, str) or value not in choices:
        raise at.refuse(f"{shown(value)} is not allowed; it must be one of {', '.join(choices)}")
    return value
