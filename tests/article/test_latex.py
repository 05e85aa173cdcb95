"""Plain text as LaTeX sets it."""

import pytest

from squeal.article.report.latex import typeset


@pytest.mark.parametrize(
    ("text", "latex"),
    [
        ("R_n and Rn", "$R_n$ and $R_n$"),
        ("y_1 < F_n / k_c", "$y_1$ $<$ $F_n$ / $k_c$"),
        ("theta_0, mu_1, T_1", r"$\theta_0$, $\mu_1$, $T_1$"),
        ("x_dot, map_ranges", r"$\dot x$, map\_ranges"),
    ],
)
def test_a_letter_with_an_index_is_a_symbol(text, latex):
    assert typeset(text) == latex
