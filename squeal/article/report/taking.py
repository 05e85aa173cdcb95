"""A figure, table or number of the report in a folder of its own, with all that belongs to it."""

import hashlib
import inspect
import json
import os
import re
import tempfile
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from squeal import __version__
from squeal.article.contents import FIGURES, RESULTS, figure_files, report_file, result_file
from squeal.article.records import call, from_dict
from squeal.article.report.bibliography import behind, references
from squeal.article.report.captions import captions, title
from squeal.article.report.plain import plain, table_rows
from squeal.article.report.values import entry_of, filled, formatted, read
from squeal.errors import InputError
from squeal.io.provenance import Provenance, digest, version
from squeal.io.writing import to_json, write_csv, write_text, write_whole

ORIGIN = "origin.json"
"""The file that marks a folder as one of ours."""
DRAWN_WITH = ("numpy", "matplotlib")
"""Packages that a figure is drawn with."""
_LICENCE = """\
This {kind} and its data are under CC BY 4.0, Creative Commons Attribution 4.0 International,
https://creativecommons.org/licenses/by/4.0/: use and change them, name their source, and say what
was changed. Source: squeal contributors, squeal {version}; references.bib holds it in BibTeX.
"""


@dataclass(frozen=True)
class Taken:
    """What was written: the folder and its files, paths relative to it."""

    name: str
    folder: str
    files: tuple[str, ...]


@dataclass(frozen=True)
class Origin:
    """Where a figure, table or number comes from.

    command: makes it in a clone; reads: the files that it was made from, in the build; module: of
    this package, whose sources' digest is printed.
    """

    name: str
    command: str
    reads: tuple[Path, ...]
    module: str

    def made(self) -> list[Provenance]:
        """What made each result among the files."""
        records = []
        for file in self.reads:
            if file.suffix == ".json":
                made = json.loads(file.read_text(encoding="utf-8")).get("provenance")
                if made:
                    records.append(from_dict(Provenance, made))
        return records

    def to_dict(self) -> dict[str, Any]:
        """The entry as origin.json holds it."""
        return {
            "name": self.name,
            "squeal": __version__,
            "licence": "CC-BY-4.0",
            "command": self.command,
            "sources": {"module": self.module, "sha256": digest(self.module)},
            "read": {file.name: _sha256(file) for file in self.reads},
            "results": [asdict(made) for made in self.made()],
        }


def names() -> dict[str, str]:
    """The figures and tables that can be taken, with the first sentence of their captions."""
    return {name: title(text) for name, text in captions().items()}


def take(name: str, build: Path, to: Path | None = None) -> Taken:
    """Write a figure, table or number of the build in a folder into a folder of its own.

    name: of a figure or table as `names` lists it (fig11, also Fig. 11), or the key of a number,
    its result and the keys in it (energy.motions.b1-c.friction); build: the folder of the build;
    to: the folder that is written, NAME if left out. Nothing is written there before all is
    complete. Raises InputError if there is no such name, if results are missing (the sentence says
    what builds them), or if the folder holds other things.
    """
    listed = captions()
    key = _listed_name(name)
    study = key.partition(".")[0]
    if key not in listed and result_file(study) not in RESULTS:
        raise InputError(
            f"{key}: is no figure, table or number of the report; `squeal take` lists figures and "
            "tables, and a number is named as in results/NAME.json: NAME.key.key"
        )
    folder = Path(key) if to is None else to
    _refuse_other_folders(folder, key)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".take-") as temporary:
        made = Path(temporary)
        if key in listed:
            reads = _figure_or_table(key, build, made)
            results = read(file for file in reads if file.suffix == ".json")
            text = plain(filled(listed[key], results))
            write_text(made / "caption.txt", f"{text}\n")
        else:
            _number(key, build, made)
        _list_written_files(made)
        return Taken(key, str(folder), _move_files(made, folder))


def _listed_name(name: str) -> str:
    """The name by which a figure is listed (fig11) of one as people write it (Fig. 11)."""
    numbered = re.fullmatch(r"fig(?:ure)?[ ._-]*(\d+)", name.lower())
    return name if numbered is None else f"fig{int(numbered[1]):02}"


def _figure_or_table(name: str, build: Path, made: Path) -> tuple[Path, ...]:
    """Write a figure or table with what belongs to it; the files that it was made from."""
    if name not in FIGURES:
        return _table(name, build, made)
    if FIGURES[name].measured:
        return _measured(name, build, made)
    return _figure(name, build, made)


def _refuse_other_folders(folder: Path, name: str) -> None:
    """Refuse a folder that holds anything but an earlier take of the same thing, and a take whose
    files were changed since. Raises InputError.

    name: of the figure, table or number that is taken; the file `ORIGIN` of a take holds it too.
    """
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    try:
        origin = json.loads((folder / ORIGIN).read_text(encoding="utf-8"))
        is_same_take = origin["name"] == name
        written = dict(origin.get("written", {}))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        is_same_take = False
    if not is_same_take:
        raise InputError(
            f"{folder}: exists and was not written by `squeal take {name}`; a new or an empty "
            "folder is allowed (--to FOLDER)"
        )
    for file, sha256 in written.items():
        if (folder / file).is_file() and _sha256(folder / file) != sha256:
            raise InputError(
                f"{folder / file}: was changed since `squeal take {name}` wrote it; remove it, or "
                "give a new or an empty folder (--to FOLDER)"
            )


def _list_written_files(made: Path) -> None:
    """List in origin.json what was written, so that a later take sees what was changed."""
    origin = json.loads((made / ORIGIN).read_text(encoding="utf-8"))
    files = sorted(path for path in made.rglob("*") if path.is_file() and path.name != ORIGIN)
    origin["written"] = {str(path.relative_to(made)): _sha256(path) for path in files}
    write_text(made / ORIGIN, to_json(origin) + "\n")


def _sha256(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _move_files(made: Path, folder: Path) -> tuple[str, ...]:
    """Move finished files to their folder; other files in it stay."""
    files = sorted(str(path.relative_to(made)) for path in made.rglob("*") if path.is_file())
    try:
        for file in files:  # all folders before any file
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
        for file in files:
            os.replace(made / file, folder / file)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from None
    return tuple(files)


def _built_files(build: Path, wanted: Iterable[str]) -> tuple[Path, ...]:
    """Files of a build. Raises InputError that says how to build those that are missing."""
    files = list(wanted)
    missing = [file for file in files if not (build / file).is_file()]
    if missing:
        raise InputError(
            f"{', '.join(missing)}: not built yet; build first, in {build.resolve().name}: "
            f"snakemake {' '.join(missing)}"
        )
    return tuple(build / file for file in files)


def _figure(name: str, build: Path, made: Path) -> tuple[Path, ...]:
    """Write the figure in three formats, what it draws as CSV, and the files that it was drawn
    from, into the folder `made`; returns these files in the build."""
    from squeal.article.report.drawn import HEAD, rows
    from squeal.plots.style import save

    figure = FIGURES[name]
    reads = _built_files(build, figure.reads)
    # of `draw`: files of the build, and words such as the name of a model
    arguments = [str(build / word) if "/" in word else word for word in figure.arguments]
    module = f"squeal.article.figures.{figure.module}"
    drawing = call(import_module(module).draw, arguments)
    for kind in ("pdf", "svg", "png"):
        save(drawing, made / f"{name}.{kind}", text=False)
    write_text(made / "alternative.txt", drawing.alternative + "\n")
    (made / "data").mkdir()
    for file in reads:
        _copy(file, made / "data" / file.name)
    if any(word.startswith("results/") for word in figure.reads):
        write_csv(made / "data" / "curves.csv", HEAD, rows(drawing.figure))
    origin = Origin(name, f"snakemake {report_file(name)}", reads, module)
    _write_origin_and_licence(origin, "figure", made, DRAWN_WITH)
    return reads


def _measured(name: str, build: Path, made: Path) -> tuple[Path, ...]:
    """The figure as the build drew it while it measured; another run would draw other numbers."""
    drawn = _built_files(build, figure_files(name))
    for built, to in zip(drawn, (f"{name}.pdf", "alternative.txt"), strict=True):
        _copy(built, made / to)
    module = f"squeal.article.figures.{FIGURES[name].module}"
    origin = Origin(name, f"snakemake {report_file(name)}", drawn, module)
    _write_origin_and_licence(origin, "figure", made, DRAWN_WITH)
    return drawn


def _copy(file: Path, to: Path) -> None:
    write_whole(to, lambda stream: stream.write(file.read_bytes()))


def _table(name: str, build: Path, made: Path) -> tuple[Path, ...]:
    """The table as LaTeX and as CSV; reads the results that its function's parameters name."""
    module = f"squeal.article.report.tables.{name}"
    wanted = inspect.signature(import_module(module).table).parameters
    reads = _built_files(build, map(result_file, wanted))
    (tex,) = _built_files(build, [report_file(name)])
    text = tex.read_text(encoding="utf-8")
    write_text(made / f"{name}.tex", text)
    head, *body = table_rows(text)
    write_csv(made / f"{name}.csv", head, body)
    _write_origin_and_licence(Origin(name, "snakemake", reads, module), "table", made)
    return reads


def _number(key: str, build: Path, made: Path) -> None:
    """Write a number as text and as LaTeX, with its origin, into the folder `made`."""
    study = key.partition(".")[0]
    reads = _built_files(build, [result_file(study)])
    try:
        value = entry_of(read(reads), key)
    except KeyError:
        raise InputError(f"{key}: is no key of {reads[0]}") from None
    write_text(made / "value.txt", f"{value}\n")
    write_text(made / "value.tex", formatted(value) + "\n")
    origin = Origin(key, f"snakemake {result_file(study)}", reads, "squeal.article.contents")
    _write_origin_and_licence(origin, "number", made)


def _write_origin_and_licence(
    origin: Origin, kind: str, made: Path, drawn_with: tuple[str, ...] = ()
) -> None:
    """Write origin, references, licence and command into a folder; drawn_with: packages."""
    write_text(made / ORIGIN, to_json(origin.to_dict()) + "\n")
    versions = behind(origin.made()) | {name: version(name) for name in drawn_with}
    texts = [entry.bibtex for entry in references(versions)]
    write_text(made / "references.bib", "\n\n".join(texts) + "\n")
    write_text(made / "LICENCE.txt", _LICENCE.format(kind=kind, version=__version__))
    write_text(made / "command.txt", origin.command + "\n")
