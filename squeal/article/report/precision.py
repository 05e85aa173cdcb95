"""Table and values of the section on error against run time, from results/precision.json."""

from collections.abc import Sequence

from squeal.article.report.latex import Generated, at_most, number, power, tabular, typeset
from squeal.article.results.precision import Check, Point, Precision, Timing, time_at

ERROR = 1e-10  # at which the paths are compared
OURS, BATCH, NUMPY = "squeal", "squeal, batch", "numpy.linalg.eigvals"


def _plain(value: float) -> str:
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def _least(tolerances: Sequence[float]) -> str:
    return power(min(tolerances)) if tolerances else "--"


def speed_table(points: Sequence[Point]) -> str:
    """Time of each path for a final error of at most `ERROR`, and as a multiple of ours."""
    cases = list(dict.fromkeys(p.case for p in points))
    if not cases:
        return tabular("l", ["path"], [[["--"]]])
    paths = list(dict.fromkeys(p.path for p in points))
    rows = []
    for path in paths:
        row = [typeset(path)]
        for case in cases:
            ours, least = (time_at(points, case, name, ERROR) for name in (OURS, path))
            if least is None or ours is None:
                row.append("--")
            else:
                row.append(f"{_plain(1e3 * least)} ({_plain(least / ours)})")
        own = [p for p in points if p.path == path]
        rows.append([*row, str(sum(p.missed for p in own)), str(sum(p.extra for p in own))])
    head = ["path", *map(typeset, cases)]
    columns = "l" + r">{\raggedleft}p{0.85in}" * len(cases) + "rr"
    return tabular(columns, [*head, "missed", "extra"], [rows])


def linear_table(timings: Sequence[Timing]) -> str:
    """Error and time of a spectrum in a sweep, by program."""
    rows = [
        [rf"\texttt{{{typeset(t.program)}}}", number(t.error, 2), number(1e6 * t.seconds, 3)]
        for t in timings
        if t.task == "sweep"
    ]
    return tabular("lrr", ["program", "error", r"time of a matrix, $\mu$s"], [rows])


def linear_values(timings: Sequence[Timing]) -> dict[str, str]:
    """Values on the map and the threshold that the section's text refers to."""

    def of(task: str, program: str) -> list[Timing]:
        return [t for t in timings if (t.task, t.program) == (task, program)]

    ours, theirs = (of("map", name)[-1].seconds for name in (OURS, NUMPY))
    best = min(of("threshold", NUMPY), key=lambda t: t.error)
    (own,) = of("threshold", OURS)
    return {
        "precision.map-ratio": number(theirs / ours, 3),
        "precision.threshold-error": number(max(own.error, 2.0**-53), 2),
        "precision.threshold-ms": number(1e3 * own.seconds, 2),
        "precision.halving-error": number(best.error, 2),
        "precision.halving-ms": number(1e3 * best.seconds, 2),
    }


def setting_values(found: Precision) -> dict[str, str]:
    """What was asked of the paths and programs."""

    def sizes(task: str) -> list[int]:
        return [t.size for t in found.linear if t.task == task]

    tolerances = [point.tolerance for point in found.points]
    return {
        "precision.loosest-tolerance": power(max(tolerances)) if tolerances else "--",
        "precision.tightest-tolerance": _least(tolerances),
        "precision.compared": power(ERROR),
        "precision.coarse": str(min(sizes("map"))),
        "precision.fine": str(max(sizes("map"))),
        "precision.halvings": str(max(sizes("threshold"))),
        "precision.swept": str(max(sizes("sweep"))),
    }


def check_values(checks: Sequence[Check]) -> dict[str, str]:
    """How well the reference is confirmed."""
    times = [c.times for c in checks if c.times is not None]
    return {
        "precision.confirmed-place": at_most(max(c.place for c in checks)) if checks else "--",
        "precision.confirmed-times": at_most(max(times)) if times else "--",
        "precision.changes": str(sum(c.changes for c in checks)),
    }


def values(points: Sequence[Point]) -> dict[str, str]:
    """Values that the section's text refers to."""
    ratios, batches = [], []
    for case in dict.fromkeys(p.case for p in points):
        least, dop853, many = (
            time_at(points, case, name, ERROR) for name in (OURS, "SciPy DOP853", BATCH)
        )
        if least is not None and dop853 is not None:
            ratios.append(dop853 / least)
        if many is not None:
            batches.append(1.0 / many)
    wrong = [p for p in points if p.missed or p.extra]
    theirs, own = ([p for p in wrong if p.path.startswith(OURS) == our] for our in (False, True))
    return {
        "precision.least-ratio": number(min(ratios), 3) if ratios else "--",
        "precision.greatest-ratio": number(max(ratios), 3) if ratios else "--",
        "precision.least-batch": _plain(min(batches)) if batches else "--",
        "precision.missing-runs": str(len(theirs)),
        "precision.own-missing-runs": str(len(own)),
        "precision.runs": str(sum(not p.path.startswith(OURS) for p in points)),
        "precision.own-runs": str(sum(p.path.startswith(OURS) for p in points)),
        "precision.tightest": _least([p.tolerance for p in theirs]),
        "precision.own-tightest": _least([p.tolerance for p in own]),
    }


def generated(found: Precision) -> Generated:
    """Values and tables, from the file of the study."""
    told = values(found.points) | linear_values(found.linear) | check_values(found.checks)
    told["precision.left-out"] = typeset(found.left_out)
    tables = {"speed": speed_table(found.points), "linear-speed": linear_table(found.linear)}
    return told | setting_values(found), tables
