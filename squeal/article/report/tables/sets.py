"""The parameter sets with their verdicts."""

from squeal.article.report.latex import number, percent, tabular
from squeal.article.studies.sets import ParameterSet, Sets

CAPTION = r"""Parameter sets (ratios; $\alpha_1$, $\alpha_2$ by case as printed; level, at rest, the
same in all cases) and verdicts under each. Ratios on an edge of the searched range are marked
$\dagger$. Contact lost: share of time in which an edge is separated that touches in the sliding
equilibrium (from equilibrium), or any edge (from full contact), mean over the cases in which both
models have an equilibrium. Lasting: share of initial conditions from which the loss of contact in
case (d) is sustained, at
$\zeta = {}$\val[p1]{onset.ratio}."""
NAMES = {
    "h": "$h/w$",
    "I": "$I$ over a uniform rectangle's",
    "k2": "$k_2/k_1$",
    "k3": "$k_3/k_1$",
    "k4": "$k_4/k_1$",
    "k_c": "$k_c/k_1$",
    "L": "$L/w$",
    "mu": r"$\mu$",
    "F_n": "$F_n/(k_1 w)$",
    "x": r"$x(0)\,k_1/F_n$",
    "y1": r"$y(0)\,k_1/F_n$, B1",
    "y2": r"$y(0)\,k_1/F_n$, B2",
    "y0": r"$y_0\,k_1/F_n$, B2",
}
EDGES = {"L": (0.5, 1.0, 10.0), "mu": (0.1, 0.6), "F_n": (1e-4, 2e-4, 3e-2)}
"""Ends of the searched ranges, of both searches."""


def _cases(cases: tuple[str, ...]) -> str:
    return ", ".join(cases) if cases else "none"


def _ratio(key: str, value: float) -> str:
    near = any(abs(value / edge - 1.0) < 0.01 for edge in EDGES.get(key, ()))
    return number(value, 3) + (r"$^\dagger$" if near else "")


def _lasting(one: ParameterSet, model: str) -> str:
    if not one.lasting:
        return "--"
    return percent(one.lasting[model], 0) + (
        " (flutters)" if (one.growth[model] or 0.0) > 0.0 else ""
    )


def table(sets: Sets) -> str:
    """A column a set."""
    every: list[ParameterSet] = list(sets.sets.values())
    ratios = [[name, *(_ratio(k, one.numbers[k]) for one in every)] for k, name in NAMES.items()]

    losses = {
        "equilibrium": [one.lost for one in every],
        "full contact": [one.apart for one in every],
    }
    verdicts = [
        [
            "independent statements satisfied",
            *(f"{o.satisfied} of {sets.statements}" for o in every),
        ],
        ["B1 hammers in", *(_cases(one.hammering["B1"]) for one in every)],
        ["B2 hammers in", *(_cases(one.hammering["B2"]) for one in every)],
        *(
            [f"sliding of {model} flutters in", *(_cases(one.flutters[model]) for one in every)]
            for model in ("B1", "B2")
        ),
        ["B2 has no equilibrium in", *(_cases(one.without["B2"]) for one in every)],
        *(
            [f"contact lost from {origin}, {model}", *(percent(one[model], 0) for one in shares)]
            for origin, shares in losses.items()
            for model in ("B1", "B2")
        ),
        *(
            [f"lasting in (d), {model}", *(_lasting(one, model) for one in every)]
            for model in ("B1", "B2")
        ),
    ]
    head = ["", *(name.replace("-", " ") for name in sets.sets)]
    return tabular("l" + "r" * len(every), head, [ratios, verdicts])
