"""Plain systems M, C, K(mu) in the stability queries: recognised by their key M."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from squeal.commands.base import table
from squeal.critical import CriticalFriction
from squeal.errors import InputError
from squeal.scene.document import read_document
from squeal.scene.values import Keys
from squeal.stability import (
    PlainSystem,
    Spectrum,
    complex_eigenvalues,
    critical_points,
    judge,
    plain_system,
    verdict,
)


def read_if_plain(path: Path) -> PlainSystem | None:
    """The plain system in a file, None if the file is a scene. Raises InputError."""
    document = read_document(path)
    return plain_system(document, Keys(str(path))) if "M" in document else None


def value_of(given: str | None, system: PlainSystem | None) -> float:
    """The parameter of a plain system that `--at` names, 0 if it is left out.

    Raises InputError, also where a scene is given, whose friction stands in its file.
    """
    if given is None:
        return 0.0
    try:
        value = float(given)
    except ValueError:
        value = math.nan
    if system is None or not math.isfinite(value):
        raise InputError(
            f"--at {given}: is not allowed; it must be a finite number, and goes with a plain "
            "system only (the friction of a scene stands in its file)"
        )
    return value


def eigenvalue_rows(spectrum: Spectrum) -> list[dict[str, float]]:
    """Eigenvalues as JSON rows, sorted by frequency."""
    return [
        {
            "real": e.value.real,
            "imag": e.value.imag,
            "frequency_hz": e.frequency_hz,
            "damping_ratio": e.damping_ratio,
        }
        for e in spectrum.eigenvalues
    ]


def eigenvalue_table(spectrum: Spectrum) -> str:
    """Eigenvalues for people: mode, real part, imaginary part, frequency, damping ratio."""
    rows = [("  mode", "real, 1/s", "imag, rad/s", "frequency, Hz", "damping ratio")]
    for i, e in enumerate(spectrum.eigenvalues, 1):
        numbers = (e.value.real, e.value.imag, e.frequency_hz, e.damping_ratio)
        rows.append((f"  {i}", *(f"{value:.6g}" for value in numbers)))  # type: ignore[arg-type]
    return table(rows)


def eigenvalue_data(system: PlainSystem, mu: float, mus: list[float] | None) -> dict[str, Any]:
    """The answer of `squeal eigenvalues` on a plain system."""
    M, C, K = system(mu)
    found: dict[str, Any] = {
        "name": system.name,
        system.parameter: mu,
        "M": M.tolist(),
        "C": (np.zeros_like(M) if C is None else C).tolist(),
        "K": K.tolist(),
        "eigenvalues": eigenvalue_rows(complex_eigenvalues(M, C, K)),
        "verdict": judge(M, C, K).verdict,
    }
    if mus:
        found["sweep"] = [
            {
                "mu": value,
                "eigenvalues": eigenvalue_rows(complex_eigenvalues(*system(value))),
                "verdict": verdict(*system(value)),
            }
            for value in mus
        ]
    return found


def eigenvalue_text(system: PlainSystem, mu: float, mus: list[float] | None) -> str:
    """The same for people."""
    matrices = system(mu)
    parts = [
        f"{system.name}, {system.parameter} = {mu:g}",
        eigenvalue_table(complex_eigenvalues(*matrices)),
        f"verdict: {judge(*matrices)}",
    ]
    if mus:
        rows = [(f"  {system.parameter}", "largest real, 1/s", "verdict")]
        for value in mus:
            growth = complex_eigenvalues(*system(value)).dominant.growth_rate
            rows.append((f"  {value:.6g}", f"{growth:.6g}", verdict(*system(value))))
        parts.append(table(rows))
    return "\n\n".join(parts)


def critical(system: PlainSystem, mu_max: float) -> CriticalFriction:
    """Thresholds of a plain system in its parameter, as for a scene."""
    return CriticalFriction(
        verdict(*system(0.0)),
        tuple(critical_points(system, mu_max)),
        mu_max,
        f"{system.parameter} = {mu_max:g} is reached",
    )
