"""One title everywhere, and citation files that agree with each other."""

import re
import tomllib

import yaml

import squeal
from squeal.article.report.bibliography import entries
from tests.conftest import ROOT
from workflow.release import codemeta

CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def field(bibtex, name):
    """A field's value without its braces and line breaks, None if the entry has none."""
    found = re.search(rf"\b{name} *= \{{((?:[^{{}}]|\{{[^{{}}]*\}})*)\}}", bibtex)
    return found and re.sub(r"\s+", " ", re.sub(r"[{}\\]", "", found[1]))


def test_one_title_and_one_version():
    title = CITATION["title"]
    assert CITATION["preferred-citation"]["title"] == title
    assert README.splitlines()[0] == f"# {title}"
    assert (squeal.__doc__ or "").splitlines()[0] == f"{title}."
    assert title.lower() == f"squeal: {PROJECT['description']}".lower()
    assert field(entries()["squeal"], "title") == title
    versions = [found["version"] for found in (CITATION, CITATION["preferred-citation"], PROJECT)]
    assert {squeal.__version__, field(entries()["squeal"], "version"), *versions} == {
        PROJECT["version"]
    }


def test_the_entry_in_the_readme_is_the_one_that_is_printed():
    assert re.search(r"```bibtex\n(.*?)\n```", README, re.S)[1] == entries()["squeal"]


def test_references_are_those_of_the_bibliography():
    doi = {field(text, "doi"): text for text in entries().values()}
    article, *libraries = CITATION["references"]
    assert article["title"] == field(entries()["article"], "title")
    for library in libraries:
        entry = doi[library["doi"]]
        assert field(entry, "title").lower() == library["title"].lower()
        assert field(entry, "year") == str(library["year"])


def test_codemeta_is_current():
    assert (ROOT / "codemeta.json").read_text(encoding="utf-8") == codemeta.text()


def test_licences_are_said():
    assert CITATION["license"] == PROJECT["license"] == "MIT"
    text = (ROOT / "LICENSES" / "CC-BY-4.0.txt").read_text(encoding="utf-8")
    assert text.startswith("Attribution 4.0 International")
    for place in ("README.md", "figures/README.md"):
        assert "CC BY 4.0" in (ROOT / place).read_text(encoding="utf-8"), place
