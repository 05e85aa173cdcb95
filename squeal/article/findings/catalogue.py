"""The findings on the article's equations: where, what, and how each is measured."""

from collections.abc import Callable
from typing import NamedTuple

from squeal.article.findings import equations, motion
from squeal.article.findings.equations import Measured
from squeal.article.findings.motion import Study
from squeal.article.records import Record


class Finding(NamedTuple):
    """A finding: its number, its place in the article, what it says and how it is measured."""

    id: str
    where: str
    statement: str
    measure: Callable[[Study], Measured]


class MeasuredFinding(Record):
    """A finding: its place in the article, what it says, the numbers measured and their meaning."""

    id: str
    where: str
    statement: str
    outcome: str
    measured: dict[str, float]


# fmt: off
FINDINGS = (
    Finding("E1", "Eq. (22i)",
            "The printed K33 lacks the term of spring 2.",
            lambda s: equations.stiffness_entries([scene.pad for scene in s.b2.values()])),
    Finding("E2", "Sec. 6",
            "K is a sum of two rank-one matrices, so singular for every parameter set; the printed "
            "one is not.",
            lambda s: equations.singularity()),
    Finding("E3", "Eq. (13)",
            "The integrand has the opposite sign of its results, Eqs. (14) to (16).",
            lambda s: equations.integrand_sign(s.b2["c"].pad)),
    Finding("E4", "Eq. (13)",
            "Divided by the contact length, the reaction in partial contact has no potential.",
            motion.fed_by_the_law),
    Finding("E5", "Eqs. (17)-(20)",
            "delta comes out in the fixed frame; Eq. (10) needs the distance from the mass centre.",
            motion.switch_effect("delta_from")),
    Finding("E6", "Eq. (21)",
            "The moment of the reaction has the opposite sign of that in Eq. (10).",
            motion.switch_effect("delta_moment")),
    Finding("E7", "Sec. 5",
            "Of case b the text says both that the tilt is negative and that it is positive.",
            motion.static_balance),
    Finding("E8", "Fig. 7",
            "Caption and key disagree on whether state 2 occurs.", motion.states_met),
    Finding("E9", "Eqs. (23a, b)",
            "Necessary conditions of one restricted state, whose inequalities turn with the "
            "signs of K21 and K31.",
            motion.sliding_conditions),
    Finding("E10", "Eqs. (6), (10)",
            "B1 uses the exact arm of the friction force, B2 the constant h.",
            lambda s: equations.friction_arm(s.b1["c"].pad)),
    Finding("E11", "Eq. (12)",
            "The contact-loss point is singular for a level pad; edge penetrations decide Table 2.",
            lambda s: equations.contact_loss_point(s.b2["c"].pad)),
    Finding("E12", "Sec. 6",
            "K holds the two springs only, so that its eigenvalues say nothing of flutter.",
            motion.springs_alone),
    Finding("E13", "Table 1",
            "Conditions 1-2 and 2-1 need both edges to pass in the same instant.",
            motion.simultaneous),
    Finding("E14", "whole article",
            "Neither parameter values nor initial conditions are printed.",
            lambda s: equations.missing_parameters()),
    Finding("E15", "Eq. (17)",
            "As extracted, the slope in the integrand is 0/0.",
            lambda s: equations.slope(s.b2["c"].pad)),
    Finding("E16", "friction",
            "All equations assume that the surface stays faster than the pad, V > x_dot; what rubs "
            "is its lower face.", motion.sliding),
)
# fmt: on


def measure_findings(study: Study) -> tuple[MeasuredFinding, ...]:
    """Measure all findings on a set of scenes, in order."""
    pairs = ((one, one.measure(study)) for one in FINDINGS)
    return tuple(MeasuredFinding.of(*both, measured=both[1].numbers) for both in pairs)
