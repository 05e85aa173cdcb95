"""`python -m workflow.release.links FOLDER`: do links and searches of the site lead somewhere?

Links within the site need a file and, after a #, an element of that name; links to elsewhere need
https and a host, and are not followed. What is searched most has to stand in a title of its page,
which the search then shows first.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

SEARCHED = {
    "Abaqus": "files",
    "Ansys": "files",
    "Campbell": "rotor",
    "cluster": "cluster",
    "damping ratio": "terms",
    "install": "install",
    "JSON": "json",
    "limit cycle": "terms",
    "mode coupling": "terms",
    "Nastran": "files",
    "root locus": "modes",
    "ROSS": "rotor",
    "scikit-fem": "skfem",
    "stick-slip": "terms",
    "tolerances": "samples",
    "unstable": "modes",
}


class Page(HTMLParser):
    """What a page links to, and the names in it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.names: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note links and names."""
        for key, value in attrs:
            if value and key in ("href", "src") and tag != "base":
                self.links.add(value)
            elif value and key in ("id", "name"):
                self.names.add(value)


@cache
def read(path: Path) -> Page:
    """A page of the site."""
    return Page(path.read_text(encoding="utf-8"))


def wrong(folder: Path) -> Iterator[str]:
    """A line for each link that leads nowhere."""
    for path in sorted(folder.rglob("*.html")):
        if "_static" in path.parts:  # a template of the theme
            continue
        for link in sorted(read(path).links):
            parts = urlsplit(link)
            at = f"{path.relative_to(folder)}: {link}"
            if parts.scheme in ("data", "mailto"):
                continue
            if parts.scheme or parts.netloc:
                if parts.scheme != "https" or "." not in parts.netloc:
                    yield f"{at}: no https address"
                continue
            target = path if not parts.path else path.parent / unquote(parts.path)
            if target.is_dir():
                target /= "index.html"
            if not target.is_file():
                yield f"{at}: no such file"
                continue
            pages = target.suffix == ".html"
            if pages and unquote(parts.fragment) not in read(target).names | {""}:
                yield f"{at}: no such place in that page"


def not_found(folder: Path) -> Iterator[str]:
    """A line for each search whose words are in no title of the page that answers it."""
    text = (folder / "searchindex.js").read_text(encoding="utf-8")
    index = json.loads(text[text.index("(") + 1 : text.rindex(")")])
    for words, page in SEARCHED.items():
        number = index["docnames"].index(page)
        titles = (title for title, at in index["alltitles"].items() if number in dict(at))
        if not any(words.lower() in title.lower() for title in titles):
            yield f"search for {words!r}: in no title of {page}"


def main() -> int:
    """Print what is wrong; 1 if something is."""
    folder = Path(sys.argv[1])
    found = [*wrong(folder), *not_found(folder)]
    print("\n".join(found), end="\n" if found else "")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
