"""Nothing is certified after a guess, nor a count where a root may lie on either side of an end."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array, eye_array, issparse

import squeal
from squeal.errors import InputError, InputWarning
from squeal.linear.system import TermSystem, without_supports
from squeal.linear.terms import Term
from squeal.queries.systems.roots import system_roots
from squeal.results.sources import EigenvalueSelection

CHAIN = "1,1,1,1,3\n1,1,2,1,-1\n2,1,2,1,2\n"
MASS = "1,1,1,1,1\n2,1,2,1,1\n"
FULL = CHAIN + "2,1,1,1,-1\n"


def case(tmp_path, K=FULL, M=MASS, keys="", factor="1 + mu", suffix="txt", C=""):
    (tmp_path / f"K.{suffix}").write_text(K)
    (tmp_path / "M.txt").write_text(M)
    text = f"M: {{file: M.txt}}\nK: {{file: K.{suffix}{keys}, factor: {factor}}}\n"
    if C:
        (tmp_path / "C.txt").write_text(C)
        text += "C: {file: C.txt}\n"
    (tmp_path / "system.yaml").write_text(text)
    return tmp_path / "system.yaml"


def held(tmp_path):
    rows = "".join(f"{i},1,{i},1,{i + 1}\n" for i in range(1, 5))
    return case(tmp_path, rows + "5,1,5,1,1e22\n", "".join(f"{i},1,{i},1,1\n" for i in range(1, 6)))


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        (lambda folder: case(folder, CHAIN), "each entry of one half is taken for both"),
        (lambda folder: case(folder, FULL + "1,1,1,1,0.5\n"), "1 entries of one place are summed"),
        (lambda folder: case(folder, M=MASS + "3,1,3,1,1\n"), "K lacks 1 row of M"),
        (lambda folder: case(folder, M="1,1,1,1,1\n"), "M lacks 1 row of K, taken as zero (a zero"),
        (lambda folder: case(folder, C=MASS + "3,1,3,1,1\n"), "K lacks 1 row of C"),
        (held, "1 row taken for supports and left out"),
    ],
)
def test_nothing_is_certified_after_a_guess(tmp_path, made, reason):
    with pytest.warns(InputWarning):
        file = squeal.read_system(made(tmp_path))
    answer = squeal.eigenvalues(file)
    assert not answer.certified
    assert "not certified: " in str(answer)
    assert reason in str(answer)
    located = squeal.thresholds(file, 0.5)
    assert located.certified is False
    assert reason in str(located)
    band = 0.01, 1.0
    assert not any(step.certified for step in squeal.sweep(file, [0.0, 0.1], band=band).steps)


def test_a_zero_in_the_file_of_m_confirms_a_row_without_mass(tmp_path):
    """As the message of the row that M lacks says."""
    file = squeal.read_system(case(tmp_path, M="1,1,1,1,1\n2,1,2,1,0\n"))
    assert not file.assumptions
    assert squeal.eigenvalues(file).certified


def test_supports_that_were_guessed_in_memory_are_not_certified():
    n = 5
    K = Term(np.diag([1.0, 2.0, 3.0, 4.0, 1e22]))
    system, rows = without_supports(TermSystem((Term(np.eye(n)),), (), (K,)))
    assert rows.tolist() == [4]
    answer = squeal.eigenvalues(system)
    assert answer.values.imag.max() == pytest.approx(2.0)
    assert not answer.certified
    assert "1 row taken for supports" in str(answer)


@pytest.mark.parametrize("keys", ["", ", symmetric: true"])
def test_what_a_user_says_is_no_guess(tmp_path, keys):
    file = squeal.read_system(case(tmp_path, CHAIN if keys else FULL, keys=keys))
    assert file.assumptions == ()
    answer = squeal.eigenvalues(file)
    assert answer.certified
    # the roots of 3 - s and 2 - s with -1 beside: s = (5 -+ sqrt 5) / 2
    exact = np.sqrt((5 + np.array([-1, 1]) * np.sqrt(5)) / 2)
    assert answer.values.imag[answer.values.imag > 0] == pytest.approx(exact)


@pytest.mark.parametrize("rows", [12, 500])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_root_within_its_error_of_the_end_is_listed_and_not_certified(rows, side):
    """Uncoupled masses of 1, 2, ... rad/s; the end lies just below or above that of 5 rad/s."""
    K = diags_array(np.arange(1.0, rows + 1) ** 2).tocsc()
    M = diags_array(np.ones(rows)).tocsc()
    system = TermSystem((Term(M),), (), (Term(K),))

    def add_errors(roots):
        return tuple(replace(root, error=2e-3, rounding=2e-3) for root in roots)

    end = 5.0 + side * 1e-3
    wanted = EigenvalueSelection((0.5 / (2 * np.pi), end / (2 * np.pi)))
    found = system_roots(system, wanted, add_errors=add_errors)
    assert [e.value.imag for e in found.eigenvalues] == pytest.approx([1, 2, 3, 4, 5])
    assert not found.certified
    assert "0.795775 Hz" in found.doubts[0]  # 5 rad/s
    assert found.count == (5 if side > 0 else 4)
    far = system_roots(system, replace(wanted, band=(0.5 / 2 / np.pi, 5.4 / 2 / np.pi)), add_errors)
    assert far.certified
    assert far.count == len(far.eigenvalues) == 5


def test_data_frames_have_the_same_labels_everywhere():
    pandas = pytest.importorskip("pandas")
    names = ["a", "b"]
    M = pandas.DataFrame(np.eye(2), names, names)
    K = pandas.DataFrame([[3.0, -1.0], [-1.0, 2.0]], names, names)
    exact = np.sqrt((5 + np.array([-1, 1]) * np.sqrt(5)) / 2)
    values = squeal.eigenvalues(squeal.System(M, K=K)).values
    assert values.imag[values.imag > 0] == pytest.approx(exact)
    turned = K.loc[names[::-1], names[::-1]]
    for other, words in (
        (turned, "index of K"),
        ({"1": K, "mu": turned}, "index of K mu"),
        (K[names[::-1]], "columns of K"),
        (pandas.DataFrame(K.to_numpy()), "index of K"),
    ):
        with pytest.raises(InputError, match=f"{words}: other labels"):
            squeal.System(M, K=other)
    with pytest.raises(InputError, match="index of C: other labels"):
        squeal.System(M, turned, K)
    twice = pandas.DataFrame(np.eye(2), ["a", "a"], ["a", "a"])
    with pytest.raises(InputError, match="index of M: the label a stands there 2 times"):
        squeal.System(twice, K=twice)


def test_labels_name_the_rows_of_vectors(tmp_path):
    """Uncoupled masses: mode 1 moves the one of the softest spring, whatever it is called."""
    pandas = pytest.importorskip("pandas")
    names = ["pad.z", "disc.z", "held"]
    M = pandas.DataFrame(np.eye(3), names, names)
    K = pandas.DataFrame(np.diag([4.0, 1.0, 1e22]), names, names)
    with pytest.warns(InputWarning, match="the first is row 3, held"):
        found = squeal.eigenvalues(squeal.System(M, K=K))
    assert found.coordinates == found.shapes["coordinates"] == ["pad.z", "disc.z"]
    assert found.shapes["shapes"][0]["real"] == pytest.approx([0.0, 1.0])
    by_node = pandas.MultiIndex.from_tuples([(7, 1), (5, 2)])
    system = squeal.System(np.eye(2), K=pandas.DataFrame(np.diag([4.0, 1.0]), by_node, by_node))
    assert squeal.eigenvalues(system).coordinates == ["7:1", "5:2"]
    file = squeal.read_system(case(tmp_path))
    assert squeal.eigenvalues(file).coordinates == ["1:1", "2:1"]
    assert squeal.eigenvalues(squeal.System(np.eye(2), K=np.eye(2))).coordinates == ["q1", "q2"]


def test_changes_of_matrices_stand_on_the_rows_that_their_labels_name(tmp_path):
    """d lambda / dq = i / (2 sqrt(k)) of the mass that the spring q holds, 0 of the other."""
    pandas = pytest.importorskip("pandas")
    rows = [(7, 1), (5, 2)]
    names = pandas.MultiIndex.from_tuples(rows)
    system = squeal.System(np.eye(2), K=pandas.DataFrame(np.diag([4.0, 1.0]), names, names))
    (tmp_path / "softer.txt").write_text("5,2,5,2,1\n7,1,7,1,0\n")
    dK = pandas.DataFrame(np.diag([0.0, 1.0]), names, names)
    for given in (dK, str(tmp_path / "softer.txt")):
        found = squeal.sensitivity(system, matrices={"q": {"K": given}})
        slopes = dict(zip(np.round(np.imag(found.at), 9), found.slopes["q"], strict=True))
        assert slopes[1.0] == pytest.approx(0.5j)
        assert slopes[2.0] == pytest.approx(0.0)
    turned = dK.loc[rows[::-1], rows[::-1]]
    with pytest.raises(InputError, match=r"q\.K: .*other labels"):
        squeal.sensitivity(system, matrices={"q": {"K": turned}})


def test_data_frames_of_sparse_columns_stay_sparse():
    """A chain held at both ends."""
    pandas = pytest.importorskip("pandas")
    rows = 5
    chain = diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(rows, rows)).tocsc()
    M = pandas.DataFrame.sparse.from_spmatrix(eye_array(rows).tocsc())
    K = pandas.DataFrame.sparse.from_spmatrix(chain)
    system = squeal.System(M, K=K)
    assert issparse(system.K[0].matrix)
    exact = 2.0 * np.sin(np.arange(1, rows + 1) * np.pi / (2 * rows + 2))
    values = squeal.eigenvalues(system).values.imag
    assert values[values > 0] == pytest.approx(exact)


class DataArray:
    """What a data array of xarray shows of itself: values, names of its dimensions, labels."""

    def __init__(self, data, **labels):
        self.data = data
        self.dims = tuple(labels)
        self.indexes = labels

    def __array__(self, dtype=None, copy=None):
        return np.asarray(self.data, dtype)


def test_data_arrays_are_taken_by_their_labels():
    K = np.array([[3.0, -1.0], [-1.0, 2.0]])
    names = {"row": ["a", "b"], "column": ["a", "b"]}
    M = DataArray(np.eye(2), **names)
    exact = np.sqrt((5 + np.array([-1, 1]) * np.sqrt(5)) / 2)
    for entries in (K, csc_array(K)):
        values = squeal.eigenvalues(squeal.System(M, K=DataArray(entries, **names))).values
        assert values.imag[values.imag > 0] == pytest.approx(exact)
    with pytest.raises(InputError, match="index of K: other labels"):
        squeal.System(M, K=DataArray(K, row=["b", "a"], column=["b", "a"]))
