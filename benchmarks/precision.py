"""Error against run time: `python -m benchmarks.precision FIGURE [--quick]`.

Draws the figure `run_times` of the report, with the processor's name in it, and prints for each
case the least processor time of each integrator for a final error of at most 1e-10, as such and as
a multiple of the default path. Then come eigenvalues and the critical friction of case (c) of the
line, against 50 digits. `--quick`: the cases and integrators of the report, as the build asks for
them; without it more cases, more evaluations and the peers of the benchmark group.
"""

from __future__ import annotations

import argparse
import platform
import re
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import control
import mpmath as mp
import numpy as np
from matplotlib.axes import Axes

from benchmarks.peers import peers
from squeal.article.figures.work import panels
from squeal.article.studies._reference import precision_in_words, reference
from squeal.article.studies.accuracy import (
    AIM,
    FIXED,
    OWN,
    PATIENCE,
    SEVERAL,
    SOLVERS,
    STEMS,
    Accuracy,
    Point,
    Run,
    Solver,
    cases_of,
    functions,
    points_of,
    why_not,
)
from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import Scene, read_scene
from squeal.linear.matrices import state_matrices
from squeal.model.contact import STATES
from squeal.plots.style import Drawing, blank, save, style
from squeal.queries.pads.equilibrium import analyse, at_equilibrium
from squeal.queries.thresholds import critical_friction
from squeal.simulation.run import in_natural_units
from tests.exact import Exact, discriminant

ROOT = Path(__file__).resolve().parent.parent
MORE = ("b1-b", "b2-b")
EVALUATIONS = 1_000_000
WIDTHS = tuple(10.0**-n for n in range(3, 14, 2))  # of the bisected interval of friction
BRACKET = 0.02  # half of the first one
SHORT = 0.02  # seconds that several short calls take together
LONG = 0.2  # seconds that are enough
MOST = 50  # calls of one kind
GROWS = 1e-7  # of the greatest magnitude: a real part above this is no rounding
Answer = TypeVar("Answer")
LABEL = "processor time [ms]"
ALIKE = {name for name in SOLVERS if name.startswith("SciPy") or name == FIXED}
"""Integrators of the same compiled equations at all tolerances, see `compiled`."""
MARKS = {"squeal": "o", "NumPy eigvals": "^", "python-control": "D"}
COLOURS = {"squeal": "#C8380E", "NumPy eigvals": "#3498DB", "python-control": "#000000"}


class Timed(NamedTuple):
    """An answer of a method: its relative error and its processor time in ms."""

    method: str
    error: float
    ms: float


def processor() -> str:
    """The name of the processor, as far as the system knows it."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor()
    named = re.search(r"^model name.*: (.*)$", text, re.M)
    return named[1] if named else platform.processor()


def timed(call: Callable[[], Answer], compiles: bool = True) -> tuple[Answer, float]:
    """The answer of a call, and its median processor time in ms.

    The first time of one that `compiles` does not count. A call is made three times at least,
    unless it is a long one.
    """
    spent: list[float] = []
    if compiles:
        call()
    while True:
        begun = time.process_time()
        answer = call()
        spent.append(time.process_time() - begun)
        enough = len(spent) >= 3 and sum(spent) >= SHORT
        if enough or sum(spent) >= LONG or len(spent) == MOST:
            return answer, 1e3 * statistics.median(spent)


@dataclass
class Clocked:
    """A solver that keeps its median processor time in ms for each tolerance.

    anew: it compiles its equations anew for each tolerance.
    """

    solver: Solver
    share: float
    anew: bool
    ms: dict[float, float] = field(default_factory=dict)

    def __call__(self, scene: Scene, tolerance: float) -> Run:
        run, ms = timed(lambda: self.solver(scene, tolerance), self.anew)
        self.ms[tolerance] = ms * self.share
        return run


def compiled(scene: Scene) -> None:
    """Compile the equations of a scene in each contact state, as `functions` keeps them."""
    _, model, _, _ = in_natural_units(scene)
    for contact in STATES:
        functions(model, contact)


def spectra(scene: Scene) -> Iterator[Timed]:
    """The eigenvalues about the equilibrium, from scene or matrices, against 50 digits."""
    analysis = analyse(scene)
    A, B = state_matrices(*analysis.matrices)
    exact = Exact(scene, analysis.state)
    squares = exact.squares(exact.equilibrium(analysis.q, scene.pad.mu), scene.pad.mu)
    roots = []
    for square in squares:
        root = mp.sqrt(-square)
        roots += [root, -root]
    size = max(abs(root) for root in roots)

    def error(values: Any) -> float:
        found = [mp.mpc(complex(value)) for value in values]
        distances = []
        for root in roots:
            distances.append(min(abs(root - value) for value in found))
        return float(max(distances) / size)

    def own() -> list[complex]:
        return [e.value for e in analyse(scene).spectrum.eigenvalues]

    def by_numpy() -> Any:
        return np.linalg.eigvals(A)

    def by_control() -> Any:
        return control.ss(A, B, np.eye(6), np.zeros((6, 3))).poles()

    for method, call in zip(COLOURS, (own, by_numpy, by_control), strict=True):
        values, ms = timed(call)
        yield Timed(method, error(values), ms)


def thresholds(scene: Scene) -> Iterator[Timed]:
    """The critical friction, by the query and by bisection of growth, against 50 digits."""
    first = critical_friction(scene).points[0]
    near = analyse(scene.replace(mu=first.mu))
    exact = Exact(scene, near.state)

    def coalescence(q: Any, mu: Any) -> Any:
        """The discriminant over its scale."""
        cubic = exact.cubic(q, mu)
        return discriminant(cubic) / cubic[0] ** 6

    _, truth = exact.critical(coalescence, near.q, first.mu)
    model = scene.pad_model

    def matrix(mu: float) -> tuple[np.ndarray, np.ndarray]:
        at = model.replace(mu=mu)
        rest, why = sliding_equilibrium(at)
        if rest is None:
            raise ValueError(why)
        return state_matrices(*at_equilibrium(at, rest))

    def by_numpy(mu: float) -> Any:
        return np.linalg.eigvals(matrix(mu)[0])

    def by_control(mu: float) -> Any:
        A, B = matrix(mu)
        return control.ss(A, B, np.eye(6), np.zeros((6, 3))).poles()

    def bisected(values: Callable[[float], Any], width: float) -> float:
        low = first.mu - BRACKET
        high = first.mu + 1.1 * BRACKET
        while high - low > width:
            middle = 0.5 * (low + high)
            found = values(middle)
            grows = found.real.max() > GROWS * np.abs(found).max()
            low, high = (low, middle) if grows else (middle, high)
        return 0.5 * (low + high)

    def error(mu: float) -> float:
        return max(float(abs(mp.mpf(mu) / truth - 1)), 1e-17)

    own, ms = timed(lambda: critical_friction(scene))
    yield Timed(OWN, error(own.points[0].mu), ms)
    for method, values in (("NumPy eigvals", by_numpy), ("python-control", by_control)):
        for width in WIDTHS:
            mu, ms = timed(partial(bisected, values, width), compiles=False)
            yield Timed(method, error(mu), ms)


def draw_answers(axes: Axes, answers: list[Timed], title: str) -> None:
    """Errors of answers over their time, a mark a method."""
    for method, colour in COLOURS.items():
        own = [one for one in answers if one.method == method]
        errors = [one.error for one in own]
        axes.plot(
            [one.ms for one in own],
            errors,
            MARKS[method],
            ls="-" if len(own) > 1 else "",
            color=colour,
            ms=4,
            lw=0.8,
            label=method,
        )
    axes.set(xscale="log", yscale="log", ylim=(1e-17, 1e-1))
    axes.set_yticks([10.0**n for n in range(-16, 0, 4)])
    axes.minorticks_off()
    axes.legend(loc="best")
    axes.set_xlabel(LABEL)
    axes.set_title(title, loc="left", pad=3.0)


def in_words(record: Accuracy, times: dict[tuple[str, str, float], float]) -> str:
    """The least time of each integrator for the error aimed at, by case."""
    lines = []
    for case in record.changes:
        least: dict[str, float] = {}
        for p in record.points:
            enough = p.case == case and p.error is not None and p.error <= AIM
            if enough and p.missed == p.extra == 0:
                ms = times[case, p.path, p.tolerance]
                least[p.path] = min(ms, least.get(p.path, ms))
        own = least.get(OWN)
        shown = []
        for path, ms in least.items():
            multiple = f" ({ms / own:.3g} times)" if own and path != OWN else ""
            shown.append(f"{path} {ms:.3g}{multiple}")
        lines.append(f"{case}: {', '.join(shown)}")
    return f"Processor time in ms for an error of at most {AIM:g}. " + "; ".join(lines) + "."


def main() -> None:
    """Measure, draw, print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.precision", description=__doc__)
    parser.add_argument("figure", type=Path)
    parser.add_argument("--quick", action="store_true")
    given = parser.parse_args()
    title = "Error against run time"
    if why := why_not():
        save(blank(title, why, "squeal.article.figures.work"), given.figure)
        return
    solvers = SOLVERS
    patience = PATIENCE
    if not given.quick:
        solvers = SOLVERS | dict(peers())
        patience = EVALUATIONS
    stems = STEMS if given.quick else STEMS + MORE
    files = [ROOT / f"workflow/scenes/{stem}.yaml" for stem in stems]
    points: list[Point] = []
    changes: dict[str, int] = {}
    times: dict[tuple[str, str, float], float] = {}
    for case, scene in cases_of(files).items():
        compiled(scene)
        exact = reference(scene)
        changes[case] = len(exact.times)
        for name, solver in solvers.items():
            share = 1.0 / SEVERAL if "batch" in name else 1.0
            clocked = Clocked(solver, share, anew=name not in ALIKE)
            points += points_of(case, scene, exact, name, clocked, patience)
            times |= {(case, name, t): ms for t, ms in clocked.ms.items()}
    record = Accuracy(tuple(points), changes, precision_in_words())
    line = read_scene(ROOT / "workflow/scenes/b2-c.yaml")
    with style():
        where = partial(_time, times)
        figure, left = panels(record, where, LABEL, 3, 6.6)
        draw_answers(left[0], list(spectra(line)), "(e) eigenvalues, B2 (c)")
        draw_answers(left[1], list(thresholds(line)), "(f) critical friction, B2 (c)")
        left[0].set_ylabel("relative error")
        left[1].set(xlim=(10.0, 3e3), xticks=[1e1, 1e2, 1e3])
        left[1].minorticks_off()
        figure.supxlabel(f"on one core of {processor()}", fontsize=8)
    text = in_words(record, times)
    save(Drawing(figure, text, title, "benchmarks.precision"), given.figure)
    print(text)


def _time(times: dict[tuple[str, str, float], float], point: Point) -> float:
    return times[point.case, point.path, point.tolerance]


if __name__ == "__main__":
    main()
