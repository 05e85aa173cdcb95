"""Parts of a job, by their names."""

import re

from squeal.schema.place import Place


def cut(given: str, size: int) -> tuple[int, int]:
    """First unit and the one after the last of the part "3-of-8" of a job. Raises InputError."""
    match = re.fullmatch(r"([1-9]\d*)-of-([1-9]\d*)", given, re.ASCII)
    number, parts = map(int, match.groups()) if match else (1, 0)
    if not number <= parts <= size:
        raise Place("--part").must_be(given, f"such as 3-of-8, one of at most {size} parts")
    return (number - 1) * size // parts, number * size // parts
