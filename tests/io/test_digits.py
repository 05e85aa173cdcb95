"""Free structures in files of ten digits, against the exact matrices that were written.

The structures are made of beam elements in closed form (Przemieniecki, Theory of Matrix Structural
Analysis, 1968, sections 5.6 and 11.5), and their frequencies are those of SciPy's `eigh`.
"""

import itertools
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.linalg import eigh

import squeal
from squeal.errors import InputWarning
from squeal.io.digits import written_digits
from squeal.io.matrices import precision_of_file, read_matrix
from squeal.linear.precision import half_units
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.proof.balls import half_widths
from tests.data import free_structures

DATA = Path(free_structures.__file__).parent

NAMES = ("dmig", "fields", "market", "abaqus", "boeing")


def symmetric(upper):
    """The matrix whose triangle above and on the diagonal is given."""
    return upper + np.triu(upper, 1).T


def element(length, E=2.1e11, nu=0.3, rho=7850.0, a=0.0317, b=0.0213):
    """Stiffness and consistent mass (12, 12) of a beam along x: u v w and rotations, two nodes."""
    A = a * b
    Iy = a * b**3 / 12
    Iz = b * a**3 / 12
    J = Iy + Iz
    G = E / 2 / (1 + nu)
    K = np.zeros((12, 12))
    M = np.zeros((12, 12))
    for i, stiff, mass in ((0, E * A, rho * A), (3, G * J, rho * J)):
        own = np.ix_([i, i + 6], [i, i + 6])
        K[own] += stiff / length * np.array([[1, -1], [-1, 1]])
        M[own] += mass * length / 6 * np.array([[2, 1], [1, 2]])
    h = length
    bend = np.array([[12, 6 * h, -12, 6 * h], [0, 4 * h * h, -6 * h, 2 * h * h]])
    bend = symmetric(np.vstack([bend, [[0, 0, 12, -6 * h], [0, 0, 0, 4 * h * h]]]))
    move = np.array([[156, 22 * h, 54, -13 * h], [0, 4 * h * h, 13 * h, -3 * h * h]])
    move = symmetric(np.vstack([move, [[0, 0, 156, -22 * h], [0, 0, 0, 4 * h * h]]]))
    for rows, sign, inertia in (([1, 5, 7, 11], 1, Iz), ([2, 4, 8, 10], -1, Iy)):
        turn = np.diag([1.0, sign, 1.0, sign])
        K[np.ix_(rows, rows)] += E * inertia / h**3 * turn @ bend @ turn
        M[np.ix_(rows, rows)] += rho * A * h / 420 * turn @ move @ turn
    return K, M


def frame(points, directions=range(6)):
    """K, M and the labels of a chain of beams through points (m, 3), of some of its directions."""
    n = 6 * len(points)
    K = np.zeros((n, n))
    M = np.zeros((n, n))
    for k, (start, end) in enumerate(itertools.pairwise(points)):
        length = np.linalg.norm(end - start)
        x = (end - start) / length
        z = np.cross(x, [0.0, 1.0, 0.0]) if abs(x[1]) < 0.9 else np.array([0.0, 0.0, 1.0])
        z = np.array([0.0, 0.0, 1.0]) if abs(x[2]) < 1e-12 else z / np.linalg.norm(z)
        T = np.kron(np.eye(4), np.array([x, np.cross(z, x), z]))
        rows = slice(6 * k, 6 * k + 12)
        for whole, own in zip((K, M), element(length), strict=True):
            whole[rows, rows] += T.T @ own @ T
    kept = [6 * i + d for i in range(len(points)) for d in directions]
    labels = [(i + 1, d + 1) for i in range(len(points)) for d in directions]
    return K[np.ix_(kept, kept)], M[np.ix_(kept, kept)], labels


def structure(name, parts=8):
    s = np.linspace(0.0, 1.0, parts + 1) ** 1.1
    if name == "beam":
        return frame(np.outer(s, [1.37, 0, 0]), (1, 5))
    if name == "plane":
        return frame(np.array([s, 0.7 * s**2, 0 * s]).T, (0, 1, 5))
    return frame(np.array([s, 0.7 * s**2, 0.3 * np.sin(3 * s)]).T)


FREE = {"beam": 2, "plane": 3, "space": 6}


def lower(A):
    """Rows and columns of what is not zero in the lower triangle, column by column."""
    columns, rows = np.nonzero(np.tril(A).T)
    return list(zip(rows.tolist(), columns.tolist(), strict=True))


def write(folder, form, matrices, labels):
    """A system file of symmetric matrices by name, written with ten digits."""
    lines = ["name: free"]
    for name, A in matrices.items():
        text = ""
        keys = ""
        if form in ("dmig", "fields"):
            text = f"DMIG    {name:8s}       0       6       2       0          {len(A):14d}\n"
            for c in range(len(A)):
                text += f"DMIG*   {name:8s}        {labels[c][0]:16d}{labels[c][1]:16d}\n"
                for r in range(c, len(A)):
                    if A[r, c]:
                        value = f"{A[r, c]:16.9E}".replace("E", "D")
                        if form == "fields" and A[r, c] > 0.0:  # as pyNastran writes them
                            value = f"{A[r, c]:16.10E}".replace("E", "D")
                        text += f"*       {labels[r][0]:16d}{labels[r][1]:16d}{value}\n"
        elif form == "market":
            text = f"%%MatrixMarket matrix coordinate real symmetric\n{len(A)} {len(A)} "
            text += f"{len(lower(A))}\n"
            text += "".join(f"{r + 1} {c + 1} {A[r, c]:.9e}\n" for r, c in lower(A))
        elif form == "abaqus":
            each = ((*labels[r], *labels[c], A[r, c]) for r, c in lower(A))
            text = "".join(f"{a}, {i}, {b}, {j}, {v:.9e}\n" for a, i, b, j, v in each)
            keys = ", symmetric: true"
        else:
            places = lower(A)
            in_column = np.bincount([c for _, c in places], minlength=len(A))
            counts = np.cumsum([1, *in_column])

            def card(numbers, each, width, shown):
                lines = ""
                for k in range(0, len(numbers), each):
                    row = [shown(x).rjust(width) for x in numbers[k : k + each]]
                    lines += "".join(row) + "\n"
                return lines

            parts = [
                card(list(counts), 8, 10, str),
                card([r + 1 for r, _ in places], 8, 10, str),
                card([A[r, c] for r, c in places], 4, 17, lambda x: f"{x:.9E}"),
            ]
            count = [part.count("\n") for part in parts]
            text = f"{'free':72s}{name:8s}\n{sum(count):14d}"
            text += "".join(f"{k:14d}" for k in count) + f"{0:14d}\n"
            text += f"{'RSA':14s}{len(A):14d}{len(A):14d}{len(places):14d}{0:14d}\n"
            text += f"{'(8I10)':16s}{'(8I10)':16s}{'(4E17.9)':20s}\n" + "".join(parts)
        suffix = {"dmig": "pch", "fields": "bdf", "market": "mtx", "abaqus": "txt", "boeing": "hb"}[
            form
        ]
        (folder / f"{name}.{suffix}").write_text(text)
        lines.append(f"{name}: {{file: {name}.{suffix}{keys}}}")
    (folder / "free.yaml").write_text("\n".join(lines) + "\n")
    return squeal.read_system(folder / "free.yaml")


@pytest.mark.parametrize("form", NAMES)
@pytest.mark.parametrize("name", FREE)
def test_free_motions_of_ten_digits_neither_grow_nor_decay(tmp_path, name, form):
    K, M, labels = structure(name)
    exact = np.sqrt(eigh(K, M, eigvals_only=True)[FREE[name] :])
    file = write(tmp_path, form, {"M": M, "K": K}, labels)
    assert {term.digits for term in file.system.terms} == {10}
    check = squeal.check(file, modes=5)
    assert (check.free, check.negative, check.hints) == (FREE[name], 0, ())
    assert 2 * np.pi * np.array(check.frequencies_hz) == pytest.approx(exact[:5], rel=1e-6)
    answer = squeal.eigenvalues(file)
    assert answer.verdict is None
    assert not answer.unstable
    assert "10 digits of" in answer.criterion
    flexible = [
        root for root in answer.eigenvalues if not root.sign_is_open and root.value.imag > 0.0
    ]
    assert len(answer.eigenvalues) - 2 * len(flexible) == 2 * FREE[name]
    for root, omega in zip(flexible, exact, strict=True):
        assert abs(root.value - 1j * omega) <= 1e-6 * omega
        assert abs(root.value - 1j * omega) <= root.error + 1e-9 * omega


@pytest.mark.parametrize("name", free_structures.STRUCTURES)
def test_free_motions_in_files_that_pynastran_writes(tmp_path, name):
    make, free = free_structures.STRUCTURES[name]
    K, M, _ = make()
    exact = np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=(free, free + 4)))
    text = (DATA / f"{name}.bdf").read_text()
    (tmp_path / "free.bdf").write_text(text)
    (tmp_path / "free.yaml").write_text(
        "M: {file: free.bdf, key: MAAX}\nK: {file: free.bdf, key: KAAX}\n"
    )
    file = squeal.read_system(tmp_path / "free.yaml")
    assert {term.digits for term in file.system.terms} == {10}
    check = squeal.check(file, modes=5)
    assert (check.free, check.negative) == (free, 0)
    assert 2 * np.pi * np.array(check.frequencies_hz) == pytest.approx(exact, rel=1e-6)
    for prove in (False, True):
        answer = squeal.eigenvalues(file, prove=prove)
        assert answer.verdict is None
        assert not answer.unstable


def test_roots_in_a_band_of_a_large_free_structure_are_exact_within_their_errors(tmp_path):
    K, M, labels = structure("beam", 210)  # 422 rows
    exact = np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=(2, 5)))
    file = write(tmp_path, "market", {"M": M, "K": K}, labels)
    check = squeal.check(file, modes=4)
    assert (check.free, check.negative) == (2, 0)
    top = 1.1 * exact[-1] / 2 / np.pi
    answer = squeal.eigenvalues(file, band=(0.5 * exact[0] / 2 / np.pi, top))
    assert not answer.unstable
    for root, omega in zip(answer.eigenvalues, exact, strict=True):
        assert abs(root.value - 1j * omega) <= root.error + 1e-9 * omega


def two(tmp_path, b, gap=0.0, number="{:.9e}"):
    """K = [[a, b], [-b, a + gap]] with 10 digits: lambda^2 = -(a + gap / 2) -+ the root of
    gap^2 / 4 - b^2."""
    a = 1.234567891
    entries = ((1, 1, a), (1, 2, b), (2, 1, -b), (2, 2, a + gap))
    text = "%%MatrixMarket matrix coordinate real general\n2 2 4\n"
    text += "".join(f"{i} {j} {number.format(x)}\n" for i, j, x in entries)
    (tmp_path / "K.mtx").write_text(text)
    (tmp_path / "two.yaml").write_text("M: [[1, 0], [0, 1]]\nK: {file: K.mtx, factor: 1 + mu}\n")
    return squeal.read_system(tmp_path / "two.yaml")


def test_flutter_above_the_digits_is_flutter_and_below_is_open(tmp_path):
    found = squeal.eigenvalues(two(tmp_path, 1.234567891e-4))
    rate = np.sqrt(-1.234567891 + 1.234567891e-4j).real
    assert found.verdict == "flutter"
    assert found.unstable[0].growth_rate == pytest.approx(rate, rel=1e-6)
    # the diagonals differ by one unit of the last digit: so may the sign of gap^2 / 4 - b^2
    for b in (0.52e-9, 0.48e-9):
        found = squeal.eigenvalues(two(tmp_path, b, gap=1e-9))
        assert found.verdict is None
        assert not found.unstable
        assert "10 digits of K.mtx" in str(found)
    located = squeal.thresholds(two(tmp_path, 0.52e-9, gap=1e-9), 0.5)
    # but growth by more than the proof leaves out is excluded by the digits, too
    assert (located.verdict, located.certified) == (None, True)
    assert abs(0.52e-9) < located.proof["growth_below"]


@pytest.mark.parametrize("number", ["{:.3g}", "{:.17g}", "{:.16e}"])
def test_short_and_whole_numbers_are_exact(tmp_path, number):
    file = two(tmp_path, 0.5, number=number)
    assert {term.digits for term in file.system.terms} == {None}
    assert squeal.eigenvalues(file).verdict == "flutter"


def test_written_digits_are_those_of_most_numbers_or_none():
    assert written_digits(["0.00123456", "12.3456D+02", "-1.23457-3"]) == 6
    assert written_digits(["2.0", "-1", "0.5"]) is None
    assert written_digits(["1000000000.0", "-2.0000000000"]) is None
    assert written_digits(["1.23456789", "2.5", "-1"]) is None
    assert written_digits([]) is None
    # in fields of 16 characters a sign takes the place of a digit
    assert written_digits(["5.9437106293D+08", "3.9178628851D+07", "-5.943710629D+08"]) == 10


def test_modes_of_an_indefinite_mass_may_meet_and_grow_within_the_digits(tmp_path):
    """Krein: K = diag(1.234564, -1.234576), within half units of the file, grows by 3.5e-6."""
    lines = ["%%MatrixMarket matrix coordinate real general", "2 2 4"]
    lines += ["1 1 1.23456", "2 2 -1.23458", "1 2 9.87654e-06", "2 1 9.87654e-06"]
    (tmp_path / "K.mtx").write_text("\n".join(lines) + "\n")
    (tmp_path / "S.yaml").write_text("M: [[1, 0], [0, -1]]\nK: {file: K.mtx}\n")
    coupling = 9.87654e-06
    near = np.array([[1.234564, coupling], [-coupling, 1.234576]])  # M^-1 K
    squares = np.linalg.eigvals(near).astype(complex)
    assert np.max(np.sqrt(-squares).real) == pytest.approx(3.5e-6, rel=0.01)
    with pytest.warns(InputWarning, match="M is no mass"):
        found = squeal.eigenvalues(squeal.read_system(tmp_path / "S.yaml"), prove=False)
    assert found.verdict is None


@pytest.mark.parametrize(("digits", "known"), [(9, 10), (16, None)])
def test_text_of_op4_has_the_digits_of_its_format(tmp_path, digits, known):
    with np.printoptions():
        op4 = pytest.importorskip("pyyeti.nastran.op4")
    K = np.array([[2.0 / 3.0, -1.0 / 3.0], [-1.0 / 3.0, 5.0 / 7.0]])
    op4.write(str(tmp_path / "K.op4"), {"KAA": K}, binary=False, digits=digits)
    assert read_matrix(tmp_path / "K.op4").digits == known


def test_floats_of_matlab_in_single_precision_have_its_digits(tmp_path):
    K = np.array([[2.0 / 3.0, -1.0 / 3.0], [-1.0 / 3.0, 5.0 / 7.0]])
    savemat(tmp_path / "K.mat", {"K": K.astype(np.float32), "C": K})
    (tmp_path / "s.yaml").write_text(
        "M: [[1, 0], [0, 1]]\nK: {file: K.mat, key: K}\nC: {file: K.mat, key: C}\n"
    )
    system = squeal.read_system(tmp_path / "s.yaml").system
    assert system.K[0].digits == 7
    errors = system.K[0].data_errors.toarray()
    assert np.array_equal(errors, np.spacing(np.abs(K).astype(np.float32)) / 2)
    assert system.C[0].digits is None


@pytest.mark.parametrize("digits", [1, 3, 10, 15])
def test_what_the_solvers_allow_for_digits_is_no_less_than_what_the_referee_does(digits):
    """Next below a power of ten the unit was a tenth of that of the power, which prints so."""
    powers = 10.0 ** np.arange(-270, 280)
    numbers = np.concatenate([powers, np.nextafter(powers, 0.0), np.nextafter(powers, np.inf)])
    numbers = np.append(numbers, np.random.default_rng(6).normal(size=500))
    units = half_units(numbers[:, None], digits).toarray()
    assert np.all(units >= half_widths(numbers[:, None], f"{digits} digits"))


@pytest.mark.parametrize("form", ["market", "abaqus", "triples"])
def test_soft_rows_of_a_file_of_fixed_decimals_are_known_to_these(tmp_path, form):
    """Most entries have ten digits, the soft ones four: as if of ten they were certified flutter.

    Their difference, 4e-7, is lost in the file, and with it the system is marginal.
    """
    stiff = [12345.678901, 23456.789012, 34567.890123, 45678.901234]
    K = np.diag([*stiff, 0.0012354, 0.001235])
    head = {"market": "%%MatrixMarket matrix coordinate real general\n6 6 6\n"}.get(form, "")
    numbers = "{0} 1 {0} 1 {1:.6f}\n" if form == "abaqus" else "{0} {0} {1:.6f}\n"
    lines = [numbers.format(row, entry) for row, entry in enumerate(np.diag(K), 1)]
    (tmp_path / "K.mtx").write_text(head + "".join(lines))
    given = read_matrix(tmp_path / "K.mtx", symmetric=True)
    precision = precision_of_file(given, given.matrix)
    assert precision.digits == 4
    assert precision.errors is not None
    assert np.all(np.abs(given.matrix - K) <= precision.errors.toarray())
    assert precision.errors.max() < 5.1e-7
    circulatory = np.zeros((6, 6))
    circulatory[4, 5] = 1e-7
    circulatory[5, 4] = -1e-7
    exact = squeal.System(np.eye(6), K=K + circulatory)
    assert squeal.eigenvalues(exact).verdict == "marginal"
    term = Term(given.matrix, digits=precision.digits, errors=precision.errors)
    known = TermSystem((Term(np.eye(6)),), (), (term, Term(circulatory)))
    found = squeal.eigenvalues(known)
    assert (found.verdict, found.certified) == (None, False)


def test_great_numbers_of_fixed_decimals_have_digits_before_the_point_too(tmp_path):
    """2345.6789 has eight digits; those of 1.0000, five, were reported of all greater numbers."""
    head = "%%MatrixMarket matrix array real general\n2 2\n"
    (tmp_path / "K.mtx").write_text(f"{head}12345.6789\n0.0000\n0.0000\n2345.6789\n")
    (tmp_path / "s.yaml").write_text("M: [[1,0],[0,1]]\nK: {file: K.mtx}\n")
    (stiffness,) = squeal.read_system(tmp_path / "s.yaml").system.K
    assert stiffness.digits == 8
    assert stiffness.errors.max() == pytest.approx(0.5e-4)


def test_of_a_key_and_of_decimals_each_entry_has_the_wider_error(tmp_path):
    """Three digits leave 50 of 12345.678901 open, and six decimals 5e-7 of 0.000012."""
    head = "%%MatrixMarket matrix array real general\n2 2\n"
    (tmp_path / "K.mtx").write_text(f"{head}12345.678901\n0.000012\n0.000012\n23456.789012\n")
    (tmp_path / "s.yaml").write_text("M: [[1,0],[0,1]]\nK: {file: K.mtx, digits: 3}\n")
    (stiffness,) = squeal.read_system(tmp_path / "s.yaml").system.K
    assert stiffness.errors.toarray() == pytest.approx(np.array([[50.0, 5e-7], [5e-7, 50.0]]))


def test_a_scale_factor_widens_the_decimals_of_a_matrix(tmp_path):
    keywords = "*MATRIX INPUT, NAME=K, SCALE FACTOR=2000."
    (tmp_path / "K.mtx").write_text(f"{keywords}\n1,1,1,1,12345.678901\n2,1,2,1,23456.000012\n")
    half_unit = 0.5 * 10.0 ** -read_matrix(tmp_path / "K.mtx").decimals
    assert 2000.0 * 5e-7 <= half_unit <= 10 * 2000.0 * 5e-7


def test_mirrored_roots_of_complex_matrices_are_no_motions_within_digits(tmp_path):
    """(1 + 0.1 i) K of a positive definite K damps all motions."""
    (tmp_path / "M.mtx").write_text(
        "%%MatrixMarket matrix array real general\n2 2\n1.000\n0.000\n0.000\n1.000\n"
    )
    (tmp_path / "K.mtx").write_text(
        "%%MatrixMarket matrix array real general\n2 2\n4.000\n1.000\n1.000\n9.000\n"
    )
    (tmp_path / "s.yaml").write_text(
        "M: {file: M.mtx, digits: 4}\nK: {file: K.mtx, digits: 4}\n"
        "damping:\n  K4:\n    - {file: K.mtx, factor: '0.1', digits: 4}\n"
    )
    system = squeal.read_system(tmp_path / "s.yaml")
    for prove in (True, False):
        found = squeal.eigenvalues(system, prove=prove)
        assert (found.verdict, found.unstable) == ("stable", ())


LEFT = np.array([[1.25, 0.125], [0.375, 1.25]])
RIGHT = np.array([[0.75, -0.125], [-0.375, 0.75]])  # the sum is 2 times the identity


@pytest.mark.parametrize("prove", [True, False])
def test_terms_of_few_digits_that_are_symmetric_in_sum_alone_leave_flutter_open(prove):
    """Within six digits an entry of one may grow, and the mirrored one of the other shrink."""
    terms = (Term(LEFT, digits=6), Term(RIGHT, digits=6))
    found = squeal.eigenvalues(TermSystem((Term(np.eye(2)),), (), terms), prove=prove)
    assert (found.verdict, found.certified) == (None, False)


def test_digits_of_matrices_in_the_system_file_itself_have_no_file_name(tmp_path):
    terms = "".join(f"  - {{matrix: {term.tolist()}, digits: 6}}\n" for term in (LEFT, RIGHT))
    (tmp_path / "s.yaml").write_text(f"M: [[1, 0], [0, 1]]\nK:\n{terms}")
    found = squeal.eigenvalues(squeal.read_system(tmp_path / "s.yaml"))
    assert "within what the digits of the matrices leave open" in str(found)


@pytest.mark.parametrize("prove", [True, False])
def test_halves_of_few_digits_in_two_terms_leave_flutter_open(prove):
    """Nothing says that the second term is the mirror image of the first one."""
    upper = np.array([[2.25, 0.125], [0.0, 2.25]])
    lower = np.array([[0.0, 0.0], [0.125, 0.0]])
    uncoupling = np.array([[0.0, -0.125], [-0.125, 0.0]])  # exact: a double root is left
    terms = (Term(upper, digits=6), Term(lower, digits=6), Term(uncoupling))
    found = squeal.eigenvalues(TermSystem((Term(np.eye(2)),), (), terms), prove=prove)
    assert (found.verdict, found.certified) == (None, False)


@pytest.mark.parametrize("prove", [True, False])
def test_a_double_root_of_symmetric_terms_of_few_digits_stays_on_the_axis(prove):
    """Friction beside them does not matter while its coefficient is zero."""
    one = Term(np.diag([1.25, 1.25]), digits=6)
    other = Term(np.diag([0.75, 0.75]), digits=6)
    friction = Term(np.array([[0.0, 1.0], [0.0, 0.0]]), Formula("mu"), digits=6)
    known = TermSystem((Term(np.eye(2)),), (), (one, other, friction), {"mu": 0.0})
    found = squeal.eigenvalues(known, prove=prove)
    assert (found.verdict, found.certified) == ("marginal", prove)


@pytest.mark.parametrize("damped", [False, True])
def test_a_double_root_of_rounded_sums_is_proved_beside_friction_that_is_zero(damped):
    """A damper of another row does not matter either."""
    coupled = np.eye(4)
    coupled[:3, :3] += 1.0  # with the eigenvalues 1, 1 and 4
    third = Term(coupled, Formula("1/3"))
    seventh = Term(coupled, Formula("1/7"))
    coupling = np.zeros((4, 4))
    coupling[0, 1] = 1.0
    friction = Term(coupling, Formula("mu"))
    damper = Term(np.diag([0.0, 0.0, 0.0, 0.1 if damped else 0.0]))
    known = TermSystem((Term(np.eye(4)),), (damper,), (third, seventh, friction), {"mu": 0.0})
    found = squeal.eigenvalues(known)
    assert (found.verdict, found.certified) == ("marginal", True)
