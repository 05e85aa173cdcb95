"""Error against run time with the peers of the benchmark group: `python -m benchmarks.precision`.

Writes results/benchmark.json and figures/benchmark.pdf, and prints for each case the least time of
each path for a final error of at most 1e-10, as such and as a multiple of the default path.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from squeal.article.precision.peers import peers
from squeal.article.report.precision import ERROR, OURS
from squeal.article.results.precision import Precision, time_at
from squeal.article.studies.precision import MORE, STEMS
from squeal.files.writing import write_text

ROOT = Path(__file__).resolve().parent.parent
RESULTS, FIGURE = ROOT / "results" / "benchmark.json", ROOT / "figures" / "benchmark.pdf"


def main() -> None:
    """Measure, write, draw, print."""
    print(f"peers beside SciPy: {', '.join(name for name, _ in peers()) or 'none installed'}")
    scenes = [str(ROOT / f"workflow/scenes/{name}.yaml") for name in (*STEMS, *MORE, "b3")]
    program = [sys.executable, "-m", "squeal.article.studies"]
    command = [*program, "precision", *scenes, "--peers"]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    RESULTS.parent.mkdir(exist_ok=True)
    write_text(RESULTS, text)
    draw = [
        sys.executable,
        "-m",
        "squeal.article.figures.precision",
        str(RESULTS),
        "--pdf",
        str(FIGURE),
    ]
    subprocess.run(draw, check=True)
    points = Precision.read(RESULTS).points
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
