"""Sentences on the switches of the formulation; what interprets asks the results first."""

from collections.abc import Mapping

from squeal.article.ensembles.gather import SLIDING
from squeal.article.report import pads
from squeal.article.report.latex import at_least, in_words, number
from squeal.article.results.ensembles import Conclusion, Contrast

SURE = 0.05  # probability by chance below which a switch is said to matter
SWITCHES = {
    "line_force": "the line force (as printed or consistent)",
    "delta_from": r"the point from which $\delta$ is counted",
    "delta_moment": "the sign of the reaction's moment",
}
CHOICES = {
    "integral": "the consistent force",
    "mean": r"the printed force",
    "centre": r"$\delta$ from the mass centre",
    "frame": r"$\delta$ in the fixed frame",
    "+": "the sign of \\aeq{10}",
    "-": "the sign of \\aeq{21}",
}


def of_levels(c: Contrast) -> str:
    """Whether searches come nearer with one choice of a switch, also without that on sliding."""
    levels = in_words([f"{number(v, 3)} with {CHOICES[name]}" for name, v in c.levels.items()])
    nearer = min(c.levels, key=lambda name: c.levels[name])
    pairs = c.better if nearer == list(c.levels)[1] else c.pairs - c.better
    told = (
        f"mean level {levels}, nearer in {pairs} of the {c.pairs} pairs of formulations that "
        f"differ in this alone, $p = {number(c.p, 2).strip('$')}$"
    )
    name = SWITCHES[c.switch].capitalize()
    sure, still = c.p < SURE, c.p_unslid < SURE
    p = f"$p = {number(c.p_unslid, 2).strip('$')}$"
    other = min(c.unslid, key=lambda name: c.unslid[name])
    if sure and still and other == nearer:
        return (
            f"{name} makes a difference: searches come nearer with {CHOICES[nearer]} ({told}), "
            f"also without the statement on sliding ({p})."
        )
    if sure:
        return (
            f"{name} makes a difference to the levels of searches with the assumed speed of the "
            f"surface only: they come nearer with {CHOICES[nearer]} ({told}), but without the "
            f"statement on sliding this is not shown ({p})."
        )
    without = (
        f"without the statement on sliding one is, {CHOICES[other]} being nearer ({p})"
        if still
        else f"nor is one without the statement on sliding ({p})"
    )
    return f"{name}: no difference of the levels is shown ({told}); {without}."


def of_random(c: Contrast, conclusions: Mapping[str, Conclusion]) -> str:
    """Whether random pads that run keep the article's conclusions more often with one choice."""
    one, other = c.random
    drawn, ran = (in_words([pads.thousands(n[k]) for k in (one, other)]) for n in (c.random, c.ran))
    same = c.random[one] == c.random[other]
    count = f"{pads.thousands(c.random[one])} each" if same else drawn
    run = f"Of random pads with {CHOICES[one]} and with {CHOICES[other]}, {count}, {ran} run"
    differ = {name: p for name, p in c.p_keep.items() if p < SURE}
    alike = {name: p for name, p in c.p_keep.items() if name not in differ}
    parts = [
        f"{_share(c, name, one)} and {_share(c, name, other)} keep all statements on {name} "
        f"($p = {number(p, 2).strip('$')}$)"
        for name, p in differ.items()
    ]
    free = all(SLIDING not in conclusions[name].statements for name in differ)
    told = [in_words(parts) + (", whatever the speed" if free else "")] if parts else []
    if alike:
        least = at_least(min(alike.values())).strip("$")
        sign = r"\ge" if len(alike) > 1 else "="
        left = " or on ".join(alike)
        told.append(f"no difference in all statements on {left} is shown ($p {sign} {least}$)")
    return f"{run}; of those that run {'; '.join(told)}."


def _share(c: Contrast, name: str, choice: str) -> str:
    return rf"{100.0 * c.keep[name][choice] / c.ran[choice]:.2g}\,\%"
