"""Error against run time: `python -m benchmarks.precision FIGURE [--quick]`.

Draws the figure, and prints for each case the least time of each path for a final error of at most
1e-10, as such and as a multiple of the default path. `--quick`: the cases and paths of the report,
as the build asks for them; without it more cases, more steps and the peers of the benchmark group.
"""

from __future__ import annotations

import argparse
import statistics
import time
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.peers import peers
from squeal.article.figures.accuracy import accuracy_figure
from squeal.article.studies._reference import precision_in_words, reference
from squeal.article.studies.accuracy import (
    PATIENCE,
    SEVERAL,
    WAYS,
    Accuracy,
    Point,
    Run,
    Way,
    cases_of,
    points_of,
    why_not,
)
from squeal.io.scene import Scene
from squeal.plots.style import Drawing, blank, save

ROOT = Path(__file__).resolve().parent.parent
STEMS = ("b1-c", "b2-c", "b1-b", "b2-b")
STEPS, ERROR = 1_000_000, 1e-10
LABELS = "relative error", "run time [ms]"


@dataclass
class Clocked:
    """A way of integration that keeps its median processor time in ms for each tolerance."""

    way: Way
    share: float
    ms: dict[float, float] = field(default_factory=dict)

    def __call__(self, scene: Scene, tolerance: float) -> Run:
        run = self.way(scene, tolerance)  # compiles
        spent: list[float] = []
        while len(spent) < 50 and (sum(spent) < 0.02 or (len(spent) < 3 and sum(spent) < 0.5)):
            begun = time.process_time()
            self.way(scene, tolerance)
            spent.append(time.process_time() - begun)
        self.ms[tolerance] = 1e3 * statistics.median(spent) * self.share
        return run


def main() -> None:
    """Measure, draw, print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.precision", description=__doc__)
    parser.add_argument("figure", type=Path)
    parser.add_argument("--quick", action="store_true")
    given = parser.parse_args()
    title = "Error against run time"
    if why := why_not():
        save(blank(title, why, "squeal.article.figures.accuracy"), given.figure, text=False)
        print(why)
        return
    ways, steps = (WAYS, PATIENCE) if given.quick else (WAYS | dict(peers()), STEPS)
    stems = STEMS[:2] if given.quick else STEMS
    files = [ROOT / f"workflow/scenes/{stem}.yaml" for stem in stems]
    points: list[Point] = []
    changes: dict[str, int] = {}
    times: dict[tuple[str, str, float], float] = {}
    for case, scene in cases_of(files).items():
        exact = reference(scene)
        changes[case] = len(exact.times)
        for name, way in ways.items():
            clocked = Clocked(way, 1.0 / SEVERAL if "batch" in name else 1.0)
            points += points_of(case, scene, exact, name, clocked, steps)
            times |= {(case, name, t): ms for t, ms in clocked.ms.items()}

    def ms(point: Point) -> float:
        return times[point.case, point.path, point.tolerance]

    def least(case: str, path: str) -> float | None:
        own = [p for p in points if (p.case, p.path) == (case, path) and p.missed == p.extra == 0]
        return min((ms(p) for p in own if p.error is not None and p.error <= ERROR), default=None)

    lines = [f"processor time in ms for a final error of at most {ERROR:g}, multiple of squeal's"]
    for case in changes:
        lines.append(f"{case} ({changes[case]} contact changes)")
        own = least(case, "squeal")
        for path in ways:
            took = least(case, path)
            lost = sum(p.missed for p in points if (p.case, p.path) == (case, path))
            both = (
                "       -        -"
                if took is None or own is None
                else f"{took:8.3f} {took / own:8.1f}"
            )
            lines.append(f"  {path:16} {both}" + f"  {lost} changes missed" * bool(lost))
    text = "\n".join(lines)
    found = Accuracy(tuple(points), changes, precision_in_words())
    drawn = accuracy_figure(found, lambda p: (p.error or 0.0, ms(p)), LABELS)
    save(Drawing(drawn, text, title, __doc__.splitlines()[0]), given.figure, text=False)
    print(text)


if __name__ == "__main__":
    main()
