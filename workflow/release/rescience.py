"""`python -m workflow.release.rescience > FILE`: the report's metadata as ReScience C asks for it.

Title, authors, article and abstract come from CITATION.cff and paper/report.tex, the numbers of the
abstract from a build (`make rescience`). What an editor fills in is left empty.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import yaml

from squeal.article.report.plain import plain
from squeal.article.report.source import ANNOUNCED, source
from squeal.article.report.values import filled, read
from workflow.release.codecheck import paper_title
from workflow.release.codemeta import party

ROOT = Path(__file__).resolve().parents[2]


def abstract(results: Path) -> str:
    """The abstract of the report without marks, its numbers from the results in a folder."""
    text = (ROOT / "paper" / "report.tex").read_text(encoding="utf-8")
    _, _, rest = text.partition(r"\begin{abstract}")
    body, _, _ = rest.partition(r"\end{abstract}")
    known = read(sorted(results.glob("*.json")))
    words = plain(filled(re.sub(r"\\noindent\b|(?<!\\)%.*", "", body), known))
    return " ".join(words.split())


def replicated(article: dict[str, Any]) -> list[dict[str, str]]:
    """The article that is replicated, cited from its entry of the citation file."""
    names = ", ".join(party(author)["name"] for author in article["authors"])
    cite = f"{names}: {article['title']}, {article['year']}"
    return [{"cite": cite}, {"bib": "article"}, {"url": ""}, {"doi": article.get("doi", "")}]


def metadata(results: Path) -> dict[str, Any]:
    """The fields by name. Raises KeyError where a result of the abstract is missing."""
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    places = [author.get("affiliation", "no affiliation") for author in citation["authors"]]
    numbers = {place: i for i, place in enumerate(dict.fromkeys(places), 1)}
    authors: list[dict[str, str]] = []
    for author, place in zip(citation["authors"], places, strict=True):
        corresponding = ",*" if not authors else ""  # the first one
        authors.append(
            {
                "name": party(author)["name"],
                "orcid": author.get("orcid", "").rsplit("/", 1)[-1],
                "email": author.get("email", ""),
                "affiliations": f"{numbers[place]}{corresponding}",
            }
        )
    return {
        "title": paper_title(),
        "authors": authors,
        "affiliations": [
            {"code": number, "name": place, "address": ""} for place, number in numbers.items()
        ],
        "keywords": ", ".join([*citation["keywords"], "python"]),
        "code": [
            {"url": citation.get("repository-code", ANNOUNCED)},
            {"doi": citation.get("doi", "")},
            {"swh": ""},
        ],
        "data": [{"url": ""}, {"doi": ""}],
        "replication": replicated(citation["references"][0]),
        "abstract": abstract(results),
        "bibliography": "references.bib",
        "type": "Replication",
        "domain": "Mechanical engineering",
        "language": "Python",
        "review": [{"url": ""}],
        "contributors": [
            {"name": "", "orcid": "", "role": role} for role in ("editor", "reviewer", "reviewer")
        ],
        "dates": [
            {"drafted": source(ROOT).date},
            *({kind: ""} for kind in ("received", "accepted", "published")),
        ],
        "article": [{"number": ""}, {"doi": ""}, {"url": ""}],
        "journal": [
            {"name": "ReScience C"},
            {"issn": "2430-3658"},
            {"volume": ""},
            {"issue": ""},
        ],
    }


def main() -> int:
    """Print the file; 1 where the build that it needs is missing."""
    try:
        found = metadata(ROOT / "results")
    except KeyError as error:
        print(f"rescience: {error}: missing in results/; make report first", file=sys.stderr)
        return 1
    print(yaml.safe_dump(found, sort_keys=False, allow_unicode=True, width=100), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
