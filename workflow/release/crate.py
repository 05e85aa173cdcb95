"""`.venv/apart/bin/python workflow/release/crate.py FOLDER`: its ro-crate-metadata.json.

A Workflow Run RO-Crate: the Snakefile is the workflow, its run takes the scenes and gives results,
figures and report. Needs `rocrate` and nothing of this project; says the same for the same files.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from rocrate.model.contextentity import ContextEntity
from rocrate.rocrate import ROCrate

PROFILES = {
    "https://w3id.org/ro/wfrun/process/0.5": "Process Run Crate",
    "https://w3id.org/ro/wfrun/workflow/0.5": "Workflow Run Crate",
}
FORMATS = {
    ".pdf": "application/pdf",
    ".json": "application/json",
    ".csv": "text/csv",
    ".yaml": "application/yaml",
    ".txt": "text/plain",
    ".html": "text/html",
    ".tex": "application/x-tex",
}
CC_BY = "https://creativecommons.org/licenses/by/4.0/"
MIT = "https://spdx.org/licenses/MIT"
NAMES = {
    "paper/report.pdf": "The paper",
    "paper/supplement.pdf": "Its supplement",
}


def _entity(crate: ROCrate, key: str, kind: str, **properties: Any) -> ContextEntity:
    """A new entity of the crate, by its link or #name and its type."""
    described_by = {"@type": kind, **properties}
    return crate.add(ContextEntity(crate, key, properties=described_by))


def described(folder: Path) -> dict[str, Any]:
    """The metadata of an archive's folder, from its codemeta.json, its files and its results."""
    about = json.loads((folder / "codemeta.json").read_text(encoding="utf-8"))
    crate = ROCrate(version="1.1")  # what the workflow run profiles build upon
    mit = _entity(crate, MIT, "CreativeWork", name="MIT License", alternateName="MIT")
    cc_by = _entity(crate, CC_BY, "CreativeWork", name="CC BY 4.0", alternateName="CC-BY-4.0")
    names = ", ".join(author["name"] for author in about["author"])
    maker = _entity(crate, "#contributors", "Organization", name=names)
    _describe_root(crate, about, maker, [cc_by, mit])

    def add_file(path: Path, licence: ContextEntity) -> Any:
        place = path.relative_to(folder).as_posix()
        properties = {
            "name": NAMES.get(place, place),
            "license": {"@id": licence.id},
            "contentSize": str(path.stat().st_size),
            "encodingFormat": FORMATS.get(path.suffix, "application/octet-stream"),
        }
        return crate.add_file(path, dest_path=place, properties=properties)

    def files(*patterns: str) -> list[Path]:
        return sorted(path for pattern in patterns for path in folder.glob(pattern))

    workflow = crate.add_workflow(
        folder / "Snakefile", dest_path="Snakefile", main=True, lang="snakemake"
    )
    workflow["name"] = "From the scenes to the report"
    workflow["author"] = maker
    workflow["license"] = mit
    workflow["creator"] = maker
    scenes = [add_file(path, cc_by) for path in files("squeal/article/scenes/**/*.yaml")]
    made = files("results/*.json", "results/*.csv", "figures/*.pdf", "figures/*.txt")
    made += files("paper/generated/*.tex")
    made += files("paper/*.pdf")
    results = [add_file(path, cc_by) for path in made]
    for place in ("CITATION.cff", "codemeta.json", "codecheck.yml", "README.md", "LICENSE"):
        add_file(folder / place, mit)
    for place, name, licence in (
        ("squeal", "The package", mit),
        ("site", "The documentation", cc_by),
    ):
        about_it = {"name": name, "license": {"@id": licence.id}}
        crate.add_dataset(folder / place, dest_path=place, properties=about_it)
    for path in files("dist/*"):
        add_file(path, mit)
    workflow["softwareRequirements"] = _packages(crate, files("results/*.json"))
    run = crate.add_action(
        workflow,
        identifier="#build",
        object=scenes,
        result=results,
        properties={
            "name": "Build of the report",
            "description": "make report",
            "actionStatus": "http://schema.org/CompletedActionStatus",
        },
    )
    run["agent"] = maker
    return dict(crate.metadata.generate())


def _describe_root(
    crate: ROCrate, about: dict[str, Any], maker: ContextEntity, licences: list[ContextEntity]
) -> None:
    """Say of the whole crate what codemeta.json (`about`) says, and which profiles it meets."""
    publication = about["referencePublication"]
    article = _entity(crate, "#article", "ScholarlyArticle", name=publication["name"])
    article["datePublished"] = publication["datePublished"]
    profiles = []
    for link, name in PROFILES.items():
        version = link.rsplit("/", 1)[1]
        profiles.append(_entity(crate, link, "CreativeWork", name=name, version=version))
    root = crate.root_dataset
    root["name"] = about["name"]
    root["description"] = about["description"]
    root["datePublished"] = about["dateModified"]
    root["license"] = licences
    root["author"] = maker
    root["publisher"] = maker
    root["citation"] = article
    root["version"] = about["version"]
    root["keywords"] = ", ".join(about["keywords"])
    root["conformsTo"] = profiles


def _packages(crate: ROCrate, results: list[Path]) -> list[ContextEntity]:
    """The packages with which results were computed, each a new entity with its version."""
    versions: dict[str, str] = {}
    for path in results:
        versions |= json.loads(path.read_text(encoding="utf-8"))["provenance"]["versions"]
    packages = []
    for name, number in sorted(versions.items()):
        properties = {"name": name, "softwareVersion": number}
        packages.append(_entity(crate, f"#{name}", "SoftwareApplication", **properties))
    return packages


if __name__ == "__main__":
    place = Path(sys.argv[1])
    text = json.dumps(described(place), indent=1, ensure_ascii=False, sort_keys=True) + "\n"
    (place / "ro-crate-metadata.json").write_text(text, encoding="utf-8")
