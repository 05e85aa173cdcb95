"""CITATION.cff and pyproject.toml in the terms of CodeMeta 3; all authors come from the former.

`python -m workflow.release.codemeta > codemeta.json` (`make metadata`) writes the file anew; a
test compares the two.
"""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parents[2]
KINDS = {
    "article": "ScholarlyArticle",
    "conference-paper": "ScholarlyArticle",
    "software": "SoftwareSourceCode",
}


def party(found: dict[str, str]) -> dict[str, str]:
    """A person or an entity of a citation file."""
    if "name" in found:
        return {"@type": "Organization", "name": found["name"]}
    given = found["given-names"]
    family = " ".join(found[key] for key in ("name-particle", "family-names") if key in found)
    person = {
        "@type": "Person",
        "name": f"{given} {family}",
        "givenName": given,
        "familyName": family,
    }
    if "orcid" in found:
        person["@id"] = found["orcid"]
    return person


def work(found: dict[str, Any]) -> dict[str, Any]:
    """A reference of a citation file."""
    entry = {
        "@type": KINDS[found["type"]],
        "name": found["title"],
        "author": [party(author) for author in found["authors"]],
        "datePublished": str(found["year"]),
    }
    if "doi" in found:
        entry["@id"] = f"https://doi.org/{found['doi']}"
    if "journal" in found:
        entry["isPartOf"] = {"@type": "Periodical", "name": found["journal"]}
    return entry


def codemeta(citation: dict[str, Any], project: dict[str, Any]) -> dict[str, Any]:
    """The CodeMeta record; `citation` is the citation file, `project` the table of pyproject."""
    article, *libraries = citation["references"]
    released = citation.get("date-released")  # none before the first release
    return {
        "@context": "https://w3id.org/codemeta/3.0",
        "@type": "SoftwareSourceCode",
        "name": citation["title"],
        "identifier": project["name"],
        "description": citation["abstract"],
        "author": [party(author) for author in citation["authors"]],
        "version": str(citation["version"]),
        **({"dateModified": str(released)} if released else {}),
        "license": f"https://spdx.org/licenses/{citation['license']}",
        "keywords": citation["keywords"],
        "programmingLanguage": {
            "@type": "ComputerLanguage",
            "name": "Python",
            "version": project["requires-python"],
        },
        "softwareRequirements": [
            re.split(r"[;\s<>=]", wanted)[0] for wanted in project["dependencies"]
        ],
        "referencePublication": work(article),
        "citation": [work(library) for library in libraries],
    }


def text() -> str:
    """The file's content, from the two files of this repository."""
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return json.dumps(codemeta(citation, project), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    print(text(), end="")
