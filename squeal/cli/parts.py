"""`python -m squeal.cli.parts JOB.yaml --part 3-of-8 --out FILE`: a job in parts.

That writes the table of one part; `--gather PART ... --out FILE` writes the whole from the parts'.
"""

import argparse
import itertools
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from squeal.cli.jobs import read_job
from squeal.cli.streams import exit_code
from squeal.io.parts import cut
from squeal.io.processes import mapped


def _write(task: tuple[Path, Path, int, int]) -> Path:
    file, out, start, stop = task
    read_job(file).write(out, start, stop)
    return out


def compute(file: Path, out: Path, start: int, stop: int, workers: int = 1) -> None:
    """Write the units of a job from start to stop, in so many processes."""
    workers = min(workers, stop - start)
    if workers == 1:
        _write((file, out, start, stop))
        return
    ends = [start + (stop - start) * i // workers for i in range(workers + 1)]
    with tempfile.TemporaryDirectory() as folder:
        tasks = [
            (file, Path(folder, f"{low}.csv"), low, high) for low, high in itertools.pairwise(ends)
        ]
        read_job(file).gather(out, list(mapped(_write, tasks, workers)))


def main(given: Sequence[str] | None = None) -> int:
    """Write a part or the whole; 2 for what is refused, 1 for what fails, 130 if it is stopped."""
    parser = argparse.ArgumentParser(description="Compute a job in parts.")
    parser.add_argument("job", type=Path, metavar="JOB.yaml")
    wanted = parser.add_mutually_exclusive_group(required=True)
    wanted.add_argument("--part", metavar="I-of-N")
    wanted.add_argument("--gather", nargs="+", type=Path, metavar="PART")
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="processes of a part")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE")
    chosen = parser.parse_args(given)
    return exit_code(chosen.job.stem, lambda: _run(chosen))


def _run(chosen: argparse.Namespace) -> int:
    job = read_job(chosen.job)
    if chosen.part is None:
        job.gather(chosen.out, chosen.gather)
    else:
        compute(chosen.job, chosen.out, *cut(chosen.part, job.size), chosen.workers)
    return 0


if __name__ == "__main__":
    sys.exit(main())
