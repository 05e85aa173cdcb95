"""Values and tables on the article's statements and on the findings about its equations."""

from collections.abc import Callable, Collection, Mapping, Sequence

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.claims import CLAIMS, rules
from squeal.article.report.latex import Generated, cells, long_table, number, percent, typeset
from squeal.article.results.claims import Claims, JudgedClaim
from squeal.article.results.findings import Findings, MeasuredFinding


def agreement(claims: Sequence[JudgedClaim], stem: str) -> str:
    """How far a scene agrees with the article, told from the claims about it and no other case."""
    own = [c for c in claims if stem in c.scenes and c.case == stem[-1]]
    missed = [c for c in own if c.verdict != "reproduced"]
    if not own:
        return ""
    if not missed:
        all_of = {1: "The one statement", 2: "Both statements"}
        subject = all_of.get(len(own), f"All {len(own)} statements")
        are = "is" if len(own) == 1 else "are"
        return f"{subject} of the article on this case alone {are} reproduced."
    told = "; ".join(f"{c.id} ({c.measured})" for c in missed)
    count = len(own) - len(missed)
    return typeset(
        f"Of {len(own)} statements of the article on this case alone {count} "
        f"{'is' if count == 1 else 'are'} reproduced; not so {told}."
    )


def together(informative: Collection[str]) -> int:
    """How many of these statements can hold at once: one less for each conflict among what they
    say or imply."""
    said = set(informative)
    said |= {c.id for c in CLAIMS if c.follows and c.follows.by and said.issuperset(c.follows.by)}
    conflicts = {frozenset((c.id, c.conflicts)) for c in CLAIMS if c.conflicts}
    return len(informative) - sum(pair <= said for pair in conflicts)


def judged(claims: Sequence[JudgedClaim]) -> dict[str, str]:
    """Values told by the claims: counts, each verdict and measure, agreement by figure."""
    informative = [c for c in claims if c.kind == "informative"]
    values = {
        "claims.total": str(len(claims)),
        "claims.informative": str(len(informative)),
        "claims.informative-together": str(together([c.id for c in informative])),
        "claims.informative-reproduced": str(sum(c.holds for c in informative)),
    }
    for verdict in ("reproduced", "not reproduced", "contradicted"):
        count = sum(c.verdict == verdict for c in claims)
        values[f"claims.{verdict.replace(' ', '-')}"] = str(count)
    for c in claims:
        values[f"claim.{c.id}.verdict"] = c.verdict
        values[f"claim.{c.id}.measured"] = typeset(c.measured)
    for stem in HISTORY_FIGURES:
        values[f"agreement.{stem}"] = agreement(claims, stem)
    return values


def follows(claim: JudgedClaim) -> str:
    """Why a verdict says nothing of its own, to be put after it."""
    if claim.kind == "informative":
        return ""
    return rf"; {claim.kind}: {typeset(claim.derivation)}"


def claims_table(claims: Sequence[JudgedClaim]) -> str:
    """All claims with place, statement, measured value and verdict."""
    columns: Mapping[str, Callable[[JudgedClaim], str]] = {
        "": lambda c: rf"\footnotesize {c.id}",
        "place": lambda c: typeset(c.where),
        "statement in our words": lambda c: typeset(c.statement),
        "measured": lambda c: typeset(c.measured),
        "verdict": lambda c: rf"\verdict{{{c.verdict}}}{follows(c)}",
    }
    return long_table(*cells(columns, claims))


def findings_table(findings: Sequence[MeasuredFinding]) -> str:
    """All findings with place, statement and measured outcome."""
    rows = [[f.id, typeset(f.where), typeset(f.statement), typeset(f.outcome)] for f in findings]
    return long_table(["", "place", "finding", "measured"], rows)


def generated(claims: Claims, findings: Findings) -> Generated:
    """Values and tables, from the files of these studies."""
    values = judged(claims.claims) | {
        "findings.total": str(len(findings.findings)),
        "rules.hammer": number(rules.HAMMER, 2),
        "rules.swings": str(rules.SWINGS),
        "rules.alternate": percent(rules.ALTERNATE, 0),
        "rules.calm": percent(rules.CALM, 0),
    }
    tables = {"claims": claims_table(claims.claims), "findings": findings_table(findings.findings)}
    return values, tables
