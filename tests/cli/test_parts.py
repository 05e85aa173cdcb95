"""Jobs in parts: the same table in any number of parts, which is that of the whole query."""

import csv
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.io import mmwrite
from scipy.sparse import coo_array

import squeal
from squeal.analysis.eigenvalues import analyse
from squeal.analysis.maps import BLOCK, NAMES, RandomPads, Range
from squeal.cli.main import main as query
from squeal.cli.parts import main, read_job
from squeal.errors import ComputationError, InputError
from squeal.io.document import with_named_files
from squeal.io.parts import cut
from tests.conftest import ROOT, SCENES

B1, B2, B3 = (str(SCENES / f"{stem}.yaml") for stem in ("b1-c", "b2-c", "b3"))
PLAIN = str(ROOT / "squeal" / "article" / "literature" / "systems" / "mode_coupling.yaml")
ANGLES = {name: {"low": 0, "high": "pi"} for name in ("alpha1", "alpha2")}
PADS = {
    "pads": {
        "scene": B3,
        "count": 25_000,
        "bins": 4,
        "ranges": {"mu": {"low": 0, "high": 1}} | ANGLES,
    }
}


@pytest.fixture
def in_parts(tmp_path):
    """The bytes of a job's table, computed in some parts."""

    def compute(job, parts, *options):
        file, out = tmp_path / "job.yaml", tmp_path / "whole.csv"
        file.write_text(yaml.safe_dump(job, sort_keys=False))
        names = [str(tmp_path / f"{i}.csv") for i in range(parts)]
        for i, name in enumerate(names, 1):
            assert main([str(file), "--part", f"{i}-of-{parts}", "--out", name, *options]) == 0
        assert main([str(file), "--gather", *names, "--out", str(out)]) == 0
        return out.read_bytes()

    return compute


@pytest.mark.parametrize(("scene", "cuts"), [(B2, [3]), (B3, [1, 3, 10])])
def test_a_map_in_parts_is_that_of_the_query(in_parts, tmp_path, capsys, scene, cuts):
    axes = {name: ends | {"n": 10} for name, ends in ANGLES.items()}
    found = {in_parts({"map": {"scene": scene, "axes": axes}}, parts) for parts in cuts}
    assert query(["map", scene, "--n", "10", "--csv", str(tmp_path / "query.csv")]) == 0
    assert found == {(tmp_path / "query.csv").read_bytes()}


def test_a_sweep_in_parts_is_that_of_the_query(in_parts, tmp_path, capsys):
    job = {"sweep": {"scene": B1, "values": "0:0.9:13"}}
    found = {in_parts(job, parts) for parts in (1, 4)}
    assert query(["eigenvalues", B1, "--mu", "0:0.9:13", "--csv", str(tmp_path / "query.csv")]) == 0
    assert found == {(tmp_path / "query.csv").read_bytes()}


@pytest.fixture
def chain(tmp_path):
    """A system file of masses between springs and a sliding force, with matrix files: its name."""
    n = 40
    M, K = np.eye(n), 2e6 * np.eye(n) - 1e6 * (np.eye(n, k=1) + np.eye(n, k=-1))
    K1 = np.zeros((n, n))
    K1[n // 2, n // 2 + 1] = 3e6
    K1[n // 2 + 1, n // 2] = -3e6
    for name, matrix in {"M": M, "K0": K, "K1": K1}.items():
        mmwrite(tmp_path / f"{name}.mtx", coo_array(matrix))
    file = tmp_path / "chain.yaml"
    file.write_text(
        "parameters: {mu: 0.1}\nM: {file: M.mtx}\n"
        "K: [{file: K0.mtx}, {file: K1.mtx, factor: mu}]\ndamping: {rayleigh: [1.0, 1.0e-6]}\n"
    )
    return str(file)


@pytest.mark.parametrize("large", [False, True])
def test_a_sweep_of_a_large_system_in_parts_is_that_of_the_query(
    in_parts, tmp_path, capsys, monkeypatch, chain, large
):
    if large:  # as if it were: each value by shift and invert, counted by the argument principle
        monkeypatch.setattr("squeal.analysis.systems.wanted.ALL_ROWS", 10)
    job = {"sweep": {"scene": chain, "values": "0:0.9:4", "band": "150:300"}}
    found = {in_parts(job, parts) for parts in (1, 3)}
    table = tmp_path / "query.csv"
    options = ["--sweep", "0:0.9:4", "--band", "150:300", "--method", "full", "--csv", str(table)]
    assert query(["eigenvalues", chain, *options]) == 0
    assert found == {table.read_bytes()}
    assert table.read_text().count("flutter") > 0


def test_the_matrix_files_of_a_system_are_inputs_of_its_parts(chain, tmp_path):
    names = [f"{tmp_path}/{name}" for name in ("chain.yaml", "M.mtx", "K0.mtx", "K1.mtx")]
    assert with_named_files(Path(chain)) == names
    assert with_named_files(Path(B1)) == [B1]


def test_a_band_is_for_systems_alone(tmp_path, capsys):
    file = tmp_path / "job.yaml"
    sweep = {"scene": B1, "values": "0:0.9:7", "band": "150:300"}
    file.write_text(yaml.safe_dump({"sweep": sweep}))
    assert main([str(file), "--part", "1-of-1", "--out", str(tmp_path / "out.csv")]) == 2
    assert "left out with a scene" in capsys.readouterr().err
    file.write_text(yaml.safe_dump({"sweep": sweep | {"scene": PLAIN, "band": "9:3"}}))
    assert main([str(file), "--part", "1-of-1", "--out", str(tmp_path / "out.csv")]) == 2
    assert "job.yaml: band 9:3" in capsys.readouterr().err


def test_a_map_has_two_axes(tmp_path, capsys):
    file = tmp_path / "job.yaml"
    axes = {"alpha1": {"low": 0, "high": 1, "n": 3}}
    file.write_text(yaml.safe_dump({"map": {"scene": B3, "axes": axes}}))
    assert main([str(file), "--part", "1-of-1", "--out", str(tmp_path / "out.csv")]) == 2
    assert "axes: 'alpha1' is not allowed; it must be two parameters" in capsys.readouterr().err


def test_random_pads_in_parts_are_the_same_pads(in_parts):
    tables = {in_parts(PADS, parts) for parts in (1, 2, 3)}
    assert len(tables) == 1
    head, *rows = csv.reader(tables.pop().decode().splitlines())
    assert head == ["mu from", "mu to", "pads", *NAMES]
    assert [float(row[1]) for row in rows] == [0.25, 0.5, 0.75, 1.0]
    counts = np.array([row[2:] for row in rows], dtype=int)
    assert counts[:, 0].sum() == 25_000
    assert np.array_equal(counts[:, 0], counts[:, 1:].sum(axis=1))
    assert (np.diff(counts[:, 1 + NAMES.index("flutter")]) > 0).all()  # friction makes it likelier


@pytest.mark.parametrize("file", [B1, B2, B3])
def test_random_pads_have_the_verdicts_of_pads_on_their_own(file):
    scene = squeal.read_scene(file)
    ranges = (Range("mu", 0.0, 1.0), Range("alpha1", 0.3, 2.8), Range("h", 0.005, 0.05, True))
    pads = RandomPads(scene, ranges, 18, bins=3)
    bins, values = pads.draw(0)
    expected = np.zeros((3, len(NAMES)), dtype=int)
    for i, row in zip(bins, values.T.tolist(), strict=True):
        assert pads.edges[i] <= row[0] < pads.edges[i + 1]
        changed = scene.replace(**dict(zip(pads.names, row, strict=True)))
        try:
            found = analyse(changed)
            name = found.judgement.verdict if found.on_branch else "beyond a fold"
        except ComputationError:  # nor is there an equilibrium elsewhere
            name = "beyond a fold"
        expected[i, NAMES.index(name)] += 1
    assert np.array_equal(pads.counts(0, 1), expected)


def test_without_friction_none_flutters():
    """K is symmetric then (Eq. 22): its eigenvalues are real."""
    ranges = (Range("mu", 0.0, 1e-12), Range("alpha1", 0.0, np.pi), Range("alpha2", 0.0, np.pi))
    counts = RandomPads(squeal.read_scene(B3), ranges, 2 * BLOCK, bins=1).counts(0, 2)
    assert counts[0, NAMES.index("flutter")] == 0
    assert counts.sum() == 2 * BLOCK


def test_ranges_are_spread_evenly_or_by_their_logarithms():
    shares = np.array([0.0, 0.5, 1.0])
    assert np.allclose(Range("h", 0.01, 0.04).values(shares), [0.01, 0.025, 0.04])
    assert np.allclose(Range("h", 0.01, 0.04, True).values(shares), [0.01, 0.02, 0.04])


def test_parts_cover_a_job_once():
    for size, parts in ((10, 3), (7, 7), (100, 8)):
        ends = [cut(f"{i}-of-{parts}", size) for i in range(1, parts + 1)]
        assert [n for start, stop in ends for n in range(start, stop)] == list(range(size))


@pytest.mark.parametrize("part", ["0-of-3", "4-of-3", "3-of-2", "1-of-99", "a-of-b", "1-of-0"])
def test_a_part_that_is_none_is_refused(part):
    with pytest.raises(InputError, match="one of at most 5 parts"):
        cut(part, 5)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"count": 0}, "count: 0 is not allowed"),
        ({"ranges": {"k3": {"low": 1, "high": 2}}}, "'k3' is not allowed; it must be a parameter"),
        ({"ranges": {"mu": {"low": 1, "high": 0}}}, "a range with low < high"),
        ({"ranges": {"mu": {"low": 0, "high": 1, "spread": "logarithms"}}}, "a range above 0"),
        ({"ranges": {"mu": {"low": 0, "high": 1, "spread": "oddly"}}}, "one of values, logarithms"),
        ({"size": 3}, "unknown key"),
    ],
)
def test_a_wrong_job_is_refused_in_one_sentence(tmp_path, capsys, change, words):
    file = tmp_path / "job.yaml"
    file.write_text(yaml.safe_dump({"pads": PADS["pads"] | change}))
    assert main([str(file), "--part", "1-of-1", "--out", str(tmp_path / "out.csv")]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out.csv").exists()


def test_parts_of_different_jobs_are_not_gathered(tmp_path, capsys):
    file = tmp_path / "job.yaml"
    file.write_text(yaml.safe_dump(PADS))
    for name, head in (("a", "x,y"), ("b", "x,z")):
        (tmp_path / name).write_text(f"{head}\n1,2\n")
    parts = [str(tmp_path / "a"), str(tmp_path / "b")]
    assert main([str(file), "--gather", *parts, "--out", str(tmp_path / "c")]) == 2
    assert "a: is no whole part" in capsys.readouterr().err


@pytest.mark.parametrize("damage", ["missing", "twice", "cut", "another job"])
def test_parts_that_are_not_those_of_the_job_are_refused(tmp_path, capsys, damage):
    """Fault A.11: a missing part, a part twice, and one cut in a row were gathered."""
    file, out = tmp_path / "job.yaml", tmp_path / "out.csv"
    file.write_text(yaml.safe_dump(PADS))
    parts = [tmp_path / f"{i}.csv" for i in (1, 2, 3)]
    for i, part in enumerate(parts, 1):
        assert main([str(file), "--part", f"{i}-of-3", "--out", str(part)]) == 0
    if damage == "missing":
        parts.pop()
    elif damage == "twice":
        parts[2] = parts[1]
    elif damage == "cut":
        parts[0].write_text(parts[0].read_text()[:-60])
    else:
        file.write_text(yaml.safe_dump({"pads": PADS["pads"] | {"seed": 2}}))
    assert main([str(file), "--gather", *map(str, parts), "--out", str(out)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not out.exists()


def test_jobs_of_the_workflow_can_be_read(monkeypatch):
    monkeypatch.chdir(ROOT)
    for file in sorted(Path("workflow/jobs").glob("*.yaml")):
        assert read_job(file).size >= 8
