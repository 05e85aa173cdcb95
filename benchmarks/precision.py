"""Error against run time with the peers of the benchmark group: `python -m benchmarks.precision`.

Writes figures/benchmark.pdf, and prints for each case the least time of each path for a final error
of at most 1e-10, as such and as a multiple of the default path.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

from benchmarks.peers import peers
from squeal.article.cases import title
from squeal.article.figures.accuracy import accuracy_figure
from squeal.article.studies._reference import precision_in_words, reference
from squeal.article.studies.accuracy import SEVERAL, WAYS, Accuracy, Point, Run, Way, points_of
from squeal.io.scene import Scene, read_scene

ROOT = Path(__file__).resolve().parent.parent
STEMS = ("b1-c", "b2-c", "b1-b", "b2-b")
PATIENCE, ERROR = 1_000_000, 1e-10
FIGURE = ROOT / "figures" / "benchmark.pdf"


@dataclass
class Clocked:
    """A way of integration that keeps its median processor time in ms for each tolerance."""

    way: Way
    share: float
    ms: dict[float, float] = field(default_factory=dict)

    def __call__(self, scene: Scene, tolerance: float) -> Run:
        run = self.way(scene, tolerance)  # compiles
        spent: list[float] = []
        while len(spent) < 50 and (len(spent) < 3 or sum(spent) < 0.02):
            begun = time.process_time()
            self.way(scene, tolerance)
            spent.append(time.process_time() - begun)
        self.ms[tolerance] = 1e3 * statistics.median(spent) * self.share
        return run


def main() -> None:
    """Measure, draw, print."""
    others = dict(peers())
    print(f"peers beside SciPy: {', '.join(others) or 'none installed'}")
    points: list[Point] = []
    changes: dict[str, int] = {}
    times: dict[tuple[str, str, float], float] = {}
    for stem in STEMS:
        scene = read_scene(ROOT / f"workflow/scenes/{stem}.yaml")
        scene, case = replace(scene, outputs=()), title(stem)
        exact = reference(scene)
        changes[case] = len(exact.times)
        for name, way in (WAYS | others).items():
            clocked = Clocked(way, 1.0 / SEVERAL if "batch" in name else 1.0)
            points += points_of(case, scene, exact, name, clocked, PATIENCE)
            times |= {(case, name, t): ms for t, ms in clocked.ms.items()}

    def ms(point: Point) -> float:
        return times[point.case, point.path, point.tolerance]

    def least(case: str, path: str) -> float | None:
        own = [p for p in points if (p.case, p.path) == (case, path) and p.missed == p.extra == 0]
        return min((ms(p) for p in own if p.error is not None and p.error <= ERROR), default=None)

    found = Accuracy(tuple(points), changes, precision_in_words())
    labels = "relative error", "run time [ms]"
    accuracy_figure(found, lambda p: (p.error or 0.0, ms(p)), labels).savefig(FIGURE)
    for case in changes:
        print(f"{case}: ms for an error of {ERROR:g}, multiple of ours, contact changes missed")
        own = least(case, "squeal")
        for path in (*WAYS, *others):
            took = least(case, path)
            lost = sum(p.missed for p in points if (p.case, p.path) == (case, path))
            told = "       -        -"
            if took is not None and own is not None:
                told = f"{took:8.3f} {took / own:8.1f}"
            print(f"  {path:16} {told} {lost:6}")
    print(f"written: {FIGURE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
