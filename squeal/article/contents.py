"""What a build makes: results, computed by studies, and figures, drawn from them.

The workflow runs what stands here, one job per entry. Light on purpose: it is imported each time.
"""

from typing import NamedTuple

from squeal.article.cases import CASES, HISTORY_FIGURES, STEMS, stem


def scene_file(name: str) -> str:
    """The file of one of the article's scenes."""
    return f"workflow/scenes/{name}.yaml"


def result_file(name: str) -> str:
    """The file that a study or the simulation of a scene writes."""
    return f"results/{name}.json"


def _scenes(*names: str) -> tuple[str, ...]:
    return tuple(map(scene_file, names))


def _stored(*names: str) -> tuple[str, ...]:
    """What long computations have left; CONTRIBUTING.md says how each file is made anew."""
    return tuple(f"workflow/stored/{name}" for name in names)


class Figure(NamedTuple):
    """figures/NAME.pdf and its text, drawn by `squeal.article.figures.MODULE` from its arguments.

    Arguments that hold a slash are files, which the figure depends on; others are plain words. What
    is `measured` on the machine that builds differs from build to build; `benchmarks.precision`
    draws it, and the module holds its caption.
    """

    module: str
    arguments: tuple[str, ...]
    measured: bool = False

    @property
    def reads(self) -> tuple[str, ...]:
        """The files among the arguments."""
        return tuple(word for word in self.arguments if "/" in word)


SETS = ("set-2", "set-3", "set-4")
"""Folders of the other parameter sets, beside the scenes of the reference."""
_ALL = _scenes(*HISTORY_FIGURES)
_B2 = _scenes(*(stem("B2", case) for case in CASES))
_SETS = (*_ALL, *_scenes(*(f"{one}/{name}" for one in SETS for name in HISTORY_FIGURES)))


STUDIES: dict[str, tuple[str, ...]] = {
    "quasi_static": (*_scenes("b3"), *_B2, *_scenes(*(f"{one}/b3" for one in SETS))),
    "eigenvalues": _ALL,
    "stability": _ALL,
    "angles": _scenes("b2-c"),
    "map_ranges": _scenes("b2-c"),
    "energy": _ALL,
    "line_springs": _B2,
    "hammering": _ALL,
    "starts": _ALL,
    "onset": _ALL,
    "basin": _scenes("b1-d", "b2-d"),
    "grazing": _scenes("b2-c"),
    "releases": _SETS,
    "sets": _SETS,
    "coexistence": (
        *_scenes("b1-d", "b2-d"),
        *_stored(*(f"coexistence/{name}.json" for name in ("b1-d", "b2-d-integral", "b2-d-mean"))),
    ),
    "claims": _ALL,
    "findings": _scenes(*STEMS),
    "baseline": (),
    "ensemble": _stored("ensemble.csv", "lasting.csv", "searches.json"),
    "accuracy": _scenes("b2-d", "b1-c", "b2-c"),
    "horizon": _stored("horizon.json"),
    "extreme": (),
}
"""results/NAME.json is computed by `squeal.article.studies.NAME` from these files."""

_DRAWN_FROM = {
    **{name: (name,) for name in ("energy", "map_ranges", "line_springs", "starts")},
    "schematic": ("hammering", "sets"),
    "outcomes": ("onset", "basin", "grazing"),
    "cycles": ("onset",),
    "control": ("eigenvalues",),
    "coexistence": ("coexistence",),
    "coupling": ("stability",),
    "modes": ("stability",),
    "ensemble": ("ensemble", "sets"),
    "work": ("accuracy",),
    "horizon": ("horizon",),
}
FIGURES: dict[str, Figure] = {
    "fig01": Figure("sketch", _scenes("b1-c")),
    "fig02": Figure("sketch", _scenes("b2-c")),
    "fig03": Figure("charts", ("B1",)),
    "fig08": Figure("charts", ("B2",)),
    **{
        f"fig{number:02}": Figure("histories", (result_file(name), f"results/{name}.csv"))
        for name, number in HISTORY_FIGURES.items()
    },
    "fig13": Figure("quasi_static", (result_file("quasi_static"), result_file("angles"))),
    **{name: Figure(name, tuple(map(result_file, some))) for name, some in _DRAWN_FROM.items()},
    "run_times": Figure("work", (), measured=True),
}
"""All figures of the report."""
REPRODUCIBLE = {name: figure for name, figure in FIGURES.items() if not figure.measured}
"""The figures that are drawn from results and compared with other builds."""
RESULTS = tuple(map(result_file, (*HISTORY_FIGURES, *STUDIES)))
"""All result files that the report rests on."""
TABLES = (
    "basin",
    "bounds",
    "claims",
    "eigenvalues",
    "extreme",
    "findings",
    "horizons",
    "lasting",
    "levels",
    "origins",
    "parameters",
    "poles",
    "releases",
    "sets",
    "table1",
    "table2",
    "verdicts",
    "workloads",
    "works",
)
"""paper/generated/NAME.tex is written by `squeal.article.report.tables.NAME`."""


def figure_files(name: str) -> tuple[str, str]:
    """The picture of a figure and its alternative text."""
    return f"figures/{name}.pdf", f"figures/{name}.txt"


def report_file(name: str) -> str:
    """The file that holds a figure or a table of the report."""
    return figure_files(name)[0] if name in FIGURES else f"paper/generated/{name}.tex"
