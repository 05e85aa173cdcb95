"""`squeal eigenvalues`: complex eigenvalue analysis of the sliding equilibrium."""

import argparse
from typing import Any

import numpy as np

from squeal.analysis.eigenvalues import (
    Analysis,
    analyse,
    article_linearisation,
    growing_modes,
    roots_and_verdict,
)
from squeal.analysis.modes import PAD_COORDINATES, shapes_of_pad
from squeal.cli import sweep as sweeps
from squeal.cli import unstable
from squeal.cli.base import Answer, Parser
from squeal.cli.numbers import spaced
from squeal.cli.outputs import file_options, option_of
from squeal.cli.plain import refuse_sensitivity, value_of
from squeal.cli.sensitivity import eigenvalue_moves, eigenvalue_moves_text
from squeal.cli.system_options import refuse_options, system_of, work_options
from squeal.cli.system_shapes import OPTIONS as SHAPE
from squeal.cli.system_shapes import shape_options
from squeal.cli.tables import in_words, number
from squeal.io.scene import Scene
from squeal.io.short_form import PlainSystem
from squeal.io.writing import picked
from squeal.linear import Spectrum


def options(parser: Parser) -> None:
    """Options of `squeal eigenvalues`."""
    parser.add_argument(
        "--mu",
        "--sweep",
        dest="mu",
        metavar="A:B:N",
        help="also sweep mu, or a system's parameter, from A to B, N values",
    )
    parser.add_argument("--modes", metavar="N", help="systems only: the N lowest modes")
    parser.add_argument(
        "--region", metavar="RE0:RE1:IM0:IM1", help="systems only: roots of a region, 1/s and rad/s"
    )
    parser.add_argument(
        "--method",
        metavar="NAME",
        help="of a system's sweep: full, reduced (complex modes, certified) or modal (real modes)",
    )
    work_options(parser)
    parser.add_argument(
        "--at", metavar="MU", help="systems only: value of the parameter (0, or the file's)"
    )
    parser.add_argument(
        "--sensitivity",
        action="store_true",
        help="how each eigenvalue moves with each parameter of a scene",
    )
    unstable.filter_options(parser)
    file_options(
        parser,
        table="write the eigenvalues, or those of the sweep, to FILE",
        figure="draw them into FILE",
    )
    shape_options(parser)


def data(analysis: Analysis) -> dict[str, Any]:
    """What was found about one equilibrium, as a JSON object."""
    at = dict(zip(("x", "y", "theta"), analysis.q, strict=True))
    return {
        "equilibrium": at | picked(analysis, "R_n contact"),
        "how": analysis.how,
        **{name: getattr(analysis.matrices, name).tolist() for name in ("M", "C", "K")},
        "eigenvalues": sweeps.eigenvalue_rows(analysis.spectrum),
        "verdict": analysis.judgement.verdict,
        "criterion": str(analysis.judgement),
    }


def text(analysis: Analysis) -> str:
    """The same for people."""
    x, y, theta = analysis.q
    reaction = "" if analysis.R_n is None else f", R_n = {number(analysis.R_n)} N"
    return (
        f"model {analysis.model}: x = {number(x)} m, y = {number(y)} m, "
        f"theta = {number(theta)} rad, contact {analysis.contact}{reaction}\n({analysis.how})\n\n"
        f"{sweeps.eigenvalue_table(analysis.spectrum)}\n\n"
        f"verdict: {in_words(str(analysis.judgement))}"
    )


def beside_text(origin: Analysis) -> str:
    """The linearisation about the origin for people."""
    frequencies = ", ".join(number(e.frequency_hz) for e in origin.spectrum.eigenvalues[::2])
    growth = number(origin.spectrum.dominant.growth_rate)
    return (
        f"beside it, about the origin in full contact (the article's linearisation): "
        f"{in_words(origin.judgement.verdict)}, {frequencies} Hz, largest real part {growth} 1/s"
    )


def of_plain(given: argparse.Namespace, system: PlainSystem, mus: list[float] | None) -> Answer:
    """The answer for a plain system."""
    at = value_of(given.at, system)
    M, C, K = matrices = system(at)
    spectrum, judgement = roots_and_verdict(*matrices)
    grow, chosen = unstable.of_system(system, at), unstable.filter_of(given)
    listed = chosen(grow)
    steps = sweeps.sweep(system, mus) if mus else []
    write_tables(given, spectrum, steps)
    if given.figure is not None:
        from squeal.plots.modes import eigenvalue_figure, save_modes

        name, values = given.source.name, spectrum.values
        if mus:
            sweeps.draw(
                given.figure, name, system, mus[0], mus[-1], None if given.at is None else at
            )
        else:
            save_modes(given.figure, name, eigenvalue_figure(values), values)
    found: dict[str, Any] = {"name": system.name} | {system.parameter: at}  # its name may be one
    found |= picked(system, "name parameter") | {
        "parameters": {system.parameter: at},
        "M": M.tolist(),
        "C": (np.zeros_like(M) if C is None else C).tolist(),
        "K": K.tolist(),
        "eigenvalues": [e.to_dict() | {"residual": e.residual} for e in spectrum.eigenvalues],
        "unstable": unstable.unstable_rows(listed),
        "mode_shapes": sweeps.plain_shape_rows(spectrum),
        "verdict": judgement.verdict,
        "criterion": str(judgement),
        "certified": len(spectrum) == 2 * system.n,
        "count": 2 * system.n,
        "basis": None,
    }
    parts = [
        f"{system.name}, {system.parameter} = {number(at)}",
        sweeps.eigenvalue_table(spectrum),
        f"verdict: {in_words(str(judgement))}",
        unstable.unstable_text(listed, chosen, len(grow), system.parameter),
    ]
    return Answer(
        lambda: found | ({"sweep": sweeps.sweep_rows(steps, contact=False)} if steps else {}),
        lambda: "\n\n".join(
            parts + ([sweeps.sweep_text(steps, system.parameter)] if steps else [])
        ),
    )


def of_scene(given: argparse.Namespace, scene: Scene, mus: list[float] | None) -> Answer:
    """The answer for a scene."""
    analysis = analyse(scene)
    grow, chosen = growing_modes(scene, analysis), unstable.filter_of(given)
    listed = chosen(grow)
    origin = None if scene.pad_model.linear else article_linearisation(scene)
    steps = sweeps.sweep(scene, mus) if mus else []
    moves = eigenvalue_moves(scene, analysis) if given.sensitivity else None
    shapes = shapes_of_pad(analysis, scene.pad.w)
    write_tables(given, analysis.spectrum, steps)
    if given.figure is not None:
        from squeal.plots.modes import pad_figure, save_modes

        name, values = given.source.name, analysis.spectrum.values
        if mus:
            sweeps.draw(given.figure, name, scene, mus[0], mus[-1], scene.pad.mu)
        else:
            beside = None if origin is None else origin.spectrum.values
            figure = pad_figure(scene.pad, analysis.q, shapes, values, beside)
            save_modes(given.figure, name, figure, values)

    def full() -> dict[str, Any]:
        found = data(analysis) | {
            "unstable": unstable.unstable_rows(listed),
            "mode_shapes": sweeps.shape_rows(
                shapes, PAD_COORDINATES, "largest of x, y, w theta 1 m"
            ),
        }
        if origin is not None:
            found["origin"] = {
                "K": origin.matrices.K.tolist(),
                "eigenvalues": sweeps.eigenvalue_rows(origin.spectrum),
                "verdict": origin.judgement.verdict,
            }
        if steps:
            found["sweep"] = sweeps.sweep_rows(steps, contact=True)
        if moves is not None:
            found["sensitivity"] = moves
        return found

    def shown() -> str:
        parts = [text(analysis), unstable.unstable_text(listed, chosen, len(grow))]
        if origin is not None:
            parts.append(beside_text(origin))
        if steps:
            parts.append("sweep of mu along the branch\n" + sweeps.sweep_text(steps))
        if moves is not None:
            parts.append(eigenvalue_moves_text(scene, analysis, moves))
        return "\n\n".join(parts)

    return Answer(full, shown, warnings=[*analysis.warnings, *sweeps.sweep_warnings(steps)])


def write_tables(given: argparse.Namespace, spectrum: Spectrum, steps: list[sweeps.Step]) -> None:
    """Write the table that is asked for: of the sweep if there is one."""
    if given.table is not None:
        if steps:
            sweeps.write_sweep(given.table, steps)
        else:
            sweeps.write_eigenvalues(given.table, spectrum.eigenvalues)


def run(given: argparse.Namespace) -> Answer:
    """Read the scene or plain system and analyse it."""
    matrices = system_of(given)
    if matrices is not None:
        from squeal.cli.systems import eigenvalues_of

        return eigenvalues_of(given, matrices)
    system = given.source.system()
    ends = (0.0, 1e3) if system is None else ()  # of friction; a parameter may take any value
    mus = spaced(given.mu, option_of(given, "mu"), *ends) if given.mu else None
    refuse_options(given, ("modes", "region", "method", *SHAPE))
    value_of(given.at, system)
    if given.sensitivity:
        refuse_sensitivity(given.source.name, system)
    if system is not None:
        return of_plain(given, system, mus)
    return of_scene(given, given.source.scene(), mus)
