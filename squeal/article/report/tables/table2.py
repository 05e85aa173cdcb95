"""The article's Table 2: contact states of model B2 by Eq. (12) and by the edge penetrations."""

from squeal.article.report.latex import tabular
from squeal.model.contact import FACE_STATES, FULL, LEAD, NONE, TRAIL, face_state

CAPTION = r"""Model B2: contact states, as the article's Table 2, and the equivalent penetrations
$p_l$, $p_t$ of the edges, which we use (E11). Leading and trailing edge are at $x_l$ and $x_t$; at
$x_{cl}$ the line of the lower face meets the surface."""
PRINTED = {  # (sign of the tilt, state) in the words of the table
    (1, NONE): r"$x_{cl} \le x_l$",
    (1, LEAD): r"$x_l < x_{cl} < x_t$",
    (1, FULL): r"$x_{cl} \ge x_t$",
    (0, FULL): r"$y + y_0 < 0$",
    (0, NONE): r"$y + y_0 \ge 0$",
    (-1, FULL): r"$x_{cl} \le x_l$",
    (-1, TRAIL): r"$x_l < x_{cl} < x_t$",
    (-1, NONE): r"$x_{cl} \ge x_t$",
}
SIGNS = {1: ">", 0: "=", -1: "<"}


def table() -> str:
    """The table in LaTeX, a row per contact state and sign of the tilt."""
    groups: dict[int, list[list[str]]] = {tilt: [] for tilt in SIGNS}
    for (tilt, state), printed in PRINTED.items():
        leading = r"$p_l > 0$" if state[0] else r"$p_l \le 0$"
        trailing = r"$p_t > 0$" if state[1] else r"$p_t \le 0$"
        name = f"{FACE_STATES[face_state(state)]} ({face_state(state)})"
        first = "" if groups[tilt] else rf"$\theta_0 + \theta {SIGNS[tilt]} 0$"
        groups[tilt].append([first, printed, f"{leading}, {trailing}", name])
    head = ["tilt", "printed condition", "penetrations", "contact state"]
    return tabular("llll", head, list(groups.values()))
