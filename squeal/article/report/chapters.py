"""The report as a table: its chapters with their studies, figures and generated files.

The rules of the workflow run what stands here, one job an entry, and the report reads the chapters
in this order. Light on purpose: the workflow imports it each time.
"""

from dataclasses import dataclass
from importlib.util import find_spec

from squeal.article.cases import CASES, HISTORY_FIGURES, STEMS, stem

IDENTIFIED = "workflow/identified.json"
ENSEMBLES = "workflow/ensembles.npz"
PAD = "workflow/pad.json"


def scene_file(name: str) -> str:
    """The file of one of the article's scenes."""
    return f"workflow/scenes/{name}.yaml"


def result_file(name: str) -> str:
    """The file that a study or the simulation of a scene writes."""
    return f"results/{name}.json"


def _scenes(*names: str) -> tuple[str, ...]:
    return tuple(map(scene_file, names))


def _results(*names: str) -> tuple[str, ...]:
    return tuple(map(result_file, names))


@dataclass(frozen=True)
class Study:
    """results/NAME.json, computed by `squeal.article.studies.NAME` from the files that it reads."""

    name: str
    reads: tuple[str, ...] = ()


@dataclass(frozen=True)
class Figure:
    """figures/NAME.pdf and its text, drawn by `squeal.article.figures.MODULE` from its arguments.

    Arguments that hold a slash are files, which the figure depends on; others are plain words.
    """

    name: str
    module: str
    arguments: tuple[str, ...]

    @property
    def reads(self) -> tuple[str, ...]:
        """The files among the arguments."""
        return tuple(word for word in self.arguments if "/" in word)


@dataclass(frozen=True)
class Chapter:
    """paper/NAME.tex, which reads NAME-values.tex and the tables in paper/generated.

    They are made from the results of its studies and from files that it reads `also`: plain values
    from those results, others and tables by `squeal.article.report.NAME`, if it has such.
    """

    name: str
    also: tuple[str, ...] = ()
    tables: tuple[str, ...] = ()
    studies: tuple[Study, ...] = ()
    figures: tuple[Figure, ...] = ()

    @property
    def reads(self) -> tuple[str, ...]:
        """The files that they are made from."""
        return (*_results(*(study.name for study in self.studies)), *self.also)

    @property
    def generated(self) -> tuple[str, ...]:
        """Names of the generated files, the values first."""
        return (f"{self.name}-values.tex", *(f"{table}.tex" for table in self.tables))

    @property
    def modules(self) -> tuple[str, ...]:
        """What makes them: its own module if there is one, the records of its results, the rest."""
        names = [f"report.{self.name}", *(f"results.{study.name}" for study in self.studies)]
        found = [name for name in (f"squeal.article.{n}" for n in names) if find_spec(name)]
        return (*found, "squeal.article.report.__main__")


_B2 = tuple(stem("B2", case) for case in CASES)
_SEARCHED = (Study("verify", (IDENTIFIED, *_scenes(*HISTORY_FIGURES))), Study("robustness", (PAD,)))

_ALL = _scenes(*HISTORY_FIGURES)


def _shown(*names: str, by: str = "") -> tuple[Figure, ...]:
    """Figures that their own modules draw from their own results, or from those of a study."""
    return tuple(Figure(name, name, _results(by or name)) for name in names)


# fmt: off
_PARTS = (
    Chapter("verdicts", also=(*_results(
        "claims", "angles", "quasi_static", "eigenvalues", "loci", "ensembles", "map_ranges",
        "starts", "onset"), PAD)),
    Chapter("introduction"), Chapter("equations"), Chapter("method"),
    Chapter("article", also=_results(*HISTORY_FIGURES),
            tables=("table-1", "table-2", "eigenvalues"),
            studies=(Study("quasi_static", _scenes("b3")), Study("eigenvalues", _scenes(*_B2))),
            figures=(Figure("fig01", "sketch", _scenes("b1-c")),
                     Figure("fig02", "sketch", _scenes("b2-c")),
                     Figure("fig03", "charts", ("B1",)), Figure("fig08", "charts", ("B2",)),
                     *(Figure(f"fig{n:02}", "histories", (*_results(name), f"results/{name}.csv"))
                       for name, n in HISTORY_FIGURES.items()),
                     Figure("fig13", "quasi_static", _results("quasi_static")))),
    Chapter("stability", tables=("literature", "thresholds"),
            studies=(Study("stability", _ALL), Study("loci", _ALL),
                     Study("angles", _scenes(*_B2, "b3"))),
            figures=(*_shown("coupling", "loci", "modes", by="loci"),
                     Figure("growth", "growth", _results("stability")),
                     Figure("maps", "angle_maps", _results("angles", "quasi_static")))),
    Chapter("physics", tables=("works", "members", "own-starts", "springs-starts"),
            studies=(Study("energy", _ALL), Study("map_ranges", _scenes("b2-c")),
                     Study("line_springs", _scenes(*_B2)), Study("starts", _ALL)),
            figures=_shown("energy", "map_ranges", "line_springs", "starts")),
    Chapter("onset", tables=("hammering", "lasting", "exponents"),
            studies=(Study("onset", _ALL), Study("spectra", _ALL)),
            figures=_shown("onset", "spectra")),
    Chapter("identification", also=(PAD,), tables=("formulations", "ranges"), studies=_SEARCHED,
            figures=_shown("robustness")),
    Chapter("ensembles", also=_results("findings"),
            tables=("ensemble-searches", "ensemble-ranges", "ensemble-pad"),
            studies=(Study("ensembles", (ENSEMBLES,)),),
            figures=_shown("ensembles", "corner", by="ensembles")),
    Chapter("statements", tables=("claims", "findings"),
            studies=(Study("claims", (*_ALL, IDENTIFIED)), Study("findings", _scenes(*STEMS)))),
    Chapter("discussion"),
    Chapter("extreme", also=_results("onset"), tables=("extreme", "accuracy"),
            studies=(Study("extreme"), Study("accuracy", _ALL))),
    Chapter("precision", tables=("speed", "linear-speed"),
            studies=(Study("precision", _scenes("b1-c", "b2-c", "b3")),),
            figures=_shown("precision", "linear", by="precision")),
    Chapter("parameters", also=_ALL, tables=("parameters",)),
)
# fmt: on
STUDIES = {study.name: study for part in _PARTS for study in part.studies}
RESULTS = _results(*HISTORY_FIGURES, *STUDIES)
"""All result files that the report rests on."""
CHAPTERS = (*_PARTS, Chapter("making", also=RESULTS, tables=("origin", "chapters")))
FIGURES = {figure.name: figure for part in CHAPTERS for figure in part.figures}
