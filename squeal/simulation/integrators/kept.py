"""Compiled code in files of its own, beside heyoka's cache.

Heyoka finds code in its cache by the code before optimisation, which it makes from the expressions
each time, and checks the whole cache first. To read what was made takes a fifth of that.
"""

import contextlib
import hashlib
import os
import pickle
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import heyoka as hy

from squeal.errors import InputError
from squeal.io.writing import write_whole

Machine = TypeVar("Machine")

PROCESSOR = Path("/proc/cpuinfo")
FOLDER, KIND = "squeal-compiled", ".pickle"
LIMIT = 2_000_000_000  # bytes in all


@cache
def _maker() -> str | None:
    """What makes and runs the code; None on systems that do not name what their processor can."""
    try:
        with PROCESSOR.open(encoding="utf-8", errors="replace") as file:
            able = next((line for line in file if line.startswith(("flags", "Features"))), None)
        built = os.stat(hy._core.__file__)
    except OSError:
        return None
    return able and f"{hy.__version__} {built.st_size} {built.st_mtime_ns} {able}"


def kept(
    expressions: Iterable[Any], options: tuple[Any, ...], make: Callable[[], Machine]
) -> Machine:
    """What `make` compiles from expressions with options, from its file if there is one.

    Nothing is kept where heyoka is told not to, see `heyoka.llvm_state.set_diskcache_enabled`, or
    knows no place for its cache, or where files cannot be written.
    """
    maker, place = _maker(), Path(hy.llvm_state.get_diskcache_path())
    if maker is None or place == Path() or not hy.llvm_state.get_diskcache_enabled():
        return make()
    key = repr((maker, options, [hash(expression) for expression in expressions]))
    folder = place / FOLDER
    file = folder / f"{hashlib.sha256(key.encode()).hexdigest()}{KIND}"
    with contextlib.suppress(OSError):
        found = file.read_bytes()
        if hashlib.sha256(found[32:]).digest() == found[:32]:
            return pickle.loads(found[32:])
    made = make()
    data = pickle.dumps(made)
    with contextlib.suppress(OSError, InputError):
        folder.mkdir(parents=True, exist_ok=True)
        _make_room(folder, LIMIT - len(data))
        whole = hashlib.sha256(data).digest() + data
        write_whole(file, lambda stream: stream.write(whole), binary=True)
    return made


def _make_room(folder: Path, most: int) -> None:
    """Remove the oldest files until the others have at most so many bytes."""
    files = sorted(folder.glob(f"*{KIND}"), key=os.path.getmtime)
    size = sum(map(os.path.getsize, files))
    while size > most and files:
        size -= files[0].stat().st_size
        files.pop(0).unlink()
