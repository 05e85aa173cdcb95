"""Error against run time with the peers of the benchmark group: `python -m benchmarks.precision`.

Writes results/benchmark.json and figures/benchmark.pdf, and prints for each case the least time of
each path for a final error of at most 1e-10, as such and as a multiple of the default path.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from benchmarks.peers import peers
from squeal.article.figures.precision import draw
from squeal.article.precision.paths import DEFAULT
from squeal.article.report.precision import ERROR, OURS
from squeal.article.results.precision import time_at
from squeal.article.studies.precision import STEMS, compared
from squeal.io.provenance import provenance
from squeal.io.writing import to_json, write_text
from squeal.plots.style import save

ROOT = Path(__file__).resolve().parent.parent
PATIENCE = 5.0  # s
RESULTS, FIGURE = ROOT / "results" / "benchmark.json", ROOT / "figures" / "benchmark.pdf"


def main() -> None:
    """Measure, write, draw, print."""
    others = dict(peers())
    print(f"peers beside SciPy: {', '.join(others) or 'none installed'}")
    stems = (*STEMS, "b1-b", "b2-b")
    scenes = [ROOT / f"workflow/scenes/{name}.yaml" for name in (*stems, "b3")]
    found = compared(scenes, stems, DEFAULT | others, PATIENCE, order=True)
    found = replace(found, provenance=provenance(scenes, "squeal.article.studies.precision"))
    RESULTS.parent.mkdir(exist_ok=True)
    write_text(RESULTS, to_json(found.to_dict()) + "\n")
    save(draw(found), FIGURE)
    points = found.points
    for case in dict.fromkeys(p.case for p in points):
        print(f"{case}: ms for an error of {ERROR:g}, multiple of ours, contact changes missed")
        own = time_at(points, case, OURS, ERROR)
        for path in dict.fromkeys(p.path for p in points):
            least = time_at(points, case, path, ERROR)
            lost = sum(p.missed for p in points if (p.case, p.path) == (case, path))
            told = (
                "       -        -"
                if least is None or own is None
                else (f"{1e3 * least:8.3f} {least / own:8.1f}")
            )
            print(f"  {path:16} {told} {lost:6}")
    print(f"written: {RESULTS.relative_to(ROOT)}, {FIGURE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
