"""Tables 1 and 2 of the article from the transition table, and the tables of results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from squeal.article.report.latex import long_table, number, tabular, typeset
from squeal.files.provenance import Provenance
from squeal.model.contact import contact_law
from squeal.model.law import FACE_STATES, face_state
from squeal.model.states import (
    EDGE_NAMES,
    FULL,
    LEAD,
    NONE,
    TRAIL,
    Condition,
    State,
    conditions,
)

_SPRINGS = ("3", "4")  # contact spring of the leading and of the trailing edge


def _gap(edge: int) -> str:
    i = _SPRINGS[edge]
    return rf"$|\vec r_{i} - \vec r_{{f,{i}}}| - L_{i} = 0$"


def _condition_rows(condition: Condition) -> list[list[str]]:
    name = contact_law("B1").state_name
    source, target = name(condition.source), name(condition.target)
    rows: list[list[str]] = []
    for edge, rising in condition.edges:
        verb = "separates" if rising else "touches"
        rows.append(
            [
                f"{source}--{target}" if not rows else "",
                _gap(edge),
                "positive" if rising else "negative",
                f"{EDGE_NAMES[edge]} edge {verb}",
            ]
        )
    return rows


def table_1() -> str:
    """Table 1: the conditions for a change of state in model B1."""
    groups: list[list[list[str]]] = []
    pair: list[set[State]] = []
    for condition in conditions():
        ends = {condition.source, condition.target}
        if not pair or pair[-1] != ends:
            groups.append([])
            pair.append(ends)
        groups[-1] += _condition_rows(condition)
    return tabular("llll", ["condition", "expression", "slope", "meaning"], groups)


_EQUATION_12 = {  # (sign of the tilt, state) in the words of Table 2
    (1, NONE): r"$x_{cl} \le x_l$",
    (1, LEAD): r"$x_l < x_{cl} < x_t$",
    (1, FULL): r"$x_{cl} \ge x_t$",
    (0, FULL): r"$y + y_0 < 0$",
    (0, NONE): r"$y + y_0 \ge 0$",
    (-1, FULL): r"$x_{cl} \le x_l$",
    (-1, TRAIL): r"$x_l < x_{cl} < x_t$",
    (-1, NONE): r"$x_{cl} \ge x_t$",
}
_TILT = {
    1: r"$\theta_0 + \theta > 0$",
    0: r"$\theta_0 + \theta = 0$",
    -1: r"$\theta_0 + \theta < 0$",
}


def table_2() -> str:
    """Table 2: contact states of model B2 by Eq. (12) and by the edge penetrations."""
    groups: dict[int, list[list[str]]] = {tilt: [] for tilt in _TILT}
    for (tilt, state), printed in _EQUATION_12.items():
        leading = r"$p_l > 0$" if state.leading else r"$p_l \le 0$"
        trailing = r"$p_t > 0$" if state.trailing else r"$p_t \le 0$"
        groups[tilt].append(
            [
                "" if groups[tilt] else _TILT[tilt],
                printed,
                f"{leading}, {trailing}",
                f"{FACE_STATES[face_state(state)]} ({face_state(state)})",
            ]
        )
    head = ["tilt", "printed condition", "penetrations", "contact state"]
    return tabular("llll", head, list(groups.values()))


def eigenvalue_table(found: dict[str, Any]) -> str:
    """Complex eigenvalues of the four cases, one row for a pair or a real eigenvalue."""
    groups = []
    for scene, result in found.items():
        case = f"({scene[-1]})"
        if "reason" in result:
            text = rf"\multicolumn{{5}}{{l}}{{{typeset(result['reason'])}}}"
            groups.append([[case, "--", text]])
            continue
        rows: list[list[str]] = []
        for pole in result["poles"]:
            first = not rows
            ratio = pole["damping_ratio"]
            sign = r"\pm" if pole["imag"] else ""
            imaginary = f"{pole['imag']:.1f}"
            rows.append(
                [
                    case if first else "",
                    result["contact"] if first else "",
                    number(pole["real"], 5),
                    f"${sign}{imaginary}$",
                    f"{pole['frequency_hz']:.1f}",
                    "--" if ratio is None else number(ratio, 4),
                    result["verdict"] if first else "",
                ]
            )
        groups.append(rows)
    head = ["case", "contact", "real part, 1/s", "imaginary part, rad/s", "frequency, Hz"]
    return tabular("llrrrrl", [*head, "damping ratio", "verdict"], groups)


def claims_table(claims: list[dict[str, Any]]) -> str:
    """All claims with place, statement, measured value and verdict."""
    rows = [
        [
            rf"\footnotesize {c['id']}",
            typeset(c["where"]),
            typeset(c["statement"]),
            typeset(c["measured"]),
            rf"\verdict{{{c['verdict']}}}",
        ]
        for c in claims
    ]
    head = ["claim", "place", "statement in our words", "measured", "verdict"]
    return long_table(head, rows)


def findings_table(findings: list[dict[str, Any]]) -> str:
    """All findings with place, statement and measured outcome."""
    rows = [
        [f["id"], typeset(f["where"]), typeset(f["statement"]), typeset(f["outcome"])]
        for f in findings
    ]
    return long_table(["", "place", "finding", "measured"], rows)


def origin_table(results: Mapping[str, Provenance]) -> str:
    """Which files and which sources made each result, after the digests of the files."""
    files = dict.fromkeys(file for made in results.values() for file in made.inputs)
    digests = [[rf"\texttt{{{f.name}}}", rf"\texttt{{{f.sha256[:16]}}}", ""] for f in files]
    rows = []
    for key, made in results.items():
        names = ", ".join(file.name.removesuffix(".yaml") for file in made.inputs)
        rows.append([rf"\texttt{{{key}}}", rf"\texttt{{{made.source_sha256}}}", names or "--"])
    head = ["file or result", "of its bytes or sources", "computed from"]
    return tabular("lll", head, [digests, rows])
