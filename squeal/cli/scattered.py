"""`squeal critical-friction --scatter`: what tolerances make of the critical friction."""

import argparse
import dataclasses
from typing import Any

from squeal.analysis.scatter import CONFIDENCE, Scatter, scatter
from squeal.analysis.spread_file import SpreadFile, read_spreads
from squeal.analysis.subject import Subject, check_name, free_name
from squeal.cli.base import Answer
from squeal.cli.numbers import whole
from squeal.cli.progress import progress_line
from squeal.cli.tables import number, table
from squeal.io.writing import picked, write_table

MOST_WORKERS = 256


def scattered(given: argparse.Namespace, subject: Subject, mu_max: float) -> Answer:
    """The answer for a scene or a system with named parameters. Raises InputError."""
    workers = 1 if given.workers is None else whole(given.workers, "--workers", 1, MOST_WORKERS)
    asked = read_spreads(given.scatter)
    for spread in asked.spreads:
        check_name(subject, spread.name, f"{given.scatter}: spreads", spread.kind == "relative")
    with progress_line("samples") as progress:
        found = scatter(
            subject, asked.spreads, asked.samples, asked.seed, mu_max, workers, progress
        )
    name = free_name(subject)
    if given.table is not None:
        n = len(found.critical)
        rows = ((mu, (i + 1) / n) for i, mu in enumerate(found.critical.tolist()))
        write_table(given.table, {name: "", "share": ""}, rows)
    if given.figure is not None:
        from squeal.plots.scatter import save_scatter

        save_scatter(given.figure, given.source.name, found, name)
    inputs = [given.source.file, given.scatter]
    return Answer(lambda: data(found, asked), lambda: text(found, asked, name), inputs)


def data(found: Scatter, asked: SpreadFile) -> dict[str, Any]:
    """The answer as a JSON object."""
    rows = picked(found, "mu mu_max") | picked(asked, "samples seed")
    rows |= picked(found, "failed beyond")
    rows["spreads"] = [dataclasses.asdict(spread) for spread in asked.spreads]
    rows |= picked(found, "stable") | {"interval": list(found.interval), "confidence": CONFIDENCE}
    return {"scatter": rows | {"quantiles": [dataclasses.asdict(q) for q in found.quantiles]}}


def text(found: Scatter, asked: SpreadFile, name: str) -> str:
    """The same for people."""

    def cell(mu: float | None) -> str:
        return f"> {found.mu_max:g}" if mu is None else number(mu)

    rows = [("  share unstable", name, "from", "to")]
    rows += [
        (f"  {100 * q.level:g} %", cell(q.mu), cell(q.low), cell(q.high)) for q in found.quantiles
    ]
    parts = [
        f"{asked.samples} samples, seed {asked.seed}: first loss of stability up to {name} = "
        f"{found.mu_max:g}, each quantile with its interval of {100 * CONFIDENCE:g} % confidence",
        table(rows),
        f"stable at {name} = {number(found.mu)}: {100 * found.stable:.1f} % of the samples "
        f"({100 * found.interval[0]:.1f} to {100 * found.interval[1]:.1f} %)",
    ]
    if found.beyond:
        parts.append(f"{found.beyond} have no threshold up to {name} = {found.mu_max:g}")
    if found.failed:
        parts.append(f"{found.failed} are no pads, or rest nowhere without friction; left out")
    return "\n".join(parts)
