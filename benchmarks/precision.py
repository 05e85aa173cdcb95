"""Error against run time with the peers of the benchmark group: `python -m benchmarks.precision`.

Writes figures/benchmark.pdf, and prints for each case the least time of each path for a final error
of at most 1e-10, as such and as a multiple of the default path.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from benchmarks.peers import peers
from squeal.article.cases import title
from squeal.article.figures.accuracy import draw
from squeal.article.studies._reference import precision_in_words, reference
from squeal.article.studies.accuracy import WAYS, Accuracy, points_of
from squeal.io.scene import read_scene
from squeal.plots.style import save

ROOT = Path(__file__).resolve().parent.parent
STEMS = ("b1-c", "b2-c", "b1-b", "b2-b")
PATIENCE, ERROR = 5.0, 1e-10
FIGURE = ROOT / "figures" / "benchmark.pdf"


def main() -> None:
    """Measure, draw, print."""
    others = dict(peers())
    print(f"peers beside SciPy: {', '.join(others) or 'none installed'}")
    points, changes = [], {}
    for stem in STEMS:
        scene = read_scene(ROOT / f"workflow/scenes/{stem}.yaml")
        scene, case = replace(scene, outputs=()), title(stem)
        exact = reference(scene)
        changes[case] = len(exact.times)
        for name, way in (WAYS | others).items():
            points += points_of(case, scene, exact, name, way, PATIENCE)
    found = Accuracy(tuple(points), changes, precision_in_words())
    save(draw(found), FIGURE)
    for case in changes:
        print(f"{case}: ms for an error of {ERROR:g}, multiple of ours, contact changes missed")
        own = found.time_at(case, "squeal", ERROR)
        for path in (*WAYS, *others):
            least = found.time_at(case, path, ERROR)
            lost = sum(p.missed for p in points if (p.case, p.path) == (case, path))
            told = "       -        -"
            if least is not None and own is not None:
                told = f"{1e3 * least:8.3f} {least / own:8.1f}"
            print(f"  {path:16} {told} {lost:6}")
    print(f"written: {FIGURE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
