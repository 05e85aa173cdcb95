"""Damping in system files: of terms, by matrices, by modes, over the frequency."""

import warnings
from typing import Any

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.linalg import eigh
from scipy.sparse import csc_array, diags_array

import squeal
from squeal.errors import InputError, InputWarning
from squeal.io.system_files import read_system
from squeal.linear.damping import damped
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.queries.systems.matrices import write_system

M = np.array([[2.0, 0.5], [0.5, 1.0]])
A = np.array([[9.0, -1.0], [-1.0, 8.0]])
B = np.array([[4.0, 1.0], [1.0, 3.0]])
HEAD = "parameters: {lining: 1.5}\nM: [{file: m.mtx}, {file: zero.mtx, factor: lining}]\n"
TABLE = "frequency,storage,loss\n100,1.0,0.1\n1000,1.2,0.1\n3000,1.3,0.05\n"


@pytest.fixture
def read(tmp_path):
    matrices = {"m": M, "a": A, "b": B, "eta": 0.1 * B, "complex": A + 0.05j * A}
    matrices |= {"zero": 0.0 * M, "once": A + B, "twice": A + 2 * B}
    for name, matrix in matrices.items():
        mmwrite(tmp_path / f"{name}.mtx", csc_array(matrix))

    def made(text, table=TABLE):
        (tmp_path / "table.csv").write_text(table)
        (tmp_path / "system.yaml").write_text(HEAD + text)
        return read_system(tmp_path / "system.yaml")

    return made


LINING = "{file: b.mtx, factor: lining"


@pytest.mark.parametrize(
    ("text", "C", "K"),
    [
        (f"K: [{{file: a.mtx}}, {LINING}, structural: 0.1}}]", None, A + (1.5 + 0.15j) * B),
        (
            f"K: [{{file: a.mtx}}, {LINING}, structural: 0.1 * lining}}]\n"
            "damping: {structural: 0.02}",
            None,
            (1 + 0.02j) * A + (1.5 + 0.225j) * B,
        ),
        (
            f"K: [{{file: a.mtx}}, {LINING}}}]\n"
            "damping: {K4: [{file: eta.mtx, factor: lining}]}",
            None,
            A + (1.5 + 0.15j) * B,
        ),
        (
            f"K: [{{file: a.mtx}}, {LINING}, rayleigh: 0.01}}]\n"
            "damping: {rayleigh: [3.0, 0.002]}",
            3 * M + 0.002 * A + 0.015 * B,
            A + 1.5 * B,
        ),
        ("K: {file: complex.mtx}\ndamping: {structural: 0.01}", None, (1 + 0.06j) * A),
        (
            "K: [{file: once.mtx, factor: 2}, {file: twice.mtx, factor: -1},\n"
            "    {file: twice.mtx, structural: 0.1*lining},\n"
            "    {file: once.mtx, factor: -1, structural: 0.1*lining}]\n"
            "damping: {structural: 0.02}",
            None,
            (1 + 0.02j) * A + (1 + 0.15j) * B,
        ),
    ],
    ids=["term", "both", "K4", "rayleigh", "complex", "two runs"],
)
def test_each_kind_is_what_it_means_and_comes_back_from_its_export(read, tmp_path, text, C, K):
    given = read(text)
    write_system(tmp_path / "again", given.system, "mtx")
    for file in (given, read_system(tmp_path / "again" / "system.yaml")):
        found = file.system.arrays()
        assert found[2] == pytest.approx(K, rel=1e-14)
        assert (found[1] is None) if C is None else (found[1] == pytest.approx(C, rel=1e-14))
    assert [one.by for one in given.damped]


def test_a_table_of_ratios_damps_the_modes_in_its_range(read):
    file = read("K: [{file: a.mtx}]\ndamping: {ratios: {file: table.csv}}", _RATIOS)
    found = squeal.eigenvalues(file).eigenvalues[1::2]
    low, high = np.sqrt(eigh(A, M, eigvals_only=True))
    assert [e.damping_ratio for e in found] == pytest.approx([0.01 + 0.02 * (low - 1.0), 0.0])
    assert np.abs(found[1].value) == pytest.approx(high)


_RATIOS = f"frequency,ratio\n{1 / (2 * np.pi)},0.01\n{3 / (2 * np.pi)},0.05\n"


@pytest.mark.parametrize(("n", "table"), [(450, False), (450, True), (2100, True)])
@pytest.mark.filterwarnings("ignore:damping.ratios. modes above .* are not damped")
def test_few_modes_of_a_sparse_system_are_damped_by_rows_of_their_own(n, table):
    hertz = 2 * np.pi * np.arange(1.0, n + 1.0)
    pair = np.zeros((n, n))
    pair[:2, :2] = [[3.0, 4.0], [4.0, -3.0]]  # turns the first two
    K = csc_array(diags_array(hertz**2) + csc_array(pair))
    system = TermSystem((Term(csc_array(diags_array(np.ones(n)))),), (), (Term(K),))
    zeta = np.linspace(0.01, 0.03, 3)
    given: Any = (lambda f: np.where(f < 3.5, 0.01 * f, np.nan)) if table else zeta
    larger, (what,) = damped(system, ratios=given)
    assert what.value == pytest.approx(zeta, rel=5e-2)
    assert larger.n == n + 3
    found = squeal.eigenvalues(larger, modes=4)
    assert found.certified
    ratios = [root.damping_ratio for root in found.eigenvalues]
    assert ratios == pytest.approx(np.append(what.value, 0.0))


@pytest.mark.parametrize(("kind", "count"), [(np.asarray, 3), (csc_array, 46)])
@pytest.mark.filterwarnings("ignore:damping.ratios. modes above .* are not damped")
def test_modes_of_a_full_system_and_many_modes_fill_c(kind, count):
    n = 450
    K = np.diag((2 * np.pi * np.arange(1.0, n + 1.0)) ** 2)
    system = TermSystem((Term(kind(np.eye(n))),), (), (Term(kind(K)),))
    filled, _ = damped(system, ratios=[0.01] * count)
    assert filled.n == n
    _, C, _ = filled.at()
    assert C is not None
    assert C.diagonal()[: count + 1] == pytest.approx(
        np.append(0.04 * np.pi * np.arange(1.0, count + 1.0), 0.0)
    )


def test_modes_that_nothing_damps_beside_ratios_are_warned_of():
    """Where two of them meet, a search of thresholds does not end for minutes, and stays open."""
    mass = (Term(np.eye(3)),)
    stiffness = (Term(np.diag([1.0, 4.0, 9.0])),)
    with pytest.warns(InputWarning, match=r"modes above 0\.31831 Hz are not damped, and nothing"):
        damped(TermSystem(mass, (), stiffness), ratios=[0.01, 0.02])
    damped(TermSystem(mass, (), stiffness), ratios=[0.01, 0.02, 0.02])
    damped(TermSystem(mass, (), stiffness), ratios=[0.01, 0.02], rayleigh=(0.1, 0.0))
    damped(TermSystem(mass, (Term(np.eye(3)),), stiffness), ratios=[0.01, 0.02])


def test_modes_of_a_large_system_that_a_table_misses_are_warned_of(monkeypatch):
    monkeypatch.setattr("squeal.linear.damping.MOST_DENSE", 100)
    n = 150
    hertz = np.arange(1.0, n + 1.0)
    K = Term(csc_array(diags_array((2 * np.pi * hertz) ** 2)))
    system = TermSystem((Term(csc_array(diags_array(np.ones(n)))),), (), (K,))
    with pytest.warns(InputWarning, match="modes above 64 Hz are not damped") as warned:
        _, (what,) = damped(system, ratios=lambda f: np.full_like(f, 0.01))
    assert what.value == pytest.approx(np.full(64, 0.01))
    assert len(warned) == 1


@pytest.mark.parametrize(
    ("ratios", "message"),
    [
        (0.01, "one ratio for all modes of 150 rows is not allowed; above 100 rows it must be"),
        ([0.01] * 151, "151 ratios of 150 rows are not allowed; it must be at most one a row"),
    ],
)
def test_ratios_of_a_large_system_are_refused_by_what_was_given(monkeypatch, ratios, message):
    monkeypatch.setattr("squeal.linear.damping.MOST_DENSE", 100)
    diagonal = Term(csc_array(diags_array(np.arange(1.0, 151.0))))
    system = TermSystem((diagonal,), (), (diagonal,))
    with pytest.raises(InputError, match=message):
        damped(system, ratios=ratios)


@pytest.mark.parametrize("kind", [np.asarray, csc_array])
def test_ratios_of_a_system_without_any_mass_are_refused(kind):
    """Which ended in a division by zero: the shift of the pencil is |K| / |M|."""
    matrices = [Term(kind(X)) for X in (np.zeros((2, 2)), np.eye(2))]
    system = TermSystem((matrices[0],), (matrices[1],), (matrices[1],))
    with pytest.raises(InputError, match="M must be"):
        damped(system, ratios=[0.01])


MODULUS = "K: {file: a.mtx, modulus: {file: table.csv}}"
WRONG = [
    ("C: {file: a.mtx, structural: 0.1}\nK: {file: a.mtx}", TABLE, "structural"),
    ("C: {file: a.mtx, rayleigh: 0.1}\nK: {file: a.mtx}", TABLE, "rayleigh"),
    ("C: {file: a.mtx, modulus: {file: table.csv}}\nK: {file: a.mtx}", TABLE, "loss"),
    ("K: {file: a.mtx, structural: -0.1}", TABLE, "-0.1"),
    ("K: {file: a.mtx, structural: nu}", TABLE, "nu"),
    ("K: {file: a.mtx, structural: 0.1, modulus: {file: table.csv}}", TABLE, "modulus"),
    ("K: {file: a.mtx}\ndamping: {K4: {file: complex.mtx}}", TABLE, "complex"),
    ("K: {file: a.mtx, structural: 0.1}\ndamping: {structural: 0.1}", TABLE, "their own"),
    ("K: {file: a.mtx}\ndamping: {ratios: {file: table.csv}}", TABLE, "ratio"),
    (MODULUS, "frequency,storage,loss\n100,1,0.1\n100,1,0.1\n", "100"),
    (MODULUS, "frequency,storage,loss\n100,1,0.1\n200,1,-0.1\n", "-0.1"),
    (MODULUS, "frequency,loss\n100,1\n200,1\n", "storage"),
    (MODULUS, "frequency,storage,loss\n100,1,x\n200,1,0.1\n", "line 2"),
    (MODULUS, "frequency,storage,loss\n100,1,0.1\n", "1 lines"),
    (MODULUS, "", "frequency"),
]


@pytest.mark.parametrize(("text", "table", "word"), WRONG)
def test_damping_that_does_not_fit_its_term_or_table_is_refused(read, text, table, word):
    with pytest.raises(InputError, match=word):
        read(text, table)


def test_a_modulus_at_a_term_of_C_leaves_the_loss_of_the_whole_to_K(tmp_path):
    """q'' + 0.1 q' + (1 + 0.1 i) 100 q = 0, where the dashpot's table is 1 at all frequencies."""
    (tmp_path / "dashpot.csv").write_text("frequency,storage\n0,1\n100,1\n")
    (tmp_path / "s.yaml").write_text(
        "M: [[1]]\nC: [{matrix: [[0.1]], modulus: {file: dashpot.csv}}]\nK: [[100]]\n"
        "damping: {structural: 0.1}\n"
    )
    values = squeal.eigenvalues(read_system(tmp_path / "s.yaml"), band=(1.0, 5.0)).values
    exact = np.roots([1.0, 0.1, 100.0 * (1.0 + 0.1j)])
    assert values[values.imag > 0.0] == pytest.approx(exact[exact.imag > 0.0], rel=1e-9)


@pytest.mark.parametrize("own", ["", ", rayleigh: 0.01"])
@pytest.mark.parametrize("by", ["rayleigh: [2.0, 0.01]", "structural: 0.02"])
def test_damping_that_a_varied_parameter_does_not_change_is_warned_of(read, own, by):
    """Only where a parameter of that matrix is varied, and not of friction or a matrix's own."""
    terms = "K: [{file: a.mtx}, {file: b.mtx, factor: lining%s}, {file: eta.mtx, factor: mu}]\n"
    file = read(f"{terms % own}damping: {{{by}}}")
    held = own == "" or by.startswith("structural")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        squeal.eigenvalues(file)
        squeal.sweep(file, [0.0, 0.1])
        squeal.conditions(file, {"mu": [0.0, 0.1]})
    assert not any("damping" in str(one.message) for one in said)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        squeal.conditions(file, {"lining": [1.0, 2.0]})
        squeal.map(file, (squeal.Axis("lining", 1, 2, 2), squeal.Axis("mu", 0, 1, 2)))
    words = "damping does not follow lining, it is that of the given parameters"
    assert [words in str(one.message) for one in said] == [held] * len(said)
