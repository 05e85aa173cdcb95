"""`squeal article sliding`: Eq. (22), the bounds (23a, b), and all sliding equilibria.

squeal article sliding pad.yaml
squeal article sliding b3.yaml --figure fig13.png
"""

import argparse
import math
from dataclasses import replace
from operator import itemgetter
from typing import Any

import numpy as np

from squeal.article.equations import bounds, mismatch, rank, stiffness
from squeal.cli.command import Parser, Reply
from squeal.cli.options import as_typed, take_files
from squeal.equilibrium import Equilibrium, find_all, sliding_equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.io.writing import Column, Table, copied_attributes, number
from squeal.io.writing import aligned_text as table
from squeal.linear import Judgement, judge
from squeal.queries.pads.equilibrium import at_equilibrium

SAME = 1e-9  # of h K11: within rounding of K
UNITS = {"x": "m", "y": "m", "theta": "rad", "R_n": "N", "delta": "m"}
UNITS |= dict.fromkeys(("contact", "verdict", "admissible"), "")
COLUMNS = [Column(name, unit, itemgetter(name)) for name, unit in UNITS.items()]


def judged_equilibria(scene: Scene) -> list[tuple[Equilibrium, Judgement]]:
    """All sliding equilibria at the scene's mu with the verdict on each, least potential first.

    `squeal eigenvalues` takes the equilibrium that is `on_branch`, or the first of the list if the
    branch from mu = 0 does not reach the scene's mu. In that case `beyond` of every equilibrium
    says why the branch ends earlier; else it is empty.
    """
    model = damped_model(scene)
    lever = np.array([1.0, 1.0, scene.pad.w])  # displacements of (x, y, theta) in m
    equilibria = find_all(model)  # which leaves `on_branch` and `beyond` empty
    taken, _ = sliding_equilibrium(model)  # which fills in both
    if taken is not None:
        # `taken` replaces the one of the list that is the same to within Newton's accuracy
        same = 1e-6 * np.abs(taken.q * lever).max()
        others = []
        for other in equilibria:
            distance = np.abs(np.subtract(other.q, taken.q) * lever).max()
            if distance > same:
                others.append(replace(other, beyond=taken.beyond))
        equilibria = sorted([taken, *others], key=lambda equilibrium: equilibrium.potential)
    return [(equilibrium, judge(*at_equilibrium(model, equilibrium))) for equilibrium in equilibria]


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def data(scene: Scene) -> dict[str, Any]:
    """The answer as a JSON object.

    Where K21 = 0 friction has no bound: both bounds are null, and `holds_as_printed` is true.
    `holds_sign_aware` tells whether the complete necessary conditions hold; scripts rely on the
    key's name. `K31_mismatch` is K31/(h K11) - 1, null where K11 = 0: with friction the three rows
    of Eq. (21) hold together only where it is zero. `admissible` is about the equilibrium that
    `squeal eigenvalues` takes.
    """
    pad = scene.pad
    K = stiffness(pad)
    limits = bounds(pad)
    answer: dict[str, Any] = {
        "K": K.tolist(),
        "determinant": float(np.linalg.det(K)),
        "rank": rank(pad, K),
        "printed_K33_singular": rank(pad, stiffness(pad, printed=True)) < 3,
        "bound_23a": _finite(limits.bound_23a),
        "bound_23b": _finite(limits.bound_23b),
        "holds_as_printed": bool(limits.as_printed),
        "holds_sign_aware": bool(limits.complete),
        "K31_mismatch": _finite(mismatch(pad)),
    }
    if not scene.pad_model.linear:
        judged = judged_equilibria(scene)
        # the equilibrium on the branch, else the first one
        first = judged[0][0] if judged else None
        taken = next((equilibrium for equilibrium, _ in judged if equilibrium.on_branch), first)
        answer["admissible"] = taken is not None and taken.admissible
        answer["equilibria"] = []
        for equilibrium, judgement in judged:
            row: dict[str, Any] = dict(zip(("x", "y", "theta"), equilibrium.q, strict=True))
            row |= copied_attributes(equilibrium, "R_n delta")
            row["contact"] = scene.pad_model.state_name(equilibrium.state)
            row["verdict"] = judgement.verdict
            row |= copied_attributes(equilibrium, "on_branch admissible")
            row["warnings"] = list(equilibrium.warnings)
            answer["equilibria"].append(row)
    return answer


def _moment_entry(answer: dict[str, Any]) -> str:
    """K31 over h K11 in words, and what follows where the two differ."""
    missed = answer["K31_mismatch"]
    if missed is None:
        return "K11 = 0"
    entry = f"K31 = {number(1.0 + missed)} h K11"
    return entry if abs(missed) < SAME else f"{entry}, so that there is no such state"


def text(answer: dict[str, Any]) -> str:
    """The answer for people, from the JSON object that `data` makes."""
    K = [[number(v) for v in row] for row in answer["K"]]
    rank_word = "singular" if answer["rank"] < 3 else "regular"

    def bound(key: str) -> str:
        return "none (K21 = 0)" if answer[key] is None else f"mu < {number(answer[key])}"

    yes_or_no = {True: "yes", False: "no"}
    as_printed = yes_or_no[answer["holds_as_printed"]]
    if answer["bound_23a"] is None and answer["bound_23b"] is None:
        as_printed = "nothing is bounded"
    parts = [
        "K of Eq. (22), N/m, N and N m\n" + table([("  ", *row) for row in K]),
        (
            f"rank {answer['rank']} ({rank_word}); with K33 as printed "
            f"{'singular' if answer['printed_K33_singular'] else 'regular'}"
        ),
        (
            f"(23a) {bound('bound_23a')}; (23b) {bound('bound_23b')}; "
            f"hold as printed: {as_printed}\n"
            f"complete necessary conditions hold: {yes_or_no[answer['holds_sign_aware']]}; their "
            f"state, with y = theta = delta = 0, needs K31 = h K11 under friction; here "
            f"{_moment_entry(answer)}"
        ),
    ]
    if "equilibria" in answer:
        heads = [f"{name}, {unit}" if unit else name for name, unit in UNITS.items()]
        rows = [heads]
        for e in answer["equilibria"]:
            row = [number(e[key]) for key in ("x", "y", "theta", "R_n", "delta")]
            rows.append([*row, e["contact"], e["verdict"], yes_or_no[e["admissible"]]])
        for row in rows:
            row[0] = f"  {row[0]}"  # indents the table
        listed = "sliding equilibria, least potential energy first\n" + table(rows)
        if not answer["equilibria"]:
            listed = "no sliding equilibrium was found: no steady sliding exists near the pad"
        parts.append(listed)
    return "\n\n".join(parts)


def _warnings(answer: dict[str, Any]) -> list[str]:
    """Why the equilibrium that is taken is not admissible, and how many of the others are not."""
    rows = answer.get("equilibria", [])
    taken = next((row for row in rows if row["on_branch"]), rows[0] if rows else None)
    others = [row for row in rows if row is not taken and not row["admissible"]]
    more = f"{len(others)} of the {len(rows)} equilibria listed are none that the model means"
    return (taken["warnings"] if taken else []) + ([more] if others else [])


def options(parser: Parser) -> None:
    """Options of `squeal article sliding`."""
    map_of_angles = "where (23a, b) hold over both spring angles, as in Fig. 13,"
    take_files(parser, table="the equilibria", figure=map_of_angles)


def run(given: argparse.Namespace) -> Reply:
    """Read the scene and answer."""
    scene = given.source.scene()
    if given.table is not None and scene.pad_model.linear:
        raise InputError(
            f"{as_typed(given, 'table')}: is not allowed with model B3, "
            "which has no equilibria to write; a scene of B1 or B2 is allowed"
        )
    answer = data(scene)
    if given.figure is not None:
        from squeal.article.figures.quasi_static import draw_conditions  # loads matplotlib
        from squeal.plots.style import save

        save(draw_conditions(scene.pad), given.figure)
    if given.table is not None:
        Table(COLUMNS, answer["equilibria"]).save(given.table)
    return Reply(lambda: answer, lambda: text(answer), warnings=_warnings(answer))
