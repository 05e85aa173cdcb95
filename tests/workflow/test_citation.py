"""One title everywhere, and citation files that agree with each other."""

import re
import tomllib

import yaml

import squeal
from squeal.article.report.bibliography import entries
from squeal.article.report.values import VAL_MACRO
from squeal.errors import EXTRAS, missing
from tests.conftest import ROOT
from workflow.release import codemeta, journal, rescience

CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = PYPROJECT["project"]
RECIPE = yaml.safe_load((ROOT / "workflow/release/recipe.yaml").read_text(encoding="utf-8"))
README = (ROOT / "README.md").read_text(encoding="utf-8")


def field(bibtex, name):
    """A field's value without its braces and line breaks, None if the entry has none."""
    found = re.search(rf"\b{name} *= \{{((?:[^{{}}]|\{{[^{{}}]*\}})*)\}}", bibtex)
    return found and re.sub(r"\s+", " ", re.sub(r"[{}\\]", "", found[1]))


def test_all_files_name_one_title_and_one_version():
    title = CITATION["title"]
    assert README.splitlines()[0] == f"# {title}"
    assert (squeal.__doc__ or "").splitlines()[0] == f"{title}."
    assert title.lower() == f"squeal: {PROJECT['description']}".lower()
    assert field(entries()["squeal"], "title") == title
    versions = {squeal.__version__, field(entries()["squeal"], "version"), CITATION["version"]}
    assert versions | {RECIPE["context"]["version"]} == {PROJECT["version"]}


def test_the_recipe_requires_what_the_package_does():
    needs = RECIPE["requirements"]
    python, *run = needs["run"]
    renamed = [re.sub("^matplotlib ", "matplotlib-base ", one) for one in PROJECT["dependencies"]]
    assert run == renamed
    assert python == "python >=${{ python_min }}"
    backend = [
        one.replace("flit_core", "flit-core") for one in PYPROJECT["build-system"]["requires"]
    ]
    assert needs["host"] == ["python ${{ python_min }}.*", *backend, "pip"]
    scripts = [f"{name} = {place}" for name, place in PROJECT["scripts"].items()]
    assert RECIPE["build"]["python"]["entry_points"] == scripts
    about = RECIPE["about"]
    assert (RECIPE["package"]["name"], about["license"]) == (PROJECT["name"], PROJECT["license"])
    assert (about["summary"], [about["license_file"]]) == (
        PROJECT["description"],
        PROJECT["license-files"],
    )


def test_a_missing_package_is_named_with_its_extra():
    for package, extra in EXTRAS.items():
        assert any(one.startswith(package) for one in PROJECT["optional-dependencies"][extra])
    assert "brake-squeal[matlab]" in missing(ModuleNotFoundError(name="h5py.sub"))
    assert missing(ModuleNotFoundError(name="other")) == "other"


def test_authors_are_those_of_the_citation_file():
    names = [codemeta.party(author)["name"] for author in CITATION["authors"]]
    assert [author["name"] for author in PROJECT["authors"]] == names
    assert field(entries()["squeal"], "author").split(" and ") == names
    assert (ROOT / "paper" / "paper.md").read_text(encoding="utf-8") == journal.text(), (
        "make metadata"
    )


def test_persons_are_named_in_full_and_share_their_affiliation():
    ada = {"given-names": "Ada", "name-particle": "van", "family-names": "Es", "affiliation": "TU"}
    ada["orcid"] = "https://orcid.org/0000-0002-1825-0097"
    found = journal.credits(
        {"authors": [ada, {"name": "Others"}, ada], "date-released": "2026-02-03"}
    )
    assert [author["affiliation"] for author in found["authors"]] == [1, 2, 1]
    assert found["affiliations"][0] == {"name": "TU", "index": 1}
    assert found["authors"][0]["orcid"] == "0000-0002-1825-0097"
    assert (found["authors"][2]["name"], found["date"]) == ("Ada van Es", "3 February 2026")
    assert codemeta.party(ada)["@id"] == ada["orcid"]


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


def test_the_metadata_of_a_replication_are_whole(monkeypatch, tmp_path):
    monkeypatch.setattr(rescience, "filled", lambda text, known: VAL_MACRO.sub("1", text))
    found = rescience.metadata(tmp_path)
    assert found["title"].startswith("[Re] ")
    assert len(found["abstract"].split()) > 100
    assert not re.search(r"[\\{}$]", found["abstract"])
    assert found["authors"][0]["affiliations"].endswith("*")
    assert CITATION["references"][0]["title"] in found["replication"][0]["cite"]
    assert found["journal"][0] == {"name": "ReScience C"}
    assert found["type"] == "Replication"
