"""What is known of where a system comes from goes with it: assumptions, and digits of its data.

The tests of files hold two rows whose growth hangs on the last of six digits.
"""

import itertools
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import fsolve
from scipy.sparse import csc_array, eye_array

import squeal
from squeal.cli.main import main
from squeal.io.matrices import write_matrix
from squeal.linear.damping import damped
from squeal.linear.system import TermSystem, without_supports
from squeal.linear.terms import Term, sum_of_terms
from squeal.numerics.differentiation import Formula
from squeal.queries.systems import sensitivity
from squeal.queries.systems.matrices import write_components, write_system
from squeal.queries.systems.sensitivity import with_matrices
from squeal.queries.systems.system_analysis import SystemAnalysis

pytestmark = pytest.mark.filterwarnings("ignore:.*no matrix depends on")
FORMATS = ("mtx", "npz", "mat")
HEAD = "%%MatrixMarket matrix array real general\n"
# k12 k21 = -1, k22 - k11 = 2 - 2e-5: it grows as written, by 1.3e-3 1/s, not within half a unit
SIX_DIGITS = HEAD + "2 2\n2.00001e+00\n-1.00000e+00\n1.00000e+00\n3.99999e+00\n"


def six_digits(folder, keys=""):
    folder.mkdir(exist_ok=True)
    (folder / "k.mtx").write_text(SIX_DIGITS)
    (folder / "nodes.csv").write_text("node,dof,x,y,z\n1,1,0,0,0\n2,1,1,0,0\n")
    text = "M: [[1, 0], [0, 1]]\nK: {file: k.mtx}\ncoordinates: {file: nodes.csv}\n"
    (folder / "two.yaml").write_text(text + keys)
    return folder / "two.yaml"


def joined(folder, keys=""):
    six_digits(folder)
    (folder / "one.csv").write_text("node,dof,x,y,z\n1,1,1,0,0\n")
    (folder / "one.yaml").write_text(
        "M: [[1.0]]\nC: [[0.1]]\nK: [[3.0]]\ncoordinates: {file: one.csv}\n"
    )
    (folder / "pairs.csv").write_text("first,second\n2,1\n")
    (folder / "joined.yaml").write_text(
        f"components:\n  a: {{file: two.yaml{keys}}}\n  b: {{file: one.yaml}}\n"
        "contact:\n  - {between: [a, b], pairs: {file: pairs.csv}, normal: [1, 0, 0],"
        " stiffness: 1.0e-12, bonded: true}\n"
    )
    return folder / "joined.yaml"


def one():
    system = squeal.System([[1.0]], C=[[0.1]], K=[[1e4]], name="one")
    return squeal.Component(system, ["a"], [0])


def with_one(system):
    """The system, joined by a weak bond to a body of its own."""
    nodes = [str(i) for i in range(system.n)]
    contact = squeal.Contact((system.name, "one"), [("0", "a")], (1, 0, 0), 1e-12, bonded=True)
    return squeal.assemble([squeal.Component(system, nodes, [0] * system.n), one()], [contact])


def assert_open_by_digits(subject):
    found = squeal.eigenvalues(subject)
    assert (found.verdict, found.certified, found.proof["data"]) == (None, False, "6 digits")
    located = squeal.thresholds(subject, 1.0)
    assert (located.verdict, located.certified) == (None, False)
    assert located.proof["status"] == "open"


def assert_not_certified(subject, reason, high=60.0):
    found = squeal.eigenvalues(subject)
    assert found.certified is False
    assert found.proof["status"] == "open"
    assert reason in found.proof["reason"]
    located = squeal.thresholds(subject, high)
    assert located.certified is False
    assert reason in str(located)
    assert not any(step.certified for step in squeal.sweep(subject, [0.0, 1.0]).steps)


def shaft():
    """Three slow whirling pairs and one at 100 Hz, which a circulatory force makes unstable."""
    omega = 2 * np.pi * np.array([1.0, 1, 2, 2, 3, 3, 100, 100])
    circulatory = np.zeros((8, 8))
    circulatory[6, 7] = 1e3
    circulatory[7, 6] = -1e3
    return squeal.System(
        np.eye(8),
        C=0.4 * np.eye(8),
        K={"1": np.diag(omega**2), "speed": circulatory},
        parameters={"speed": 30.0},
        parameter="speed",
        name="shaft",
    )


@pytest.mark.parametrize(
    ("suffix", "method"), [*((suffix, "reduced") for suffix in FORMATS), (FORMATS[0], "modal")]
)
def test_a_reduced_system_that_was_exported_is_not_certified(tmp_path, method, suffix):
    folder = tmp_path / "full"
    write_system(folder, shaft(), suffix)
    words = ["export", str(folder / "system.yaml"), "--method", method, "--band", "0.5:3.5"]
    assert main([*words, "--output", str(tmp_path / "out"), "--format", suffix]) == 0
    read = squeal.read_system(tmp_path / "out" / "system.yaml")
    assert_not_certified(read, "a reduced system approximates")
    # exported again, and joined
    write_system(tmp_path / "again", read.system, suffix)
    assert_not_certified(squeal.read_system(tmp_path / "again" / "system.yaml"), "approximates")
    assert_not_certified(with_one(replace(read.system, name="shaft")), "shaft: a reduced system")


def test_a_reduced_system_is_not_certified_as_a_component():
    reduced = squeal.reduce(shaft(), band=(0.5, 3.5), method="modal")
    assert_not_certified(with_one(reduced), "shaft: a reduced system approximates")


def test_assumptions_are_texts_of_the_user_too(tmp_path):
    text = "M: [[1.0]]\nC: [[0.1]]\nK: [[4.0]]\nassumptions: [the bolts are left out]\n"
    (tmp_path / "s.yaml").write_text(text)
    assert_not_certified(squeal.read_system(tmp_path / "s.yaml"), "the bolts are left out", 1.0)
    (tmp_path / "s.yaml").write_text(text.replace("[the bolts are left out]", "none"))
    with pytest.raises(squeal.InputError, match="assumptions: 'none'"):
        squeal.read_system(tmp_path / "s.yaml")


def chain(rows):
    K = 2.0 * np.eye(rows) - np.eye(rows, k=1) - np.eye(rows, k=-1)
    system = squeal.System(np.eye(rows), C=0.01 * K, K=K, name="chain")
    return squeal.Component(system, [str(i) for i in range(rows)], [0] * rows)


def test_joined_components_that_were_reduced_are_not_certified(tmp_path):
    """Up to 400 rows certified is true exactly where the status is proved."""
    small = chain(12).reduced(["0"], cutoff=0.2)
    assert_not_certified(small.system, "reduced to its modes up to 0.2 Hz", 1.0)
    contact = squeal.Contact(("chain", "one"), [("0", "a")], (1, 0, 0), 1.0, bonded=True)
    assert_not_certified(squeal.assemble([small, one()], [contact]), "chain: reduced to its", 1.0)
    whole = squeal.assemble([chain(12), one()], [contact])
    assert squeal.eigenvalues(whole).certified
    cut = squeal.assemble([chain(12), one()], [contact], cutoff=0.2)
    assert_not_certified(cut, "chain: reduced to its modes", 1.0)
    write_components(tmp_path, [small], "npz")
    assert_not_certified(
        squeal.read_system(tmp_path / "chain" / "system.yaml"), "reduced to its modes", 1.0
    )


def test_digits_of_a_file_go_into_an_assembly(tmp_path):
    assert_open_by_digits(squeal.read_system(six_digits(tmp_path)))
    assert_open_by_digits(squeal.read_system(joined(tmp_path)))
    turning = ", rotation: {axis: [0, 0, 1], speed: 0.0}"
    assert_open_by_digits(squeal.read_system(joined(tmp_path, turning)))
    system = squeal.read_system(six_digits(tmp_path)).system
    assert_open_by_digits(with_one(system))


@pytest.mark.parametrize("suffix", FORMATS)
def test_digits_of_a_file_are_exported(tmp_path, suffix):
    system = squeal.read_system(six_digits(tmp_path)).system
    write_system(tmp_path / "out", system, suffix)
    assert_open_by_digits(squeal.read_system(tmp_path / "out" / "system.yaml"))
    assembly = with_one(system)
    write_system(tmp_path / "joined", assembly.system, suffix)
    assert_open_by_digits(squeal.read_system(tmp_path / "joined" / "system.yaml"))


def test_a_user_may_say_how_many_digits_are_known(tmp_path):
    (tmp_path / "s.yaml").write_text(
        "M: [[1, 0], [0, 1]]\nK:\n  - {matrix: [[2.00001, 1.0], [-1.0, 3.99999]], digits: 6}\n"
    )
    assert_open_by_digits(squeal.read_system(tmp_path / "s.yaml"))


def test_errors_that_digits_do_not_tell_are_exported(tmp_path):
    rng = np.random.default_rng(4)
    system = replace(
        shaft(),
        K=(Term(rng.normal(size=(8, 8)), digits=6, errors=csc_array(rng.random((8, 8)))),),
        C=(Term(np.eye(8), rounding=1e-9),),
    )
    write_system(tmp_path, system, "npz")
    read = squeal.read_system(tmp_path / "system.yaml").system
    assert read.K[0].digits == 6
    assert np.array_equal(read.K[0].data_errors.toarray(), system.K[0].data_errors.toarray())
    assert read.C[0].rounding == 1e-9
    names = {path.name for path in squeal.read_system(tmp_path / "system.yaml").inputs}
    assert "K0_errors.npz" in names


def test_errors_of_other_rows_are_refused(tmp_path):
    write_system(tmp_path, squeal.System(np.eye(3), K=np.eye(3)), "npz")
    (tmp_path / "s.yaml").write_text(
        "M: [[1.0]]\nK:\n  - {matrix: [[4.0]], digits: 6, errors: K0.npz}\n"
    )
    with pytest.raises(squeal.InputError, match=r"K\.errors: K0.npz is not allowed"):
        squeal.read_system(tmp_path / "s.yaml")


def rounded(rng, n, digits):
    """A symmetric matrix (n, n) of so many digits, as a term."""
    X = rng.normal(size=(n, n)) + n * np.eye(n)
    words = [[f"{x:.{digits - 1}e}" for x in row] for row in (X + X.T) / 2]
    return Term(np.array(words, dtype=float), digits=digits)


def perturbed(rng, term):
    """The term with each entry anywhere within half a unit of its last digit."""
    shift = rng.uniform(-1, 1, size=term.matrix.shape) * term.data_errors.toarray()
    return replace(term, matrix=term.matrix + (shift + shift.T) / 2, digits=None)


def rayleigh(system):
    return damped(system, rayleigh=(0.3, 2e-3))[0]


def structural(system):
    return damped(system, structural=0.02)[0]


def turning(system):
    component = squeal.Component(system, ["1", "1", "2", "2"], [0, 1, 0, 1])
    return component.rotating((0, 0, 1), "speed", {"speed": 3.0}).system


def in_assembly(system):
    return with_one(replace(system, name="body")).system


def held_at_the_last_row(system):
    wall = Term(np.diag([0.0, 0.0, 0.0, 1e22]))
    return without_supports(replace(system, K=(*system.K, wall)))[0]


@pytest.mark.parametrize(
    "change", [rayleigh, structural, turning, in_assembly, held_at_the_last_row]
)
def test_entries_of_a_system_that_is_made_from_another_lie_within_their_errors(change):
    """Of matrices anywhere within half a unit of their digits the new ones lie within theirs."""
    rng = np.random.default_rng(7)
    system = TermSystem((rounded(rng, 4, 5),), (), (rounded(rng, 4, 5), rounded(rng, 4, 7)))
    made = change(system)
    assert made.digits == 5
    for _ in range(20):
        M, K = (tuple(perturbed(rng, term) for term in part) for part in (system.M, system.K))
        other = change(replace(system, M=M, K=K))
        for term, exact in zip(made.terms, other.terms, strict=True):
            difference = np.abs(exact.matrix - term.matrix)
            errors = 0.0 if term.data_errors is None else term.data_errors.toarray()
            assert np.all(difference <= errors + 1e-13 * np.abs(term.matrix).max())


def test_a_term_that_is_summed_has_the_errors_of_all():
    rng = np.random.default_rng(3)
    parts = [(2.0, rounded(rng, 3, 6)), (-0.5, rounded(rng, 3, 4)), (1.0, Term(np.eye(3)))]
    total = sum_of_terms(sum(w * term.matrix for w, term in parts), Formula("1"), parts)
    assert total.digits == 4
    expected = 2.0 * parts[0][1].data_errors + 0.5 * parts[1][1].data_errors
    assert np.allclose(total.data_errors.toarray(), expected.toarray())


def test_a_reduced_system_keeps_digits_and_earlier_assumptions():
    rng = np.random.default_rng(5)
    n = 6
    K = Term(np.diag((2 * np.pi * np.arange(1, n + 1)) ** 2).round(4), digits=6)
    system = TermSystem((Term(np.eye(n)),), (), (K,), assumptions=("the bolts are left out",))
    reduced = squeal.reduce(system, band=(0.5, 2.5))
    assert reduced.digits == 6
    assert "the bolts are left out" in reduced.assumptions
    # of any K within its digits the projection onto the same basis lies within the errors
    basis = np.linalg.qr(rng.normal(size=(n, 2)))[0]
    assert np.all(reduced.K[0].data_errors.toarray() > 0.0)
    term = K.mapped(lambda X: basis.T @ X @ basis, lambda X: abs(basis).T @ X @ abs(basis))
    shift = rng.uniform(-1, 1, (n, n)) * K.data_errors.toarray()
    assert np.all(np.abs(basis.T @ shift @ basis) <= term.data_errors.toarray())


@pytest.mark.parametrize("errors", [[[np.inf]], [[np.nan]], [[-1e-6]]])
def test_errors_that_no_file_holds_are_refused(errors):
    with pytest.raises(squeal.InputError, match="errors: must be finite numbers of at least 0"):
        Term(np.eye(1), digits=6, errors=np.array(errors))


def test_errors_without_digits_are_refused():
    """Nothing looked at them: two rows were certified whose sign they left open."""
    with pytest.raises(squeal.InputError, match="with the digits of the data"):
        Term(np.array([[1e-9]]), errors=np.array([[1.0]]))


def test_damping_of_a_pad_of_unknown_errors_is_exported_and_not_certified(tmp_path):
    """Two modes of one frequency have two ratios, so that C is any mixture of both."""
    parameters = "m: 1, w: 0.5, h: 1.0e-200, I: 1, k1: 2097152, k2: 2097152, k_c: 4194304"
    (tmp_path / "pad.yaml").write_text(
        f"model: B3\nparameters: {{{parameters}, alpha1: 0.0, alpha2: 0.0, mu: 0.0}}\n"
        "damping: {ratios: [0.01, 0.02, 0.03]}\n"
    )
    assert main(["export", str(tmp_path / "pad.yaml"), "--output", str(tmp_path / "out")]) == 0
    read = squeal.read_system(tmp_path / "out" / "system.yaml")
    assert_not_certified(read, "the errors of an entry are not known", 1.0)


def test_rounding_of_a_large_sparse_matrix_is_carried_without_a_full_one():
    n = 3000
    terms = (Term(eye_array(n), rounding=1e-12),)
    nodes = [str(k // 3) for k in range(n)]
    body = squeal.Component(TermSystem(terms, (), terms), nodes, [k % 3 for k in range(n)])
    tracemalloc.start()
    turned = body.rotating((0, 0, 1), 1.0, {})
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < n * n
    # two unit entries of a row and a column of J meet the rounding of all of M
    assert turned.system.C[-1].rounding >= 2e-12


def onto(V):
    return lambda X: V.T @ (X @ V)


def beside(J):
    return lambda X: X @ J + J @ X


@pytest.mark.parametrize("kind", [onto, beside])
@pytest.mark.parametrize("n", [2, 5, 9])
def test_rounding_that_is_mapped_bounds_that_of_every_entry(kind, n):
    rng = np.random.default_rng(n)
    J = rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.5)
    mapped = Term(rng.normal(size=(n, n)), rounding=1e-3).mapped(kind(J), kind(abs(J)))
    for _ in range(50):
        shift = 1e-3 * rng.choice([-1.0, 1.0], (n, n))
        assert np.abs(kind(J)(shift)).max() <= mapped.rounding * (1.0 + 1e-12)


def test_ratios_of_modes_that_digits_do_not_tell_apart_are_not_certified(tmp_path):
    """Frequencies differ by 1e-5 of themselves, of three digits: the damping of each is open."""
    K = "[[123.0, 0.01], [0.01, 123.0]]"
    (tmp_path / "s.yaml").write_text(
        f"M: [[1, 0], [0, 1]]\nK: [{{matrix: {K}, digits: 3}}]\ndamping: {{ratios: [0.01, 0.1]}}\n"
    )
    assert_not_certified(squeal.read_system(tmp_path / "s.yaml"), "3 digits do not determine", 1.0)


def gripped(stiffness, digits):
    """A block whose load of 12344 N reaches the other across a gap of almost its deflection."""
    K = Term(np.diag([2000.0, stiffness]), digits=digits)
    system = TermSystem((Term(np.eye(2)),), (Term(0.2 * np.eye(2)),), (K,), name="block")
    block = squeal.Component(system, ["a", "a"], [0, 2], load=[0.0, -12344.0])
    base = squeal.System([[1.0]], C=[[0.5]], K=[[1e6]], name="base")
    contact = squeal.Contact(
        ("base", "block"), [("1", "a")], (0, 0, 1), 20.0,
        sliding=(1, 0, 0), friction=0.3, gap=0.9998, slope=-40.0,
    )  # fmt: skip
    return squeal.assemble([squeal.Component(base, ["1"], [2]), block], [contact])


def test_contact_that_is_seated_on_few_digits_is_not_certified():
    """Its force is a small difference: within half a unit of 12340 N/m it is a quarter, and falling
    friction makes the block flutter no more."""
    assert squeal.eigenvalues(gripped(12344.9, None)).verdict == "stable"
    found = squeal.eigenvalues(gripped(12340.0, 4))
    assert (found.verdict, found.certified) == ("flutter", False)
    assert "seated on components that are known to 4 digits" in found.proof["reason"]


def bonded_chain(K, digits, reduced):
    """A chain with stiffness K on a bond to a body of its own, kept with all of its modes."""
    n = len(K)
    friction = np.zeros((n, n))
    friction[0, 1] = 3000.0
    friction[1, 0] = -3000.0
    K_terms = (Term(K, digits=digits), Term(friction, Formula("mu")))
    system = TermSystem((Term(np.eye(n)),), (Term(0.5 * np.eye(n)),), K_terms, name="chain")
    body = squeal.Component(system, [str(i) for i in range(n)], [0] * n)
    if reduced:
        body = body.reduced(["0"], cutoff=1e3)
    contact = squeal.Contact(("chain", "one"), [("0", "a")], (1, 0, 0), 1e-9, bonded=True)
    return squeal.assemble([body, one()], [contact], {"mu": 0.1})


def test_what_reduced_components_of_few_digits_leave_open_holds_both_errors():
    """Nothing is truncated, so that the error was 1e-9 1/s and that of the digits was forgotten."""
    K = np.array([[2468.1, -1234.6, 0.0], [-1234.6, 3469.1, -1234.6], [0.0, -1234.6, 4472.3]])
    rounded_K = np.array([[float(f"{x:.2e}") for x in row] for row in K])
    exact = bonded_chain(K, None, reduced=False)
    known = bonded_chain(rounded_K, 3, reduced=True)
    true_roots = squeal.eigenvalues(exact).values
    found = squeal.eigenvalues(known)
    for root in found.eigenvalues:
        if abs(root.value) < 99.0:  # the body beside it has 100 rad/s
            assert 1e-4 < np.min(np.abs(true_roots - root.value)) <= root.error
    assert "the reduction and the digits of the matrices" in str(found)
    (threshold,) = squeal.thresholds(exact, 2.0).crossings
    located = squeal.thresholds(known, 2.0)
    (crossing,) = located.crossings
    low, high = crossing.interval
    assert low < threshold.mu < high < low + 0.2
    assert "the reduction and the digits of the matrices leave open, to first order" in str(located)


@pytest.mark.parametrize(
    ("digits", "reduced", "causes"),
    [
        (None, True, "the reduction"),
        (3, False, "the digits of the matrices"),
        (3, True, "the reduction and the digits of the matrices"),
    ],
)
def test_a_threshold_that_may_move_by_an_unknown_distance_says_why(
    monkeypatch, digits, reduced, causes
):
    monkeypatch.setattr(sensitivity, "_shift", lambda *_: np.inf)
    K = np.array([[2470.0, -1230.0, 0.0], [-1230.0, 3470.0, -1230.0], [0.0, -1230.0, 4470.0]])
    chain = bonded_chain(K, digits, reduced)
    file = SystemAnalysis.of(chain).file
    counted = replace(squeal.thresholds(chain, 2.0, prove=False), certified=True)
    answer = sensitivity.widened(file, file.system, counted)
    assert not answer.certified
    assert answer.details["doubts"][0] == f"how far {causes} may move a threshold is not known"


def test_errors_of_a_file_are_no_less_than_its_own_digits(tmp_path):
    six_digits(tmp_path)
    write_matrix(tmp_path / "none.mtx", csc_array((2, 2)))
    write_matrix(tmp_path / "more.mtx", csc_array(np.full((2, 2), 1e-3)))
    for errors, most in (("none", 5e-6), ("more", 1e-3)):
        keys = f"{{file: k.mtx, digits: 12, errors: {errors}.mtx}}"
        (tmp_path / "s.yaml").write_text(f"M: [[1, 0], [0, 1]]\nK: [{keys}]\n")
        system = squeal.read_system(tmp_path / "s.yaml").system
        assert system.K[0].data_errors.toarray() == pytest.approx(np.full((2, 2), most))
        assert_open_by_digits(system)


@pytest.mark.parametrize("suffix", ["memory", "npy", "npz"])
def test_floats_of_single_precision_leave_a_verdict_open(tmp_path, suffix):
    # it grows where k22 - k11 < 2; half an ulp of each is 2^-23 in single precision
    K = np.array([[2.0, 1.0], [-1.0, 4.0 - 2.0**-22]], dtype=np.float32)
    assert K[1, 1] == 4.0 - 2.0**-22
    subject: squeal.System | squeal.SystemFile
    if suffix == "memory":
        subject = squeal.System(np.eye(2, dtype=np.float32), K=K)
    else:
        if suffix == "npy":
            np.save(tmp_path / "K.npy", K)
        else:
            np.savez(tmp_path / "K.npz", K=K)
        (tmp_path / "s.yaml").write_text(f"M: [[1, 0], [0, 1]]\nK: {{file: K.{suffix}}}\n")
        subject = squeal.read_system(tmp_path / "s.yaml")
    found = squeal.eigenvalues(subject)
    assert (found.verdict, found.certified, found.proof["data"]) == (None, False, "7 digits")
    doubles = squeal.System(np.eye(2), K=K.astype(float))
    assert squeal.eigenvalues(doubles).verdict == "flutter"


def test_whole_numbers_of_single_precision_are_exact():
    K = np.array([[2.0, -1.0], [-1.0, 2.0]], dtype=np.float32)
    system = squeal.System(np.eye(2, dtype=np.float32), K=K)
    assert system.digits is None
    found = squeal.eigenvalues(system)
    assert (found.verdict, found.certified) == ("marginal", True)


def friction_of_six_digits(folder, keys="", digits="3.33333"):
    (folder / "k1.mtx").write_text(
        HEAD + f"2 2\n0.00000e+00\n-{digits}e+00\n{digits}e+00\n0.00000e+00\n"
    )
    (folder / "s.yaml").write_text(
        "M: [[1, 0], [0, 1]]\nK: [{matrix: [[2, 0], [0, 4]]}, {file: k1.mtx, factor: mu}]\n" + keys
    )
    return squeal.read_system(folder / "s.yaml")


@pytest.mark.parametrize("digits", ["3.33333", "6.52968", "7.59953", "8.97907", "3.74784"])
def test_a_threshold_is_proved_in_an_interval_that_holds_those_of_all_data(tmp_path, digits):
    """Coalescence at mu f = 1, where f is known to half a unit of its last digit.

    At the middle of the interval two roots may coincide to all digits.
    """
    located = squeal.thresholds(friction_of_six_digits(tmp_path, digits=digits), 1.0)
    assert (located.certified, located.proof["data"]) == (True, "6 digits")
    (crossing,) = located.crossings
    low, high = crossing.interval
    first = 1 / (float(digits) + 5e-6)
    last = 1 / (float(digits) - 5e-6)
    assert low < first < last < high
    assert high - low < 20 * (last - first)
    assert "the 6 digits of k1.mtx" in str(located)


def test_thresholds_that_are_counted_have_intervals_that_hold_those_of_all_data(tmp_path):
    """The same with damping, against systems whose friction lies within the digits."""
    system = friction_of_six_digits(tmp_path, "C: [[0.1, 0], [0, 0.1]]\n").system
    rng = np.random.default_rng(1)
    located = squeal.thresholds(system, 1.0, prove=False)
    (crossing,) = located.crossings
    low, high = crossing.interval
    assert high - low < 1e-4
    for _ in range(5):
        f = 3.33333 + 5e-6 * rng.uniform(-1, 1)
        K1 = [[0.0, f], [-f, 0.0]]
        other = squeal.System(np.eye(2), C=0.1 * np.eye(2), K={"1": np.diag([2.0, 4.0]), "mu": K1})
        (exact,) = squeal.thresholds(other, 1.0, prove=False).crossings
        assert low <= exact.mu <= high


def test_where_the_start_is_open_no_threshold_is_certified(tmp_path):
    """A mode grows at every value as written, by 1.3e-3 1/s, and no line would name it."""
    located = squeal.thresholds(squeal.read_system(six_digits(tmp_path)), 1.0)
    assert (located.verdict, located.certified) == (None, False)
    assert "the verdict at mu = 0 is open" in located.proof["reason"]
    assert "proved" not in str(located)


def test_digits_of_a_changed_matrix_go_into_the_system(tmp_path):
    (tmp_path / "k.mtx").write_text(SIX_DIGITS)
    system = squeal.System(np.eye(2), K=np.diag([2.0, 4.0]))
    changed = with_matrices(squeal.SystemFile(system), {"d": {"K": tmp_path / "k.mtx"}})
    assert changed.K[-1].digits == 6


def test_thresholds_of_few_digits_move_with_the_frequency_that_matrices_follow():
    """The determinant at a mode of i w is zero: its zeros in mu and w with all signs of half a unit
    in the last digit."""
    C = np.diag([0.115, 0.224])
    friction = np.array([[0.0, 4.0 / 3.0], [0.0, 0.0]])
    follows = np.array([[-0.52, -1.42], [-0.92, -0.57]])
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    system = squeal.System(np.eye(2), C, {"1": K, "mu": friction, "omega": follows})
    constant, *others = system.K
    system = replace(system, K=(replace(constant, digits=4), *others))
    (point,) = squeal.thresholds(system, 3.0, band=(0.05, 1.0)).points
    low, high = point.interval
    for signs in itertools.product((-1.0, 1.0), repeat=4):
        changed = K + 0.0005 * np.reshape(signs, (2, 2))

        def determinant(unknowns, K=changed):
            mu, w = unknowns
            P = -(w**2) * np.eye(2) + 1j * w * C + K + mu * friction + w * follows
            value = P[0, 0] * P[1, 1] - P[0, 1] * P[1, 0]
            return value.real, value.imag

        mu, _ = fsolve(determinant, (point.mu, 2 * np.pi * point.frequency_hz))
        assert low <= mu <= high
    assert high - low < 3e-3  # 1.13e-3 of all signs
