"""`squeal advise`: each parameter lowered and raised by a tolerance: the critical friction computed
anew, the strongest lever first."""

import argparse
import math
from typing import Any

from squeal.analysis.advice import Advice, Lever, Outcome, Tolerance, advise
from squeal.analysis.advice_text import advice_in_words, change_in_words
from squeal.analysis.subject import Subject, check_name
from squeal.cli.base import Answer, Parser
from squeal.cli.critical_friction import upper_end, upper_option
from squeal.cli.outputs import file_options
from squeal.cli.progress import progress_line
from squeal.cli.tables import number, table
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.io.writing import picked, write_table

COLUMNS = {
    "parameter": "", "unit": "", "value": "", "step": "", "critical_lowered": "",
    "critical_raised": "", "change_lowered": "", "change_raised": "", "gap_change_lowered": "",
    "gap_change_raised": "",
}  # fmt: skip


def options(parser: Parser) -> None:
    """Options of `squeal advise`."""
    parser.add_argument(
        "--tolerance",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="how far a parameter is lowered and raised, such as k1=5%% or alpha1=0.01 in its own "
        "unit (repeatable; left out: 2%%, an angle 0.02 rad, and nothing that is 0)",
    )
    upper_option(parser, "of the range in which the critical friction is sought")
    file_options(parser, table="write the table to FILE")


def tolerances(given: list[str], subject: Subject) -> dict[str, Tolerance]:
    """The tolerances that the options name. Raises InputError."""
    found = {}
    for one in given:
        name, equals, text = one.partition("=")
        name, share = name.strip(), text.strip().endswith("%")
        try:
            size = float(text.strip().removesuffix("%")) / (100.0 if share else 1.0)
        except ValueError:
            size = math.nan
        if not equals or not 0.0 < size < math.inf:
            raise InputError(
                f"--tolerance {one}: is not allowed; it must be NAME=VALUE with a number above 0 "
                "in the parameter's unit, or with a share such as 5%"
            )
        check_name(subject, name, f"--tolerance {one}", share)
        if name in found:
            raise InputError(f"--tolerance {one}: {name} has a tolerance already; one is allowed")
        found[name] = Tolerance(size, share)
    return found


def _outcome_row(outcome: Outcome, change: float | None, gap: float | None) -> dict[str, Any]:
    found = picked(outcome, "value critical kind frequency_hz")
    found |= {"change": change, "frequency_gap": outcome.gap, "frequency_gap_change": gap}
    return found | {"reason": outcome.reason}


def data(advice: Advice) -> dict[str, Any]:
    """The answer as a JSON object."""
    nominal = advice.nominal
    found: dict[str, Any] = {"parameter": advice.name} | picked(advice, "mu mu_max")
    found |= picked(nominal, "critical kind frequency_hz") | {"frequency_gap": nominal.gap}
    levers = [
        picked(lever, "parameter unit value step")
        | {
            "lowered": _outcome_row(lever.lowered, lever.changes[0], lever.gap_changes[0]),
            "raised": _outcome_row(lever.raised, lever.changes[1], lever.gap_changes[1]),
        }
        for lever in advice.levers
    ]
    return found | {"levers": levers, "advice": advice_in_words(advice)}


def _cells(lever: Lever, outcome: Outcome, k: int, advice: Advice) -> tuple[str, str]:
    change, gap = lever.changes[k], lever.gap_changes[k]
    if change is None:
        return "no such pad", "-"
    at = f"> {advice.mu_max:g}" if outcome.critical is None else number(outcome.critical)
    moved = change if gap is None else 100 * gap
    return at, f"{moved:+.3g}" if moved else "0"


def text(advice: Advice) -> str:
    """The same for people."""
    by_gap = advice.nominal.gap is not None
    what = "d gap, %" if by_gap else f"d {advice.name}"
    rows: list[tuple[str, ...]] = [
        ("  parameter", "value", "step", "lowered:", what, "raised:", what)
    ]
    for lever in advice.levers:
        value = f"{number(lever.value)} {lever.unit}".strip()
        lowered, raised = (
            _cells(lever, outcome, k, advice)
            for k, outcome in enumerate((lever.lowered, lever.raised))
        )
        rows.append((f"  {lever.parameter}", value, change_in_words(lever), *lowered, *raised))
    head = (
        f"critical {advice.name} with one parameter at a time lowered and raised, strongest first"
    )
    gap = (
        "\n(gap: relative distance of the closest two frequencies, which flutter closes)"
        if by_gap
        else ""
    )
    return f"{head}\n{table(rows)}{gap}\n\n{advice_in_words(advice)}"


def _warnings(subject: Subject) -> tuple[str, ...] | None:
    """What speaks against the equilibrium of a scene as it is; None for a system."""
    if not isinstance(subject, Scene):
        return None
    found = None if subject.pad_model.linear else sliding_equilibrium(subject.pad_model)[0]
    return () if found is None else found.warnings


def run(given: argparse.Namespace) -> Answer:
    """Read the scene and answer."""
    subject = given.source.subject("advise")
    mu_max = upper_end(given, subject)
    with progress_line("parameters") as progress:
        advice = advise(subject, tolerances(given.tolerance, subject), mu_max, progress)
    if given.table is not None:
        rows = [[*lever.to_record().values()] for lever in advice.levers]
        write_table(given.table, COLUMNS, rows)
    return Answer(lambda: data(advice), lambda: text(advice), warnings=_warnings(subject))
