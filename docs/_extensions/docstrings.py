"""The package's docstrings, which are plain text, made fit for reStructuredText."""

from __future__ import annotations

import importlib
import inspect
import re
from typing import Any

from sphinx.application import Sphinx

CODE = re.compile(r"(`+)([^`]+)\1")
FENCED = re.compile(r"^```(\w+)\n(.*?)\n```$", re.DOTALL | re.MULTILINE)


def fit(app: Sphinx, what: str, name: str, found: Any, options: Any, lines: list[str]) -> None:
    """Paragraphs as prose, blocks that are indented or fenced as code."""
    parts = FENCED.split("\n".join(lines))
    result = _prose(parts[0])
    for language, code, rest in zip(parts[1::3], parts[2::3], parts[3::3], strict=True):
        result += [f".. code-block:: {language}", "", *_indented(code), "", *_prose(rest)]
    lines[:] = result


def _indented(text: str) -> list[str]:
    return [f"   {line}" for line in text.split("\n")]


def _prose(text: str) -> list[str]:
    """Lines of a text without fenced blocks, a blank one after each paragraph."""
    result: list[str] = []
    for block in re.split(r"\n\s*\n", text.strip("\n")):
        if block.startswith("    "):
            result += ["::", "", *_indented(block), ""]
        else:
            result += [*_escaped(block).split("\n"), ""]
    return result


def _escaped(paragraph: str) -> str:
    """What stands between backticks as code or as a link; all other marks stand for themselves."""
    parts, place = [], 0
    for match in CODE.finditer(paragraph):
        parts.append(re.sub(r"([|*_\\])", r"\\\1", paragraph[place : match.start()]))
        words = " ".join(match[2].split())
        home = _home(words)
        parts.append(f":py:obj:`~{home}`" if home else f"``{words}``")
        place = match.end()
    return "".join(parts) + re.sub(r"([|*_\\])", r"\\\1", paragraph[place:])


def _home(name: str) -> str | None:
    """Where a module, class or function of the package is documented, None if it is none."""
    if not re.fullmatch(r"squeal(\.\w+)+", name):
        return None
    try:
        importlib.import_module(name)
    except ImportError:
        pass
    else:
        return name
    module, _, last = name.rpartition(".")
    try:
        found = getattr(importlib.import_module(module), last)
    except (ImportError, AttributeError):
        return None
    if inspect.isclass(found) or inspect.isfunction(found):
        return f"{found.__module__}.{found.__qualname__}"
    return None


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the hook."""
    app.connect("autodoc-process-docstring", fit)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
