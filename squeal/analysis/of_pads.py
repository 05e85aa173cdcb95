"""The verbs for a scene's pad: what `squeal.analysis.verbs` answers with, from the analyses."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from squeal.analysis import maps
from squeal.analysis.answers import (
    Eigenvalues,
    Map,
    Sensitivity,
    Step,
    Sweep,
    Thresholds,
    root_row,
    shape_rows,
)
from squeal.analysis.eigenvalues import (
    Analysis,
    analyse,
    article_linearisation,
    growing_modes,
    sweep_mu,
)
from squeal.analysis.maps import QUANTITIES, field_of
from squeal.analysis.modes import shapes_of_pad
from squeal.analysis.sensitivity import (
    eigenvalue_sensitivities,
    threshold_sensitivities,
)
from squeal.analysis.stack import parameters
from squeal.analysis.threshold_curve import threshold_curves
from squeal.analysis.thresholds import critical_friction
from squeal.errors import InputWarning
from squeal.io.answer import number, unit_word
from squeal.io.scene import Scene
from squeal.model.pad import PARAMETERS

PLACE = ("x", "y", "theta")


def eigenvalues(scene: Scene, at: float | None = None) -> Eigenvalues:
    """The sliding equilibrium's eigenvalues, beside those of the article's linearisation."""
    scene = scene if at is None else scene.replace(mu=at)
    found = analyse(scene)
    details: dict[str, Any] = {
        "model": found.model,
        "equilibrium": dict(zip(PLACE, found.q, strict=True))
        | {"R_n": found.R_n, "contact": found.contact},
        "how": found.how,
        **{name: getattr(found.matrices, name).tolist() for name in ("M", "C", "K")},
        "basis": None,
    }
    place = ", ".join(
        f"{name} = {number(value)} {unit}"
        for name, value, unit in zip(PLACE, found.q, ("m", "m", "rad"), strict=True)
    )
    reaction = "" if found.R_n is None else f", R_n = {number(found.R_n)} N"
    notes = [f"model {found.model}: {place}, contact {found.contact}{reaction}\n({found.how})"]
    if not scene.pad_model.linear:
        origin = article_linearisation(scene)
        details["origin"] = {
            "K": origin.matrices.K.tolist(),
            "eigenvalues": [root_row(root) for root in origin.spectrum.eigenvalues],
            "verdict": origin.judgement.verdict,
        }
        hertz = ", ".join(map(number, origin.frequencies_hz))
        notes.append(
            "beside it, about the origin in full contact (the article's linearisation): "
            f"{origin.judgement.verdict}, {hertz} Hz"
        )
    return Eigenvalues(
        scene.model,
        "mu",
        scene.pad.mu,
        found.spectrum.eigenvalues,
        found.judgement.verdict,
        str(found.judgement),
        growing_modes(scene, found),
        certified=True,
        count=len(found.spectrum),
        shapes=shape_rows(shapes_of_pad(found, scene.pad.w), PLACE, "largest of x, y, w theta 1 m"),
        details=details,
        notes=tuple(notes),
        warnings=found.warnings,
        source=(scene, found),
    )


def sweep(scene: Scene, values: Sequence[float]) -> Sweep:
    """The eigenvalues along the branch from mu = 0."""

    def step(mu: float, found: Analysis | None) -> Step:
        if found is None:
            return Step(mu, None, None, None, None, False)
        roots, verdict = found.spectrum.values, found.judgement.verdict
        errors = np.array([root.residual for root in found.spectrum.eigenvalues])
        return Step(mu, roots, errors, verdict, found.contact, found.admissible)

    steps = tuple(step(mu, found) for mu, found in sweep_mu(scene, values))
    return Sweep(scene.model, "mu", steps, source=scene)


def thresholds(scene: Scene, high: float) -> Thresholds:
    """The thresholds along the branch from mu = 0."""
    return critical_friction(scene, high)


def _axis(given: Any) -> maps.Axis:
    if isinstance(given, maps.Axis):
        return given
    return maps.Axis(given.name, given.low, given.high, given.n, given.log)


def map_over(
    scene: Scene,
    axes: tuple[Any, Any] | None = None,
    quantity: str | None = None,
    curves: bool = False,
) -> Map:
    """The verdict over two parameters of the scene."""
    pair = maps.angle_axes(200) if axes is None else (_axis(axes[0]), _axis(axes[1]))
    found = maps.stability_map(scene, pair)
    shown = None if quantity is None else field_of(scene, pair, quantity)
    lines = threshold_curves(scene, pair, found.codes) if curves else None
    details: dict[str, Any] = {}
    if lines is not None:
        details["threshold_curve"] = [
            {"kind": line.kind, "closed": line.closed}
            | {"points": line.points.tolist(), "frequency_hz": line.frequency_hz.tolist()}
            for line in lines
        ]
    units = tuple(unit_word(PARAMETERS[axis.name].unit) for axis in pair)
    values: Any = None
    notes: tuple[str, ...] = ()
    if shown is not None:
        values = (shown.quantity, unit_word(shown.unit), shown.values)
        known = shown.values[np.isfinite(shown.values)]
        span = f"{known.min():.6g} to {known.max():.6g} {values[1]}" if known.size else "nowhere"
        notes = (f"{QUANTITIES[shown.quantity][0]}: {span}",)
        for words in shown.warnings:  # of the quantity; those of the record are of equilibria
            warnings.warn(words, InputWarning, stacklevel=4)
    return Map(
        scene.model,
        pair,
        (units[0], units[1]),
        maps.NAMES,
        found.codes,
        values,
        None if scene.pad_model.linear else found.admissible,
        found.warnings,
        {"admissible_share": float(found.admissible.mean())} | details,
        notes,
        (scene, found, shown, lines),
    )


def sensitivity(scene: Scene, of: str, high: float, known: Any = None) -> Sensitivity:
    """What moves the eigenvalues, or the first loss of stability; `known`: its answer."""
    slopes: dict[str, np.ndarray] = {}
    if of == "eigenvalues":
        analysis = analyse(scene) if known is None else known.source[1]
        place, kind = analysis.spectrum.values, analysis.judgement.verdict
        slopes = eigenvalue_sensitivities(scene, analysis)
    else:
        first = (thresholds(scene, high) if known is None else known).first
        place, kind = (None, "") if first is None else (first.mu, first.kind)
        if first is not None:
            moved = threshold_sensitivities(scene, first)
            slopes = {name: np.array([slope]) for name, slope in moved.items()}
    names = parameters(scene.pad_model)
    return Sensitivity(
        of,
        "mu",
        place,
        kind,
        slopes,
        {name: getattr(scene.pad, name) for name in names},
        {name: PARAMETERS[name].unit for name in names},
        frozenset(name for name in names if PARAMETERS[name].angle),
    )
