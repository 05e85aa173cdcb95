"""The parameter sets with their verdicts."""

from collections.abc import Callable

from squeal.article.cases import stem
from squeal.article.report.latex import number, percent, tabular, with_spread
from squeal.article.studies.sets import TWO, ParameterSet, Sets

CAPTION = r"""Parameter sets (ratios; $\alpha_1$, $\alpha_2$ by case as printed; level, at rest, the
same in all cases) and verdicts under each. Ratios on an edge of the searched range are marked
$\dagger$: the ranges of Table~\numberof{bounds}, but $\mu$ up to 0.6, $F_n/(k_1w)$ from $10^{-4}$
or $2\times10^{-4}$ to 0.03, and $L/w$ from 0.5 or 1. Contact lost: share of time in which an edge
is separated that touches in the sliding equilibrium (from equilibrium), or any edge (from full
contact), mean over the cases in which both models have an equilibrium; two points: edges of a pad
on two springs for the line. Lasting beside stable sliding: cases in which contact goes on changing
although no mode of the equilibrium grows, with the share of initial conditions from which it does,
at $\zeta = {}$\val[p1]{onset.ratio}. Fastest face: greatest speed of the lower face while it
touches. Where it reaches the speed $V$ of the surface ($\ddagger$), friction would reverse and the
equations no longer hold."""
# fmt: off
NAMES = {
    "h": "$h/w$", "I": "$I$ over a uniform rectangle's", "k2": "$k_2/k_1$", "k3": "$k_3/k_1$",
    "k4": "$k_4/k_1$", "k_c": "$k_c/k_1$", "L": "$L/w$", "mu": r"$\mu$", "F_n": "$F_n/(k_1 w)$",
    "x": r"$x(0)\,k_1/F_n$", "y1": r"$y(0)\,k_1/F_n$, B1", "y2": r"$y(0)\,k_1/F_n$, B2",
    "y0": r"$y_0\,k_1/F_n$, B2",
}
# fmt: on
OUTSIDE = r"$^\ddagger$"
EDGES = {"L": (0.5, 1.0, 10.0), "mu": (0.1, 0.6), "F_n": (1e-4, 2e-4, 3e-2)}  # of the searches


def _cases(cases: tuple[str, ...]) -> str:
    return ", ".join(cases) or "none"


def _ratio(key: str, value: float) -> str:
    """A ratio, marked where it lies within 1 % of an end of its searched range."""
    near = any(abs(value / edge - 1.0) < 0.01 for edge in EDGES.get(key, ()))
    mark = r"$^\dagger$" if near else ""
    return number(value, 3) + mark


def _fastest(of_set: ParameterSet, model: str) -> str:
    """The speed of the fastest lower face of a model over V, marked where it reaches 1."""
    speed = of_set.fastest(model)
    mark = OUTSIDE if speed >= 1.0 else ""
    return number(speed, 2) + mark


def _share(value: float) -> str:
    return percent(value, 0)


def _lasting(sets: Sets, name: str, model: str) -> str:
    """The cases in which contact goes on changing, each with its share of initial conditions."""
    of_set = sets.sets[name]
    shown = []
    for case, share in of_set.lasting_beside_stable_sliding(model).items():
        ends = sets.ends(f"sets.{name}.lasting.{stem(model, case)}")
        shown.append(f"{case}: {with_spread(share, ends, _share)}")
    if shown:
        return ", ".join(shown)
    return "none" if of_set.lasting else "--"


SHOWN: tuple[tuple[str, tuple[str, ...], Callable[[ParameterSet, str], str]], ...] = (
    ("fastest face over $V$, {}", ("B1", "B2"), _fastest),
    ("{} hammers in", ("B1", "B2"), lambda s, model: _cases(s.hammering[model])),
    ("sliding of {} flutters in", ("B1", "B2"), lambda s, model: _cases(s.flutters[model])),
    ("{} has no equilibrium in", ("B1", "B2"), lambda s, model: _cases(s.without[model])),
    (
        "contact lost from equilibrium, {}",
        ("B1", "B2", TWO),
        lambda s, model: percent(s.lost[model], 0),
    ),
    (
        "contact lost from full contact, {}",
        ("B1", "B2", TWO),
        lambda s, model: percent(s.apart[model], 0),
    ),
)
"""Rows of verdicts: their name, the models that have them, and what is shown of a set."""


def table(sets: Sets) -> str:
    """The table in LaTeX, a column per set: a group of rows of ratios, and one of verdicts."""
    columns = list(sets.sets.values())
    ratios = []
    for key, name in NAMES.items():
        ratios.append([name, *(_ratio(key, of_set.numbers[key]) for of_set in columns)])
    load = [number(of_set.parameters["F_n"] / 1e3, 3) for of_set in columns]
    ratios.append([r"$F_n$ in the units of Table~\numberof{parameters}, kN", *load])
    satisfied = [f"{of_set.satisfied} of {sets.statements}" for of_set in columns]
    verdicts = [["independent statements satisfied", *satisfied]]
    for name, models, show in SHOWN:  # a row for each model; `show` makes the cell of a set
        for model in models:
            verdicts.append([name.format(model), *(show(of_set, model) for of_set in columns)])
    for model in ("B1", "B2"):
        lasting = [_lasting(sets, name, model) for name in sets.sets]
        verdicts.append([f"lasting beside stable sliding, {model}", *lasting])
    head = [""]
    for name, of_set in sets.sets.items():
        head.append(name.replace("-", " ") + (OUTSIDE if of_set.outruns else ""))
    return tabular("l" + "r" * len(columns), head, [ratios, verdicts])
