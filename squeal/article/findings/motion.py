"""Findings that need the article's cases in motion, their equilibria, or maps over the angles."""

import dataclasses
import itertools
import math
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from squeal.article.cases import stem, title
from squeal.article.claims import Case, judge_claims, measure
from squeal.article.claims.measures import linear_measures
from squeal.article.equations import (
    balanced,
    mismatch,
    quasi_static_map,
    row_pairs,
    stiffness,
)
from squeal.article.findings.equations import Measured, partial_contact_energy
from squeal.article.findings.work import contact_work
from squeal.article.records import bound, rounded_up
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.contact import FORMULATION_CHOICES, NONE, STATES, LineForce, contact_law
from squeal.model.equations import PadModel
from squeal.queries.pads.maps import angle_axes, stability_map
from squeal.simulation.run import Simulation, simulate

ROUNDING = 1e-9  # share of the kinetic energy: less than that is no work
# cells a side of maps without and with a search for equilibria
GRID = 200  # a side of maps without equilibria
COARSE = 24  # a side of the map for which equilibria are searched


@dataclasses.dataclass(frozen=True)
class Study:
    """The eight scenes by case, simulated once for all findings; `b3` is the scene of Fig. 13."""

    b1: Mapping[str, Scene]
    b2: Mapping[str, Scene]
    b3: Scene

    @property
    def scenes(self) -> dict[str, Scene]:
        """The eight scenes by name: b1-a to b2-d."""
        scenes = {stem("B1", case): scene for case, scene in self.b1.items()}
        scenes |= {stem("B2", case): scene for case, scene in self.b2.items()}
        return scenes

    @cached_property
    def cases(self) -> dict[str, Case]:
        """Measures of the scenes by name."""
        return {key: measure(scene) for key, scene in self.scenes.items()}

    @cached_property
    def runs(self) -> dict[str, Simulation]:
        """All eight runs with events and histories, by name of the scene."""
        runs = {}
        for name, scene in self.scenes.items():
            runs[name] = simulate(dataclasses.replace(scene, outputs=("events", "history")))
        return runs

    def reproduced(self, changed: dict[str, Case]) -> int:
        """How many claims hold with the measures of some scenes replaced."""
        linear = linear_measures({case: scene.pad for case, scene in self.b2.items()}, GRID)
        return sum(j.holds for j in judge_claims(self.cases | changed | {"b3": linear}))


def flipped(scene: Scene, switch: str) -> Scene:
    """The scene with the other choice of one switch of its formulation."""
    now = getattr(scene.formulation, switch)
    (other,) = (choice for choice in FORMULATION_CHOICES[switch] if choice != now)
    changed: Any = {switch: other}
    return dataclasses.replace(scene, formulation=dataclasses.replace(scene.formulation, **changed))


def _positions(run: Simulation) -> np.ndarray:
    """x and y (2, samples) over a run."""
    assert run.history is not None
    return np.array([run.history[key] for key in ("x", "y")])


def switch_effect(switch: str) -> Callable[[Study], Measured]:
    """E5, E6: what the other choice of a switch does to the four B2 runs and to the claims.

    switch: "delta_from" or "delta_moment", a field of `Formulation` with two choices.
    """

    def effect(study: Study) -> Measured:
        """Simulate and measure the four B2 cases with the other choice of `switch`."""
        final_change = 0.0  # of the position, over the range of the motion
        ended = []
        measured = {}
        for case, scene in study.b2.items():
            name = stem("B2", case)
            other = flipped(scene, switch)
            try:
                changed = _positions(simulate(dataclasses.replace(other, outputs=("history",))))
                measured[name] = measure(other)
            except ComputationError:  # the motion leaves the model
                ended.append(case)
                continue
            unchanged = _positions(study.runs[name])
            size = np.ptp(unchanged, axis=1).max()
            change = np.abs((changed - unchanged)[:, -1]).max()
            final_change = max(final_change, float(change / size))
        before = study.reproduced({})
        numbers = {"apart": final_change, "before": float(before), "ended": float(len(ended))}
        text = (
            f"With the other sign or frame in all four cases, the final position changes by up to "
            f"{rounded_up(final_change):.2g} times the range of the motion; "
        )
        if ended:
            text += f"in case {', '.join(ended)} the pad turns over, where the model ends."
            return Measured(numbers, text)
        after = study.reproduced(measured)
        numbers["after"] = float(after)
        if after == before:
            text += f"{after} statements are reproduced, as before."
        else:
            text += f"{after} statements are reproduced and not {before}."
        return Measured(numbers, text)

    return effect


def fed_by_the_law(study: Study) -> Measured:
    """E4: work of each contact law on a closed path, and in the motion of case c, which hammers.

    `works.fed` is the work of the normal reaction beyond what its potential gives back: 0 to
    rounding for a law that has a potential.
    """
    scene = study.b2["c"]
    path = partial_contact_energy(scene.pad)
    numbers = dict(path.numbers)
    text = path.outcome
    laws: dict[LineForce, str] = {"mean": "the printed law", "integral": "the consistent law"}
    for law, law_name in laws.items():
        formulation = dataclasses.replace(scene.formulation, line_force=law)
        varied = dataclasses.replace(scene, formulation=formulation)
        try:
            works = contact_work(varied)
            case = measure(varied)
        except ComputationError as error:
            text += f" In case c under {law_name} the model ends: {error}."
            continue
        fed = works.fed / works.kinetic
        edge_changes = case.blows[0]  # by blows of at least the first of `LEVELS`
        numbers |= {f"fed_{law}": fed, f"turns_{law}": float(edge_changes)}
        work = f"{works.fed:+.2g} J"
        share = f"{fed:+.2g}"
        if abs(fed) < ROUNDING:
            work = "0 J"
            share = f"less than {bound(fed)}"
        text += (
            f" In case c {law_name} does the work {work} ({share} of the greatest kinetic energy; "
            f"friction {works.friction:.2g} J), delta/w goes from "
            f"{case.second.low:.2f} to {case.second.high:.2f}, and the edge struck changes "
            f"{edge_changes} times."
        )
    return Measured(numbers, text)


def static_balance(study: Study) -> Measured:
    """E7: tilt in case b, and the position of the reaction at its sliding equilibrium."""
    case = study.cases["b2-b"]
    scene = study.b2["b"]
    tilt = case.tilt
    numbers = {"tilt_low": tilt.low, "tilt_high": tilt.high}
    text = f"Tilt in B2 case b lies between {tilt.low:.2g} and {tilt.high:.2g} rad. "
    level = PadModel("B2", scene.pad.replace(y0=0.0, theta0=0.0))
    models = (
        ("delta_0", "with the reference set", scene.pad_model),
        ("delta_1", "with y0 = theta0 = 0", level),
    )
    for key, condition, model in models:
        equilibrium, _ = sliding_equilibrium(model)
        text += f"Static balance {condition} "
        if equilibrium is None:
            text += "is not possible. "
        else:
            numbers[key] = equilibrium.delta / scene.pad.w
            text += f"requires delta/w = {numbers[key]:+.3f}. "
    return Measured(numbers, text.strip())


def states_met(study: Study) -> Measured:
    """E8: shares of the four states in case d of B1."""
    shares = study.cases["b1-d"].shares
    numbers = {}
    for state in STATES:
        numbers[f"state_{contact_law('B1').state_name(state)}"] = shares.get(state, 0.0)
    in_order = ", ".join(f"{100 * numbers[key]:.2f}" for key in sorted(numbers))
    return Measured(numbers, f"Shares of the states 1 to 4 in case d: {in_order} %.")


def sliding_conditions(study: Study) -> Measured:
    """E9: shares of the map as printed and complete, and where B2 has a sliding equilibrium.

    In (a) and (b) also the displacements that rows 1 and 2, and rows 2 and 3, of Eq. (21) give.
    """
    share = quasi_static_map(study.b3.pad, GRID).share
    least_mismatch = min(abs(mismatch(scene.pad)) for scene in study.b2.values())
    rows = {case: row_pairs(study.b2[case].pad) for case in ("a", "b")}
    # the branch of equilibria from mu = 0 reaches the pad's mu unless it turns back in a fold
    reached = 1.0 - stability_map(study.b2["c"], angle_axes(COARSE)).share["beyond a fold"]
    numbers = share.to_dict() | {"least_mismatch": least_mismatch, "equilibrium": reached}
    for case, pairs in rows.items():
        numbers |= {f"x_12_{case}": pairs.x_12, f"x_23_{case}": pairs.x_23}

    def micrometres(name: str) -> str:
        """A field of the row pairs, of each case in turn."""
        return " and ".join(f"{1e6 * getattr(pairs, name):+.2f} um" for pairs in rows.values())

    return Measured(
        numbers,
        f"As printed (23) holds on {100 * share.as_printed:.1f} % of the map, the complete "
        f"conditions on {100 * share.complete:.1f} %. Rows 1 and 2 require x = "
        f"{micrometres('x_12')} in cases a and b, rows 2 and 3 require {micrometres('x_23')}; K31 "
        f"misses h K11 by at least {100 * least_mismatch:.3g} % in the four cases. Followed from "
        f"mu = 0, "
        f"B2 has an equilibrium on {100 * reached:.0f} % ({COARSE} x {COARSE} points).",
    )


def springs_alone(study: Study) -> Measured:
    """E12: flutter by K of Eq. (22) alone, and with contact and friction included."""
    imaginary = 0.0
    for scene in study.b2.values():
        pad = scene.pad
        # (M^-1/2 K M^-1/2) u = omega^2 u, rotation measured as w theta
        inverse_mass_root = 1.0 / np.sqrt(np.array([pad.m, pad.m, pad.I / pad.w**2]))
        K = balanced(pad, stiffness(pad))
        squares = np.linalg.eigvals(inverse_mass_root[:, None] * K * inverse_mass_root)
        imaginary = max(imaginary, float(np.abs(squares.imag).max() / np.abs(squares).max()))
    flutter = stability_map(study.b3, angle_axes(GRID)).share["flutter"]
    return Measured(
        {"imaginary": imaginary, "flutter": flutter},
        f"Its squared frequencies are real (greatest imaginary part {imaginary:.1g} of the "
        "greatest), so it never shows flutter; with contact and friction the linearisation about "
        "the origin "
        f"flutters on {100 * flutter:.1f} % of the map.",
    )


def simultaneous(study: Study) -> Measured:
    """E13: contact changes at one and the same instant among all of B1's."""
    together = 0
    total = 0
    for case in study.b1:
        times = [event.t for event in study.runs[stem("B1", case)].events or ()]
        total += len(times)
        for before, after in itertools.pairwise(times):
            if math.isclose(before, after, rel_tol=1e-15):
                together += 1
    return Measured(
        {"together": float(together), "total": float(total)},
        f"Of {total} contact changes in the four B1 runs, {together} fall on the same instant as "
        "the one before.",
    )


def sliding(study: Study) -> Measured:
    """E16: the greatest velocities of the pad and of its lower face along the surface over V.

    Friction acts at the face, whose velocity counts while the face touches: x_dot + a theta_dot
    with the arm a = h cos(theta0 + theta). A run counts as lost by `sliding_holds`, which compares
    x_dot of the pad with V, not the velocity of the face.
    """
    pad_over_V = 0.0
    face_over_V = 0.0
    lost = []
    for key, run in study.runs.items():
        model = study.scenes[key].pad_model
        history = run.history
        assert history is not None
        if model.pad.V is not None:
            arm = model.pad.h * np.cos(model.pad.theta0 + history["theta"])
            rubs = history["state"] != model.law.state_name(NONE)
            speed = (history["x_dot"] + arm * history["theta_dot"])[rubs]
            pad_over_V = max(pad_over_V, float(history["x_dot"].max() / model.pad.V))
            face_over_V = max(face_over_V, float(speed.max(initial=0.0) / model.pad.V))
        if run.sliding_holds is False:
            lost.append(title(key))
    text = "With the assumed V the pad stays slower than the surface in all eight runs"
    if lost:
        text = f"The pad comes to the velocity of the surface in {', '.join(lost)}"
    return Measured(
        {"greatest": pad_over_V, "face": face_over_V, "lost": float(len(lost))},
        f"{text}; the pad's greatest velocity along the surface is {100 * pad_over_V:.3g} % of V, "
        f"that of its lower face while it touches {100 * face_over_V:.3g} %.",
    )
