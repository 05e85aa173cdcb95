"""The findings on the article's equations: where, what, and how each is measured."""

from collections.abc import Callable
from typing import Literal, NamedTuple

from squeal.article.findings import equations, motion
from squeal.article.findings.equations import Measured
from squeal.article.findings.motion import Study
from squeal.article.records import Record

Kind = Literal["changes a result", "misprint", "possibly extraction", "contradiction", "remark"]
"""What a finding is worth to the article's results.

A misprint enters no result, or hardly. The text at hand was extracted from a file whose pages were
not seen, so that some misprints may be faults of the extraction. A remark is no fault.
"""


class Finding(NamedTuple):
    """A finding: its number, its place in the article, what it says and how it is measured.

    kind: what it is worth; affects: the figures or the section whose result it changes, if any.
    """

    id: str
    where: str
    kind: Kind
    statement: str
    measure: Callable[[Study], Measured]
    affects: str = ""


class MeasuredFinding(Record):
    """A finding: its place in the article, what it says, the numbers measured and their meaning.

    kind and affects as in `Finding`.
    """

    id: str
    where: str
    kind: Kind
    affects: str
    statement: str
    outcome: str
    measured: dict[str, float]

    @property
    def worth(self) -> str:
        """The kind of the finding, and what the finding affects, in words."""
        return f"{self.kind}: {self.affects}" if self.affects else self.kind


# fmt: off
FINDINGS = (
    Finding("E1", "Eq. (22i)", "possibly extraction",
            "The printed K33 lacks the term of spring 2. It enters no reported result, and the "
            "article calls K singular, which only the complete K33 makes it.",
            lambda s: equations.stiffness_entries([scene.pad for scene in s.b2.values()])),
    Finding("E2", "Sec. 6", "remark",
            "K is a sum of two rank-one matrices, so singular for every parameter set, as the "
            "article says; with K33 as printed it is not.",
            lambda s: equations.singularity()),
    Finding("E3", "Eq. (13)", "misprint",
            "The integrand has the opposite sign of its results, Eqs. (14) to (16).",
            lambda s: equations.integrand_sign(s.b2["c"].pad)),
    Finding("E4", "Eq. (13)", "changes a result",
            "Divided by the contact length, the reaction in partial contact has no potential.",
            motion.fed_by_the_law, "Figs. 9 to 12 where contact is partial"),
    Finding("E5", "Eqs. (17)-(20)", "misprint",
            "delta comes out in the fixed frame; Eq. (10) needs the distance from the mass centre.",
            motion.switch_effect("delta_from")),
    Finding("E6", "Eq. (21)", "misprint",
            "The moment of the reaction has the opposite sign of that in Eq. (10). It drops out of "
            "(23a, b), where delta = 0.",
            motion.switch_effect("delta_moment")),
    Finding("E7", "Sec. 5", "contradiction",
            "Of case b the text says both that the tilt is negative and that it is positive.",
            motion.static_balance),
    Finding("E8", "Fig. 7", "contradiction",
            "Caption and key disagree on whether state 2 occurs.", motion.states_met),
    Finding("E9", "Eqs. (23a, b)", "changes a result",
            "Three rows for two unknowns: the state exists only where K31 = h K11. Its complete "
            "necessary conditions are mu K21 < K11, K31 > 0 and mu h K21 < K31, which are (23a, b) "
            "only where K21 > 0.",
            motion.sliding_conditions, "Fig. 13"),
    Finding("E10", "Eqs. (6), (10)", "remark",
            "B1 uses the exact arm of the friction force, B2 the constant h.",
            lambda s: equations.friction_arm(s.b1["c"].pad)),
    Finding("E11", "Eq. (12)", "remark",
            "The contact-loss point is singular for a level pad; edge penetrations decide Table 2.",
            lambda s: equations.contact_loss_point(s.b2["c"].pad)),
    Finding("E12", "Sec. 6", "changes a result",
            "K holds the two springs only, so that it is singular and its eigenvalues say nothing "
            "of flutter; with contact and friction it is regular in general.",
            motion.springs_alone, "Sec. 6, what a singular matrix implies"),
    Finding("E13", "Table 1", "remark",
            "Conditions 1-2 and 2-1 need both edges to pass in the same instant.",
            motion.simultaneous),
    Finding("E14", "whole article", "remark",
            "Neither parameter values nor initial conditions are printed.",
            lambda s: equations.missing_parameters()),
    Finding("E15", "Eq. (17)", "possibly extraction",
            "In the text at hand the slope in the integrand is 0/0.",
            lambda s: equations.slope(s.b2["c"].pad)),
    Finding("E16", "friction", "remark",
            "All equations assume that the surface stays faster than the pad, V > x_dot; what rubs "
            "is its lower face.", motion.sliding),
)
# fmt: on


def measure_findings(study: Study) -> tuple[MeasuredFinding, ...]:
    """Measure all findings on a set of scenes, in order."""
    results = []
    for finding in FINDINGS:
        numbers, outcome = finding.measure(study)
        results.append(MeasuredFinding.of(finding, outcome=outcome, measured=numbers))
    return tuple(results)
