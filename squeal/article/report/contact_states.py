"""Tables 1 and 2 of the article: contact states from the table that the integrator uses."""

from squeal.article.report.latex import tabular
from squeal.article.transitions import EDGE_NAMES, Condition, conditions
from squeal.model.contact import contact_law
from squeal.model.laws import FACE_STATES, face_state
from squeal.model.states import FULL, LEAD, NONE, TRAIL, State

_SPRINGS = ("3", "4")  # contact spring of the leading and of the trailing edge


def _condition_rows(condition: Condition) -> list[list[str]]:
    name = contact_law("B1").state_name
    source, target = name(condition.source), name(condition.target)
    rows: list[list[str]] = []
    for edge, rising in condition.edges:
        i, ends = _SPRINGS[edge], "" if rows else f"{source}--{target}"
        gap = rf"$|\vec r_{i} - \vec r_{{f,{i}}}| - L_{i} = 0$"
        slope, verb = ("positive", "separates") if rising else ("negative", "touches")
        rows.append([ends, gap, slope, f"{EDGE_NAMES[edge]} edge {verb}"])
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
        name = f"{FACE_STATES[face_state(state)]} ({face_state(state)})"
        first = "" if groups[tilt] else _TILT[tilt]
        groups[tilt].append([first, printed, f"{leading}, {trailing}", name])
    head = ["tilt", "printed condition", "penetrations", "contact state"]
    return tabular("llll", head, list(groups.values()))
