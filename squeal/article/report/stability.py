"""Tables, sentences and values of the stability chapter, from its result files."""

from collections.abc import Callable, Mapping, Sequence

from squeal.article.cases import title
from squeal.article.report.latex import (
    Generated,
    at_most,
    cells,
    in_words,
    long_table,
    number,
    once,
    tabular,
    typeset,
)
from squeal.article.results.angles import Angles
from squeal.article.results.loci import Branch, HeldThreshold, Loci, SceneLoci, SingleLoop
from squeal.article.results.records import Missing
from squeal.article.results.stability import DERIVED, MATRICES, Comparison, Stability, Thresholds


def literature_table(rows: Sequence[Comparison]) -> str:
    """Expected and computed numbers of the literature systems, with their provenance."""
    columns: Mapping[str, Callable[[Comparison], str]] = {
        "system": lambda row: typeset(row.name),
        "quantity": lambda row: typeset(row.quantity),
        "expected": lambda row: _plain(row.expected),
        "computed": lambda row: _plain(row.computed),
        "known from": lambda row: typeset(row.provenance),
    }
    head, lines = cells(columns, rows)
    return long_table(head, once(lines))


def _plain(text: str) -> str:
    number = text.replace("i", r"\mathrm{i}")
    return text if text == "none" else rf"\mbox{{${number}$}}"


def _listed(parts: Sequence[str]) -> str:
    return ", ".join(parts) or "none"


def _change(one: HeldThreshold) -> str:
    verb = "begins" if one.direction == "up" else "ends"
    return f"{number(one.mu, 10)} {one.kind} {verb}"


def _margin(loop: SingleLoop) -> str:
    if loop.grows_from_zero is not None:
        return f"none, {loop.grows_from_zero} from $\\mu = 0$"
    return "none" if loop.critical_friction is None else number(loop.critical_friction, 10)


def threshold_table(loci: Loci, fluttering: Thresholds | None) -> str:
    """Thresholds along the branch, those with the equilibrium held, and the loop's gain margin."""
    shown: list[tuple[str, SceneLoci | Thresholds]] = [
        (title(one.name), one) for one in loci.scenes
    ]
    if fluttering is not None:
        shown.append(("B2, fluttering angles", fluttering))
    along = rf"along the branch, $\mu \le {loci.mu_max:g}$"
    head = ["", along, "equilibrium held", "gain margin", "difference"]
    groups: dict[str, list[list[str]]] = {}
    for name, scene in shown:
        branch, loop = scene.branch, scene.loop
        points = branch.thresholds if isinstance(branch, Branch) else ()
        cells = [_listed([f"{number(point.mu, 6)} {point.kind}" for point in points])]
        if isinstance(loop, Missing):
            cells += ["no equilibrium", "--", "--"]
        else:
            cells.append(_listed([_change(one) for one in loop.thresholds]))
            if isinstance(loop, SingleLoop):
                apart = loop.apart if loop.thresholds else None
                cells += [_margin(loop), "--" if apart is None else number(apart, 2)]
            else:
                cells += ["not of rank one", "--"]
        groups.setdefault(scene.model, []).append([name, *cells])
    return tabular("lllll", head, list(groups.values()))


def _left_out(scenes: Sequence[SceneLoci], what: str) -> str:
    """A sentence on the scenes that have no panel in a figure."""
    if not scenes:
        return ""
    models = dict.fromkeys(scene.model for scene in scenes)
    cases = {m: in_words([f"({s.name[-1]})" for s in scenes if s.model == m]) for m in models}
    names = "; ".join(f"{model} {letters}" for model, letters in cases.items())
    return f" Without a {what}, since all roots stay on the imaginary axis: {names}."


def values(found: Stability, loci: Loci) -> dict[str, str]:
    """Values that the chapter's text refers to."""
    loops = [scene.loop for scene in loci.scenes if isinstance(scene.loop, SingleLoop)]
    calm = [title(g.name) for g in found.growth if not any(real > 0.0 for real, _ in g.predicted)]
    alone = f", of {in_words(calm)} none, whose frequency alone is tested" if calm else ""
    other = (
        " A pad named after its fluttering angles is that of Fig.~\\ref{fig:growth}, where the "
        "scene's own pad does not flutter."
    )
    return {
        "loci.no-growth": _left_out([s for s in loci.scenes if not s.leaves_axis], "growth panel"),
        "loci.on-axis": _left_out([s for s in loci.scenes if s not in loci.leaving], "panel"),
        "stability.fluttering": "" if found.fluttering is None else other,
        "growth.growing": str(sum(real > 0.0 for g in found.growth for real, _ in g.predicted)),
        "growth.calm": alone,
        "growth.compared": in_words([title(g.name).replace(", case", "") for g in found.growth]),
        "growth.apart": at_most(max(g.apart for g in found.growth)),
        "growth.simulations": str(sum(len(g.mu) for g in found.growth)),
        "loop.rank-one": str(len(loops)),
        "loop.scenes": str(len(loci.scenes)),
        "loop.locus-apart": at_most(max((one.locus_apart for one in loops), default=0.0)),
        "literature.rows": str(len(found.literature)),
        "literature.derived": str(sum(row.provenance == DERIVED for row in found.literature)),
        "literature.matrices": str(sum(row.provenance == MATRICES for row in found.literature)),
        "literature.agree": str(sum(row.agrees for row in found.literature)),
    }


def generated(found: Stability, loci: Loci, _: Angles) -> Generated:
    """Values and tables, from the files of these studies."""
    return values(found, loci), {
        "literature": literature_table(found.literature),
        "thresholds": threshold_table(loci, found.fluttering),
    }
