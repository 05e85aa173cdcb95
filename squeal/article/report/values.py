r"""Numbers in the text: \val[form]{study.key.key} is read from results/study.json.

A form says how a number is shown: "3" three significant digits (the default), "f2" two decimals,
"p1" a percentage with one, "n" a whole number. Text is shown as it stands. A number that moves
between repeats is followed by its least and greatest value, see `squeal.article.studies._spread`.
"""

import json
import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from squeal.article.report.latex import number_text, typeset, with_spread
from squeal.errors import InputError

VAL_MACRO = re.compile(r"\\val(?:\[(\w*)\])?\{([^{}]+)\}")


def entry_of(results: Mapping[str, Any], key: str) -> Any:
    """The entry of a result named by study and keys, or indices of lists, with dots between.

    None in a study that was left out. Raises KeyError.
    """
    study, *keys = key.split(".")
    if left_out(results.get(study)):
        return None
    entry: Any = results[study]
    for part in keys:
        if isinstance(entry, list) and part.isdigit() and int(part) < len(entry):
            entry = entry[int(part)]
        elif isinstance(entry, dict) and part in entry:
            entry = entry[part]
        else:
            raise KeyError(key)
    return entry


def ends(results: Mapping[str, Any], key: str) -> tuple[float, float] | None:
    """Least and greatest value of a number that moves between repeats, None of any other."""
    study, _, path = key.partition(".")
    result = results.get(study)
    if not isinstance(result, dict):
        return None
    for moved in result.get("spread", ()):
        if moved["key"] == path:
            return moved["low"], moved["high"]
    return None


def formatted_with_spread(results: Mapping[str, Any], key: str, form: str = "") -> str:
    """What stands for a key in a text, its spread included. Raises KeyError."""
    return with_spread(entry_of(results, key), ends(results, key), lambda v: formatted(v, form))


def left_out(result: Any) -> bool:
    """Whether a study had to be left out on this machine."""
    return isinstance(result, dict) and bool(result.get("left_out"))


def formatted(value: Any, form: str = "") -> str:
    """A number in math mode or text; a dash for None.

    form: see the head of this module.
    """
    if value is None:
        return "--"
    if isinstance(value, (str, bool)):
        return typeset(str(value))
    if isinstance(value, list):
        return ", ".join(formatted(entry, form) for entry in value)
    if isinstance(value, dict):
        raise InputError("a mapping is no value")
    if form == "n" or (not form and isinstance(value, int)):
        return f"${round(value)}$"
    if form.startswith("p"):
        return rf"${100 * value:.{int(form[1:] or 1)}f}$\,\%"
    if form.startswith("f"):
        return f"${value:.{int(form[1:])}f}$"
    if not math.isfinite(value):
        raise InputError("no finite number")
    digits = int(form or 3)
    text = f"{value:.{digits}g}"
    if 1e-3 <= abs(value) < 10.0**digits:  # no power of ten: zeros at the end count as digits
        text = f"{value:#.{digits}g}".rstrip(".")
    return f"${number_text(text)}$"


def read(files: Iterable[Path]) -> dict[str, Any]:
    """Results by name of the file."""
    return {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in files}


def definitions(texts: Mapping[str, str], results: Mapping[str, Any]) -> str:
    r"""Lines that define each \val of some texts (by name). Raises InputError naming the text."""
    lines = set()
    for name, text in texts.items():
        for form, key in VAL_MACRO.findall(text):
            try:
                shown = formatted_with_spread(results, key, form)
                lines.add(f"\\setval{{{key}}}{{{form}}}{{{shown}}}")
            except (KeyError, ValueError, InputError) as error:
                raise InputError(f"{name}: \\val[{form}]{{{key}}}: {error}") from None
    return "".join(f"{line}\n" for line in sorted(lines))


def filled(text: str, results: Mapping[str, Any]) -> str:
    r"""A text with its \val replaced."""
    return VAL_MACRO.sub(lambda m: formatted_with_spread(results, m[2], m[1] or ""), text)
