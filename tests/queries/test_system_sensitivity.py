"""What moves roots and thresholds of systems: closed forms, and differences in more digits."""

import mpmath
import numpy as np
import pytest
from scipy.sparse import csc_array

import squeal
from squeal.errors import ComputationError, InputError
from squeal.io.matrices import write_matrix
from tests.known import system_of
from tests.large import disc_and_pad

TAU = 2 * np.pi
TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])


def pair(gap, c, w):
    """Flutter from mu^2 = c^2 (w + gap / 2) + gap^2 / 4 on, at omega^2 = w + gap / 2."""
    first = np.diag([1.0, 0.0])
    eye = np.eye(2)
    values = {"gap": gap, "c": c, "w": w}
    C = ((eye, "c"),) if c else ()
    return system_of(eye, C, ((eye, "w"), (first, "gap"), (TURN, "mu")), values)


@pytest.mark.parametrize("c", [0.0, 0.2])
@pytest.mark.parametrize("rows", [400, 1])
def test_thresholds_move_as_their_closed_form(monkeypatch, rows, c):
    for module in ("systems.all_roots", "systems.matrices"):
        monkeypatch.setattr(f"squeal.queries.{module}.ALL_ROWS", rows)
    gap = 3.0
    w = 20.0
    mu = np.hypot(c * np.sqrt(w + gap / 2), gap / 2)
    omega = np.sqrt(w + gap / 2)
    stiffer = {"stiffer": {"K": csc_array(np.eye(2))}}
    found = squeal.sensitivity(pair(gap, c, w), "threshold", band=(0.1, 2.0), matrices=stiffer)
    assert found.at == pytest.approx(mu, rel=1e-9)
    by_w = [c * c / (2 * mu), 1 / (2 * omega * TAU)]
    exact = {
        "gap": [(c * c / 2 + gap / 2) / (2 * mu), 1 / (4 * omega * TAU)],
        "w": by_w,
        "stiffer": by_w,
        "c": [c * omega**2 / mu, 0.0],
    }
    for name, slopes in exact.items():
        # a pair that coalesces in a subspace is known to the square root of rounding
        near = 1e-6 if c == 0.0 and rows == 1 else 1e-8
        assert found.slopes[name] == pytest.approx(slopes, abs=near), name


def test_a_divergence_and_what_has_no_derivative():
    """A stiffness k - mu is lost at mu = k beside another one; two pairs flutter at once."""
    eye = np.eye(2)
    first = np.diag([1.0, 0.0])
    for C in (None, eye):
        column = system_of(eye, C, (9 * eye - 9 * first, (first, "k"), (-first, "mu")), {"k": 1.5})
        found = squeal.sensitivity(column, "threshold")
        assert found.kind == "divergence"
        assert found.slopes["k"] == pytest.approx([1.0, 0.0], abs=1e-12)
    basis = np.linalg.qr(np.arange(9.0).reshape(3, 3) ** 2 - 4.0)[0]
    for turned in (np.eye(3), basis):  # two motions are lost at once, each by its own stiffness
        own, other, stiff = (np.outer(shape, shape) for shape in turned.T)
        K = (3 * stiff, (own, "k"), (other, "l"), (-0.7 * (own + other), "mu"))
        for C in (None, np.eye(3)):
            pair = system_of(np.eye(3), C, K, {"k": 1.0, "l": 1.0})
            with pytest.raises(ComputationError, match="several modes cross"):
                squeal.sensitivity(pair, "threshold")
    both = system_of(np.eye(2), None, (np.eye(2), (-np.eye(2), "mu")), {})  # nothing holds at 1
    with pytest.raises(ComputationError, match="several modes cross"):
        squeal.sensitivity(both, "threshold")
    twice = np.kron(np.eye(2), TURN)
    system = system_of(np.eye(4), (), (np.diag([2.0, 1.0, 2.0, 1.0]), (twice, "mu")), {"k": 0.0})
    with pytest.raises(ComputationError, match="several modes cross"):
        squeal.sensitivity(system, "threshold")


def test_slopes_of_complex_systems_are_differences_of_more_digits(tmp_path):
    """Of a system with a structural loss factor, by matrices in files and in memory."""
    n = 4
    step = mpmath.mpf("1e-12")
    rng = np.random.default_rng(2)
    root = rng.normal(size=(n, n))
    own = np.eye(n), 0.1 * root @ root.T, (1 + 0.05j) * (root @ root.T + 5 * np.eye(n))
    changes = rng.normal(size=(3, n, n))
    given: dict = dict(zip("MCK", changes, strict=True))
    write_matrix(tmp_path / "K.mtx", given["K"])
    given["K"] = str(tmp_path / "K.mtx")
    found = squeal.sensitivity(system_of(*own), matrices={"q": given})

    def roots(e):
        pairs = zip(own, changes, strict=True)
        M, C, K = (mpmath.matrix(A) + e * mpmath.matrix(dA) for A, dA in pairs)
        below = mpmath.inverse(M)
        state = mpmath.zeros(2 * n)
        state[:n, n:] = mpmath.eye(n)
        state[n:, :n] = -below * K
        state[n:, n:] = -below * C
        return mpmath.eig(state, left=False, right=False)

    with mpmath.workdps(40):
        up = roots(step)
        down = roots(-step)
        for value, slope in zip(found.at, found.slopes["q"], strict=True):
            a = up[int(np.argmin([abs(z - value) for z in up]))]
            b = down[int(np.argmin([abs(z - value) for z in down]))]
            assert complex((a - b) / (2 * step)) == pytest.approx(slope, rel=1e-8)


def test_slopes_in_a_band_of_a_sparse_system_are_those_of_differences():
    system = disc_and_pad(3)
    band = (1000.0, 3500.0)
    h = 1e-5
    assert system.n > 400
    found = squeal.sensitivity(system.replace({"mu": 0.3}), band=band)
    up = squeal.eigenvalues(system, 0.3 + h, band=band).values
    down = squeal.eigenvalues(system, 0.3 - h, band=band).values
    assert len(up) == len(found.at) > 3
    error = (up - down) / (2 * h) - found.slopes["mu"]
    assert np.abs(error).max() < 1e-4 * np.abs(found.slopes["mu"]).max()
    assert (found.condition >= 0.99).all()


@pytest.mark.parametrize("text", ["1 1 0.5\n2 2 0.25\n", "*MATRIX INPUT\n2 2 0.25\n1 1 0.5\n"])
def test_a_change_whose_file_does_not_tell_its_size_is_padded_as_a_term_is(tmp_path, text):
    path = tmp_path / "D.mtx"
    path.write_text(text)
    system = squeal.System(np.eye(3), K=np.diag([1.0, 2.0, 4.0]))
    found = squeal.sensitivity(system, matrices={"d": {"K": str(path)}})
    same = squeal.sensitivity(system, matrices={"d": {"K": np.diag([0.5, 0.25, 0.0])}})
    assert np.abs(same.slopes["d"]).max() > 0.0
    assert found.slopes["d"].tolist() == same.slopes["d"].tolist()
    path.write_text(f"{text}4 4 1\n")
    with pytest.raises(InputError, match=r"shape \(4, 4\) is not allowed; the system has 3 rows"):
        squeal.sensitivity(system, matrices={"d": {"K": str(path)}})


def test_modes_near_a_coalescence_are_named():
    """omega^2 = w + gap / 2 +- sqrt(gap^2 / 4 - mu^2): mass-normalised, 1 / condition is the root
    over gap / 2."""
    for share, words in ((0.5, ""), (0.9999, "nearly coalesces")):
        found = squeal.sensitivity(pair(3.0, 0.0, 20.0).replace({"mu": 1.5 * share}))
        assert found.condition == pytest.approx([1 / np.sqrt(1 - share**2)] * 4, rel=1e-6)
        assert words in str(found)
        assert bool(words) == ("nearly" in str(found))
    met = squeal.sensitivity(squeal.System(np.eye(2), K=[[2, 1], [0, 2]], parameters={"mu": 0.0}))
    assert "mode 1 coalesces with another one: it has no derivatives" in str(met)


def test_a_change_whose_file_names_fewer_rows_stands_where_the_system_has_them(tmp_path):
    texts = {
        "M": "3,1, 3,1, 1\n7,1, 7,1, 1\n",
        "K": "3,1, 3,1, 4\n7,1, 7,1, 9\n3,1, 7,1, 1\n7,1, 3,1, 1\n",
    }
    texts |= {"dK": "7,1, 7,1, 1\n", "far": "8,1, 8,1, 1\n"}
    for name, text in texts.items():
        (tmp_path / f"{name}.mtx").write_text(text)
    (tmp_path / "system.yaml").write_text("M: {file: M.mtx}\nK: {file: K.mtx}\n")
    system = squeal.read_system(tmp_path / "system.yaml")
    given = str(tmp_path / "dK.mtx"), np.diag([0.0, 1.0])
    one, other = (squeal.sensitivity(system, matrices={"q": {"K": dK}}) for dK in given)
    assert np.abs(other.slopes["q"]).min() > 0.0
    assert one.slopes["q"].tolist() == other.slopes["q"].tolist()
    with pytest.raises(InputError, match="node 8"):
        squeal.sensitivity(system, matrices={"q": {"K": str(tmp_path / "far.mtx")}})


def test_a_known_answer_for_another_band_is_refused():
    """Its roots are those that are differentiated, so that a band beside it would mean nothing."""
    system = squeal.System(np.eye(2), K={"k": np.diag([1.0, 100.0])}, parameters={"k": 4.0})
    whole = squeal.eigenvalues(system)
    upper = squeal.eigenvalues(system, band=(1.0, 5.0))
    assert len(squeal.sensitivity(system, known=whole).slopes["k"]) == 4
    selected = squeal.sensitivity(system, known=upper, band=(1.0, 5.0)).slopes["k"]
    assert selected.imag == pytest.approx([10.0 / 4.0])
    with pytest.raises(InputError, match="another band"):
        squeal.sensitivity(system, known=whole, band=(1.0, 5.0))
