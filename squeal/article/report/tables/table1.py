"""The article's Table 1, from the transition table that the integrator uses."""

from squeal.article.report.latex import tabular
from squeal.article.transitions import EDGE_NAMES, Condition, conditions
from squeal.model.contact import State, contact_law

CAPTION = r"""Model B1: conditions for a change of contact state, as the article's Table 1.
Conditions \name{1--2} and \name{2--1} need both edges at once (E13). $|\vec r_i - \vec r_{f,i}|$ is
the length of contact spring $i$, from the edge at $\vec r_i$ to its foot at $\vec r_{f,i}$, and
$L_i$ its free length. Slope: sign of the rate of change of this length."""
SPRINGS = ("3", "4")  # of the leading and of the trailing edge


def _rows(condition: Condition) -> list[list[str]]:
    """A row for each edge that must pass, the first with the names of both states."""
    name = contact_law("B1").state_name
    rows: list[list[str]] = []
    for edge, rising in condition.edges:
        i = SPRINGS[edge]
        ends = "" if rows else f"{name(condition.source)}--{name(condition.target)}"
        gap = rf"$|\vec r_{i} - \vec r_{{f,{i}}}| = L_{i}$"
        slope, verb = ("positive", "separates") if rising else ("negative", "touches")
        rows.append([ends, gap, slope, f"{EDGE_NAMES[edge]} edge {verb}"])
    return rows


def table() -> str:
    """The table in LaTeX, a group per pair of states, a row per edge that must pass."""
    groups: list[list[list[str]]] = []
    pair: list[set[State]] = []
    for condition in conditions():
        ends = {condition.source, condition.target}
        if not pair or pair[-1] != ends:
            groups.append([])
            pair.append(ends)
        groups[-1] += _rows(condition)
    return tabular("llll", ["condition", "expression", "slope", "meaning"], groups)
