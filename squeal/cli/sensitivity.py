"""What moves eigenvalues and thresholds, for `--sensitivity`: JSON rows and tables."""

import cmath
import math
from typing import Any

from squeal.analysis.eigenvalues import Analysis
from squeal.analysis.sensitivity import eigenvalue_sensitivities, threshold_sensitivities
from squeal.analysis.thresholds import CriticalFriction
from squeal.cli.tables import table
from squeal.io.scene import Scene
from squeal.model.pad import PARAMETERS, Pad

DEGREE = math.pi / 180


def _step(pad: Pad, name: str) -> tuple[float, str]:
    """The change of a parameter that a table shows: 1 per cent, of an angle one degree."""
    if PARAMETERS[name].angle:
        return DEGREE, "1 degree"
    return 0.01 * getattr(pad, name), "1 %"


def eigenvalue_moves(scene: Scene, analysis: Analysis) -> list[dict[str, Any]]:
    """d lambda/dp for each parameter, in the order of the eigenvalues; null at a coalescence."""
    return [
        {
            "parameter": name,
            "unit": PARAMETERS[name].unit,
            "eigenvalues": [
                {"real": d.real, "imag": d.imag} if cmath.isfinite(d) else None for d in slopes
            ],
        }
        for name, slopes in eigenvalue_sensitivities(scene, analysis).items()
    ]


def eigenvalue_moves_text(scene: Scene, analysis: Analysis, moves: list[dict[str, Any]]) -> str:
    """For people: what a small change of each parameter does to each mode."""
    values = analysis.spectrum.values
    modes = [i for i, value in enumerate(values) if value.imag >= 0.0]
    head = [f"{i + 1}: {part}" for i in modes for part in ("df, Hz", "dRe, 1/s")]
    rows = [("  parameter", "change", *head)]
    for move in moves:
        step, words = _step(scene.pad, move["parameter"])
        if not step:
            continue
        cells = []
        for i in modes:
            slope = move["eigenvalues"][i]
            if slope is None:
                cells += ["-", "-"]
            else:
                moved = (slope["imag"] / (2 * math.pi), slope["real"])
                cells += [f"{step * m + 0.0:+.3g}" for m in moved]  # no minus zero
        rows.append((f"  {move['parameter']}", words, *cells))
    title = "what a small change of a parameter does to each mode, the equilibrium moving with it\n"
    coincide = any(None in move["eigenvalues"] for move in moves)
    note = "\n('-': two eigenvalues coincide and part like a square root)" if coincide else ""
    return title + table(rows) + note


def threshold_moves(scene: Scene, found: CriticalFriction) -> dict[str, Any] | None:
    """d mu/dp of the first loss of stability for each parameter; None if there is none."""
    loss = found.first
    if loss is None:
        return None
    slopes = threshold_sensitivities(scene, loss)
    return {"mu": loss.mu, "kind": loss.kind, "parameters": slopes}


def threshold_moves_text(scene: Scene, moves: dict[str, Any] | None) -> str:
    """The same for people, to follow the thresholds."""
    if moves is None:
        return "\n\nstability is not lost, so nothing moves its loss"
    rows = [("  parameter", "change", "d mu")]
    for name, slope in moves["parameters"].items():
        step, words = _step(scene.pad, name)
        if step:
            rows.append((f"  {name}", words, f"{step * slope:+.3g}"))
    head = f"what moves the first loss ({moves['kind']} at mu = {moves['mu']:.6g})"
    return f"\n\n{head}\n{table(rows)}"
