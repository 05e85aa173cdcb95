"""Sweeps of mu in the queries: as JSON rows, table, CSV and figure; of scenes and plain systems."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.eigenvalues import roots_and_verdict, sweep_mu
from squeal.analysis.modes import ModeShape, mode_shapes, sweep_modes
from squeal.cli.tables import elided, number
from squeal.io.scene import Scene
from squeal.io.short_form import PlainSystem
from squeal.io.writing import picked, write_table
from squeal.linear import Spectrum
from squeal.linear.eigen import Eigenvalue

LISTED = 8  # frequencies in a line of a table
NOISE = 1e-9  # of an eigenvalue: growth that is rounding


@dataclass(frozen=True)
class Step:
    """One value of mu; None where the branch does not reach it, contact also for plain systems.

    admissible: whether the equilibrium is one that the model means, None for plain systems.
    """

    mu: float
    contact: str | None
    spectrum: Spectrum | None
    verdict: str | None
    admissible: bool | None = None


def sweep(source: Scene | PlainSystem, mus: Sequence[float]) -> list[Step]:
    """The eigenvalues at each mu; of a scene along its equilibrium branch."""
    if isinstance(source, Scene):
        return [
            Step(mu, a.contact, a.spectrum, a.judgement.verdict, a.admissible)
            if a
            else Step(mu, None, None, None, False)
            for mu, a in sweep_mu(source, list(mus))
        ]
    at = [(mu, *roots_and_verdict(*source(mu))) for mu in mus]
    return [Step(mu, None, spectrum, found.verdict) for mu, spectrum, found in at]


def eigenvalue_rows(spectrum: Spectrum) -> list[dict[str, float]]:
    """Eigenvalues as JSON rows, sorted by frequency."""
    return [e.to_dict() for e in spectrum.eigenvalues]


def eigenvalue_table(spectrum: Spectrum) -> str:
    """Eigenvalues for people: mode, real part, imaginary part, frequency, damping ratio."""
    rows = [("  mode", "real, 1/s", "imag, rad/s", "frequency, Hz", "damping ratio")]
    for i, row in enumerate(eigenvalue_rows(spectrum), 1):
        rows.append((f"  {i}", *(number(value) for value in row.values())))  # type: ignore[arg-type]
    return elided(rows, "--json or --csv")


def shape_rows(shapes: Sequence[ModeShape], names: Sequence[str], rule: str) -> dict[str, Any]:
    """Mode shapes as a JSON object."""
    return {
        "coordinates": list(names),
        "normalisation": rule,
        "shapes": [
            {"mode": one.number}
            | picked(one, "frequency_hz growth_rate")
            | {"real": one.shape.real.tolist(), "imag": one.shape.imag.tolist()}
            for one in shapes
        ],
    }


def plain_shape_rows(spectrum: Spectrum) -> dict[str, Any]:
    """Mode shapes of a system whose coordinates have no names."""
    shapes = mode_shapes(spectrum)
    names = [f"q{i}" for i in range(1, 1 + (len(shapes[0].shape) if shapes else 0))]
    return shape_rows(shapes, names, "largest entry 1")


def root_row(e: Eigenvalue) -> dict[str, Any]:
    """An eigenvalue with its backward error and condition; None where that is infinite."""
    condition = e.condition if math.isfinite(e.condition) else None
    return e.to_dict() | {"residual": e.residual, "condition": condition}


def write_eigenvalues(path: Path, eigenvalues: Sequence[Eigenvalue]) -> None:
    """A row for each eigenvalue, as `root_row`."""
    units = {"real": "1/s", "imag": "rad/s", "frequency_hz": "", "damping_ratio": ""}
    columns = units | {"residual": "", "condition": ""}
    write_table(path, columns, ([*root_row(e).values()] for e in eigenvalues))


def sweep_rows(steps: Sequence[Step], contact: bool) -> list[dict[str, Any]]:
    """A JSON row for each mu; null where the branch does not reach it."""
    return [
        {"mu": s.mu}
        | ({"contact": s.contact} if contact else {})
        | {
            "eigenvalues": None if s.spectrum is None else eigenvalue_rows(s.spectrum),
            "verdict": s.verdict,
        }
        | ({} if s.admissible is None else {"admissible": s.admissible})
        for s in steps
    ]


def sweep_warnings(steps: Sequence[Step]) -> list[str]:
    """How many of the steps are not admissible, as a sentence, if some are not."""
    lost = [s.mu for s in steps if s.admissible is False]
    if not lost:
        return []
    return [
        f"sweep: {len(lost)} of {len(steps)} values of mu, the first of them {lost[0]:.6g}, have "
        "no equilibrium that the model means"
    ]


def _listed(hertz: Sequence[float]) -> str:
    more = f", {len(hertz) - LISTED} more" if len(hertz) > LISTED else ""
    return ", ".join(map(number, hertz[:LISTED])) + more


def sweep_text(steps: Sequence[Step], parameter: str = "mu") -> str:
    """The sweep for people: frequencies, which of them grow, how fast, and verdict at each mu."""
    head = ("contact", "frequencies, Hz", "growing, Hz", "largest real, 1/s", "verdict")
    rows: list[tuple[str, ...]] = [(f"  {parameter}", *head)]
    for s in steps:
        if s.spectrum is None:
            rows.append((f"  {s.mu:.6g}", "-", "-", "-", "-", "no equilibrium on the branch"))
            continue
        frequencies = _listed(s.spectrum.frequencies_hz.tolist())
        upper = [e for e in s.spectrum.eigenvalues if e.value.imag >= 0.0]
        grow = [e.frequency_hz for e in upper if e.growth_rate > NOISE * abs(e.value)]
        growth = number(s.spectrum.dominant.growth_rate)
        cells = (frequencies, _listed(grow) or "-", growth, s.verdict or "")
        rows.append((f"  {s.mu:.6g}", s.contact or "-", *cells))
    return elided(rows, "--json or --csv")


def _values(steps: Sequence[Step]) -> np.ndarray:
    size = max((len(s.spectrum) for s in steps if s.spectrum), default=0)
    blank = np.full(size, complex(np.nan, np.nan))
    return np.array([blank if s.spectrum is None else s.spectrum.values for s in steps])


def write_sweep(path: Path, steps: Sequence[Step]) -> None:
    """A row for each mu: contact, verdict, and the eigenvalues sorted by frequency."""
    values = _values(steps)
    parts = {"real": "1/s", "imag": "rad/s"}
    columns = dict.fromkeys(("mu", "contact", "verdict"), "") | {
        f"{part}_{i + 1}": unit for i in range(values.shape[1]) for part, unit in parts.items()
    }
    rows = (
        [s.mu, s.contact, s.verdict, *(float(p) for v in row for p in (v.real, v.imag))]
        for s, row in zip(steps, values, strict=True)
    )
    write_table(path, columns, rows)


def draw(
    path: Path, name: str, source: Scene | PlainSystem, low: float, high: float, own: float | None
) -> None:
    """Frequencies, growth rates and root locus over the parameter, saved as a figure."""
    from squeal.plots.coupling import save_coupling

    parameter = "mu" if isinstance(source, Scene) else source.parameter
    save_coupling(path, name, sweep_modes(source, low, high, parameter), own)
