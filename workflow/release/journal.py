"""paper/paper.md, for a software journal, with authors and date of CITATION.cff in its head.

`make metadata` writes the file anew; a test compares the two.
"""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Any

import yaml

from workflow.release.codemeta import party

ROOT = Path(__file__).resolve().parents[2]
PAPER = ROOT / "paper" / "paper.md"


def credits(citation: dict[str, Any]) -> dict[str, Any]:
    """Authors with the numbers of their affiliations, and these, as such a journal names them."""
    places = [author.get("affiliation", "no affiliation") for author in citation["authors"]]
    numbers = {place: i for i, place in enumerate(dict.fromkeys(places), 1)}
    authors = []
    for author, place in zip(citation["authors"], places, strict=True):
        shown = {"name": party(author)["name"], "affiliation": numbers[place]}
        if "orcid" in author:
            shown["orcid"] = author["orcid"].rsplit("/", 1)[-1]
        authors.append(shown)
    found: dict[str, Any] = {
        "authors": authors,
        "affiliations": [{"name": place, "index": i} for place, i in numbers.items()],
    }
    released = citation.get("date-released")  # none before the first release
    if released:
        found["date"] = datetime.date.fromisoformat(str(released)).strftime("%-d %B %Y")
    return found


def text() -> str:
    """The file's content."""
    _, head, body = PAPER.read_text(encoding="utf-8").split("---\n", 2)
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    found = yaml.safe_load(head) | credits(citation)
    return f"---\n{yaml.safe_dump(found, sort_keys=False, allow_unicode=True)}---\n{body}"


if __name__ == "__main__":
    print(text(), end="")
