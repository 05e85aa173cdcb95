"""Captions of figures and tables: constants beside what draws or writes them.

A module holds `CAPTION`, or `CAPTIONS` by the figure's name if it draws several; LaTeX, in which
\\val{key} stands for a number of a result.
"""

import pkgutil
import re
from importlib import import_module
from pathlib import Path
from types import ModuleType

from squeal.article.contents import FIGURES
from squeal.article.report.plain import plain
from squeal.article.report.values import filled, read


def modules(package: str) -> dict[str, ModuleType]:
    """The modules of a package by name."""
    path = import_module(package).__path__
    names = [m.name for m in pkgutil.iter_modules(path) if m.name[0] != "_"]
    return {name: import_module(f"{package}.{name}") for name in names}


def captions() -> dict[str, str]:
    """Captions by the name of the figure's or table's file, figures first."""
    drawing = modules("squeal.article.figures")
    texts: dict[str, str] = {}
    for name, figure in FIGURES.items():
        module = drawing[figure.module]
        several = getattr(module, "CAPTIONS", {})
        texts[name] = several.get(name, getattr(module, "CAPTION", ""))
    for name, module in modules("squeal.article.report.tables").items():
        if name in texts:
            raise ValueError(f"{name}: a figure and a table; each needs a name of its own")
        texts[name] = module.CAPTION
    return texts


def captions_shown(results: Path) -> dict[str, str]:
    """All captions without LaTeX's marks, their numbers from the folder of a build."""
    known = read(sorted(results.glob("*.json")))
    return {name: plain(filled(text, known)) for name, text in captions().items()}


_VALUED = re.compile(
    r",?\s*(?:\b(?:at|of|with|under|over)\s+)?(?:\$[^$]*\$)?\\val(?:\[\w*\])?\{[^}]*\}(?:\s+[a-z]+$)?"
)


def title(caption: str) -> str:
    """The first sentence of a caption without marks, and without phrases that hold numbers."""
    first = re.split(r"\.(?:\s|$)", caption.replace("Fig.~", "Fig~"), maxsplit=1)[0]
    return " ".join(plain(_VALUED.sub("", first)).split()).rstrip(".:, ")
