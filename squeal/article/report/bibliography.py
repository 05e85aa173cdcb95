"""References in BibTeX: those that the report cites, and those behind a result."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import resources

from squeal import __version__
from squeal.io.provenance import NOT_INSTALLED, Provenance, version

ALWAYS = ("article", "squeal")
"""Keys of what every result rests on: the models and this program."""


@dataclass(frozen=True)
class Reference:
    """One entry: its key, its text in BibTeX, and the version that was used if it is a program."""

    key: str
    bibtex: str
    version: str | None = None


@cache
def entries() -> dict[str, str]:
    """The entries of references.bib by key, in the file's order."""
    text = (
        resources.files("squeal.article.report")
        .joinpath("references.bib")
        .read_text(encoding="utf-8")
    )
    matches = re.finditer(r"^@\w+\{(\w+),\n.*?^\}$", text, re.MULTILINE | re.DOTALL)
    return {entry[1]: entry[0] for entry in matches}


def reference(key: str, used: str | None = None) -> Reference:
    """The entry of a key, with the version that was used as its note. Raises KeyError."""
    text = entries()[key]
    if used is not None and key not in ALWAYS:
        text = text.removesuffix("\n}") + f",\n  note    = {{Version {used}}}\n}}"
    return Reference(key, text, used)


def installed() -> dict[str, str]:
    """Versions of the packages with an entry that are installed here, by name."""
    versions = {name: version(name) for name in entries() if name not in ALWAYS}
    return {name: number for name, number in versions.items() if number != NOT_INSTALLED}


def behind(results: Iterable[Provenance]) -> dict[str, str]:
    """Versions of the packages with an entry that some results were computed with, by name."""
    versions: dict[str, set[str]] = {}
    for made in results:
        for name in made.loaded:
            versions.setdefault(name, set()).add(made.versions[name])
    return {name: ", ".join(sorted(versions[name])) for name in entries() if name in versions}


def references(versions: dict[str, str]) -> list[Reference]:
    """What to cite for the packages of some versions: the article, this software, and those."""
    own = [reference("article"), reference("squeal", __version__)]
    return own + [reference(name, number) for name, number in versions.items()]
