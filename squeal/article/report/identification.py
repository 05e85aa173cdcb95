"""Tables and values of the section on identification, from the stored searches verified afresh."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from squeal.article.claims import CLAIMS
from squeal.article.ensembles.choice import read_choice
from squeal.article.ensembles.space import SPEED as SCENES_SPEED
from squeal.article.identify.space import DIMENSIONS, SPEED, Dimension
from squeal.article.report.latex import (
    Generated,
    cells,
    in_words,
    long_table,
    number,
    percent,
    tabular,
    typeset,
)
from squeal.article.results.robustness import LEAST, STEPS, SYMBOLS, Robustness, Share
from squeal.article.results.verify import VerifiedPad, Verify
from squeal.model.contact import FORMULATION_CHOICES

HARDEST = 3  # statements that are named


def formulation_table(found: Sequence[VerifiedPad]) -> str:
    """One row a formulation: pads tried, claims kept, which fail, what the variations change."""

    def changed(pad: VerifiedPad) -> str:
        parts = (f"{c.claim or 'motion'} {c.verdict} at {c.variation}" for c in pad.changed)
        return typeset("; ".join(parts)) or "none"

    columns: Mapping[str, Callable[[VerifiedPad], str]] = {
        "line force": lambda pad: pad.formulation.line_force,
        "delta from": lambda pad: pad.formulation.delta_from,
        "sign": lambda pad: f"${pad.formulation.delta_moment}$",
        "pads tried": lambda pad: f"{pad.pads:,}".replace(",", r"\,"),
        "kept": lambda pad: str(pad.reproduced),
        "not kept": lambda pad: typeset(", ".join(claim.id for claim in pad.failing)),
        "changed by another tolerance or a doubled horizon": changed,
    }
    return long_table(*cells(columns, found))


def range_table(numbers: dict[str, float], own: dict[str, float]) -> str:
    """The searched ranges with their reasons, the best pad's numbers and those of the report's."""
    columns: Mapping[str, Callable[[Dimension], str]] = {
        "number": lambda d: SYMBOLS[d.name],
        "from": lambda d: number(d.low),
        "to": lambda d: number(d.high),
        "best pad": lambda d: number(numbers[d.name], 6),
        "report's": lambda d: number(own[d.name], 6),
        "meaning and reason of the range": lambda d: typeset(d.reason),
    }
    head, rows = cells(columns, DIMENSIONS)
    return tabular(r"lrrrr>{\raggedright\arraybackslash}p{2.9in}", head, [rows])


def hardest(shares: Mapping[str, Share]) -> list[str]:
    """The informative statements that the fewest pads keep."""
    informative = [claim.id for claim in CLAIMS if claim.informative]
    return sorted(informative, key=lambda name: shares[name].share)[:HARDEST]


def values(checked: Verify, robust: Robustness) -> dict[str, str]:
    """Values that the section's text refers to."""
    found, best = checked.formulations, checked.formulations[0]
    told = {
        "identified.numbers": str(len(best.numbers)),
        "identified.pads": f"{sum(e.pads for e in found):,}".replace(",", r"\,"),
        "identified.changed": "no verdict" if not checked.own else f"{len(checked.own)}",
        "identified.failing": "; ".join(typeset(f"{c.id} ({c.measured})") for c in best.failing),
    }
    for entry in found:
        choices = (getattr(entry.formulation, name) for name in FORMULATION_CHOICES)
        key = f"identified.{'-'.join(choices)}"
        told[key] = str(entry.reproduced)
    told |= {
        "identified.speed": number(SPEED),
        "robustness.tried": str(STEPS),
        "robustness.least": percent(LEAST),
        "robustness.step": number(LEAST ** (-1.0 / (STEPS - 1)), 3),
        "robustness.speed": number(SCENES_SPEED),
    }
    told |= {f"ranges.{claim.id}": "--" for claim in CLAIMS}
    told |= {"ranges.pads": "--", "ranges.hardest": "--"}
    told["robustness.left-out"] = typeset(robust.left_out)
    if not robust.samples:
        return told
    ranges = robust.samples[-1].claims
    for claim, share in ranges.items():
        low, high = (f"{100 * v:.1f}" for v in share.interval)
        told[f"ranges.{claim}"] = rf"{100 * share.share:.1f}\,\% ({low} to {high})"
    told["ranges.pads"] = str(robust.samples[-1].pads)
    told["ranges.hardest"] = in_words(
        [f"{claim} on {told[f'ranges.{claim}']}" for claim in hardest(ranges)]
    )
    return told


def generated(checked: Verify, robust: Robustness, pad: Path) -> Generated:
    """Values and tables, from the files of these studies and the pad of the report."""
    found, own = checked.formulations, read_choice(pad)
    tables = {
        "formulations": formulation_table(found),
        "ranges": range_table(found[0].numbers, own.numbers),
    }
    return values(checked, robust), tables
