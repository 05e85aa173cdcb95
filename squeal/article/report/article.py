"""Values and tables of the article's own models: motions, the map of Fig. 13, eigenvalues."""

from collections.abc import Mapping

from squeal.article.report.contact_states import table_1, table_2
from squeal.article.report.latex import (
    Generated,
    at_most,
    counted,
    escape,
    number,
    percent,
    tabular,
    typeset,
)
from squeal.article.results.eigenvalues import Eigenvalues, EquilibriumPoles
from squeal.article.results.quasi_static import QuasiStatic
from squeal.article.results.records import Missing
from squeal.article.results.runs import StoredSummary


def simulated(run: StoredSummary) -> dict[str, str]:
    """Values of one simulated scene."""
    stem = run.name
    values = {
        f"{stem}.changes": counted(len(run.events), "change"),
        f"{stem}.steps": str(run.steps),
        f"{stem}.stop": number(1e3 * run.stop),
        f"{stem}.scene": escape(run.scene),
    }
    for state, share in run.shares.items():
        values[f"{stem}.share.{state}"] = percent(share)
    for signal, limits in run.extrema.items():
        low, high = limits or (float("nan"), float("nan"))
        values[f"{stem}.min.{signal}"] = number(low, 3)
        values[f"{stem}.max.{signal}"] = number(high, 3)
    return values


def eigenvalue_values(found: Eigenvalues) -> dict[str, str]:
    """The verdicts with the cases that have them, and how far the two programs are apart."""
    cases: dict[str, list[str]] = {}
    apart = 0.0
    for stem, one in found.scenes.items():
        verdict = "no sliding equilibrium"
        if isinstance(one, EquilibriumPoles):
            verdict, apart = one.verdict, max(apart, one.apart)
        cases.setdefault(verdict, []).append(f"({stem[-1]})")
    words = [
        f"{verdict} in {'all cases' if len(several) == len(found.scenes) else ', '.join(several)}"
        for verdict, several in cases.items()
    ]
    return {"eigenvalues.verdicts": "; ".join(words), "eigenvalues.apart": at_most(apart)}


def eigenvalue_table(found: Mapping[str, EquilibriumPoles | Missing]) -> str:
    """Complex eigenvalues of the four cases, one row for a pair or a real eigenvalue."""
    groups = []
    for scene, result in found.items():
        case = f"({scene[-1]})"
        if isinstance(result, Missing):
            text = rf"\multicolumn{{5}}{{l}}{{{typeset(result.reason)}}}"
            groups.append([[case, "--", text]])
            continue
        rows: list[list[str]] = []
        for pole in result.poles:
            told = ["", "", ""] if rows else [case, result.contact, result.verdict]
            sign = r"\pm" if pole.imag else ""
            cells = [number(pole.real, 5), f"${sign}{pole.imag:.1f}$", f"{pole.frequency_hz:.1f}"]
            rows.append([*told[:2], *cells, number(pole.damping_ratio, 4), told[2]])
        groups.append(rows)
    head = ["case", "contact", "real part, 1/s", "imaginary part, rad/s", "frequency, Hz"]
    return tabular("llrrrrl", [*head, "damping ratio", "verdict"], groups)


def _key(method: str) -> str:
    return "heyoka" if method.startswith("heyoka") else "scipy"


def generated(_: QuasiStatic, found: Eigenvalues, *runs: StoredSummary) -> Generated:
    """Values and tables, from the studies and the summaries of the simulations."""
    values = eigenvalue_values(found)
    for run in runs:
        values |= simulated(run)
    values["method"] = rf"{escape(runs[0].method)} integration~\citep{{{_key(runs[0].method)}}}"
    values["tolerance"] = number(runs[0].tolerance, 3)
    tables = {"table-1": table_1(), "table-2": table_2()}
    return values, tables | {"eigenvalues": eigenvalue_table(found.scenes)}
