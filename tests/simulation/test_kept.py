"""Compiled code read from files is that which was compiled, for the same equations alone."""

import os

import numpy as np
import pytest

from squeal.io.scene import read_scene
from squeal.model.law import ContactLaw
from squeal.model.states import State
from tests.conftest import HEYOKA, SCENES, needs_heyoka

if HEYOKA:
    import heyoka as hy

    from squeal.simulation.batch import step
    from squeal.simulation.integrators import kept as module
    from squeal.simulation.integrators.kept import kept
    from squeal.simulation.integrators.taylor import compiled

pytestmark = needs_heyoka


@pytest.fixture
def folder(tmp_path):
    """Where code is kept, with nothing in it."""
    before = hy.llvm_state.get_diskcache_path()
    enabled = hy.llvm_state.get_diskcache_enabled()
    hy.llvm_state.set_diskcache_path(tmp_path)
    hy.llvm_state.set_diskcache_enabled(True)
    yield tmp_path / module.FOLDER
    hy.llvm_state.set_diskcache_path(before)
    hy.llvm_state.set_diskcache_enabled(enabled)


class Maker:
    """Makes plain words, and counts how often."""

    def __init__(self):
        self.made = 0

    def __call__(self):
        self.made += 1
        return f"machine {self.made}"


def law() -> ContactLaw:
    return read_scene(SCENES / "b2-c.yaml", "simulate").pad_model.law


def test_a_step_and_an_integrator_are_those_that_were_compiled(folder):
    def results():
        random = np.random.default_rng(3)
        function = step.compiled_step(law(), 4, ())
        given = random.normal(size=(function.nvars, step.WIDTH)) * 1e-3
        pars = 1.0 + random.random((function.nparams, step.WIDTH))
        given[step.LEFT], given[step.LONGEST] = 1.0, step.LONG
        integrator = compiled.__wrapped__(law(), State(True, True), 1e-9, float)
        integrator.pars[:] = 1.0 + random.random(len(integrator.pars))
        integrator.state[:] = 1e-3 * random.normal(size=6)
        integrator.propagate_until(1.0)
        return function(given, pars=pars), integrator.state.copy(), integrator.time

    made, read = results(), results()
    assert len(list(folder.iterdir())) == 2
    assert all(np.array_equal(a, b) for a, b in zip(made, read, strict=True))
    assert np.isfinite(made[0]).all()


def test_code_is_that_of_its_expressions_options_and_maker(folder, monkeypatch):
    x, y = hy.make_vars("x", "y")
    make = Maker()
    asked = [([x + y], (1,)), ([x - y], (1,)), ([x + y, y], (1,)), ([x + y], (2,)), ([x + y], ())]
    first = [kept(*one, make) for one in asked]
    assert len(set(first)) == make.made == len(asked)
    assert [kept(*one, make) for one in asked] == first
    assert make.made == len(asked)
    monkeypatch.setattr(module, "_maker", lambda: "another processor")
    assert kept(*asked[0], make) not in first


@pytest.mark.parametrize("damage", [b"", b"short", None])
def test_a_damaged_file_is_made_anew(folder, damage):
    make = Maker()
    kept([], (), make)
    (file,) = folder.iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] if damage is None else damage)
    assert kept([], (), make) == kept([], (), make) == "machine 2"


def test_nothing_is_kept_where_it_may_or_can_not_be(folder, monkeypatch, tmp_path):
    make = Maker()
    hy.llvm_state.set_diskcache_enabled(False)
    assert [kept([], (), make) for _ in range(2)] == ["machine 1", "machine 2"]
    hy.llvm_state.set_diskcache_enabled(True)
    folder.write_text("not a folder", encoding="utf-8")
    assert [kept([], (), make) for _ in range(2)] == ["machine 3", "machine 4"]
    folder.unlink()
    hy.llvm_state.set_diskcache_path("")  # as heyoka's own where no home is known
    monkeypatch.chdir(tmp_path)
    assert [kept([], (), make) for _ in range(2)] == ["machine 5", "machine 6"]
    hy.llvm_state.set_diskcache_path(tmp_path)
    monkeypatch.setattr(module, "PROCESSOR", tmp_path / "nothing")
    module._maker.cache_clear()
    try:
        assert [kept([], (), make) for _ in range(2)] == ["machine 7", "machine 8"]
    finally:
        module._maker.cache_clear()
    assert not folder.exists()


def test_the_oldest_files_make_room(folder, monkeypatch):
    make = Maker()
    for number in range(3):
        kept([], (number,), make)
        for file in folder.iterdir():
            os.utime(file, (age := file.stat().st_mtime - 10.0, age))
    size = next(folder.iterdir()).stat().st_size
    other = folder / "other"
    other.write_bytes(bytes(2 * size))
    os.utime(other, (0.0, 0.0))
    monkeypatch.setattr(module, "LIMIT", 3 * size)
    kept([], (3,), make)
    assert len(list(folder.iterdir())) == 3 + other.exists() == 4
    assert [kept([], (n,), make) for n in (3, 2, 1)] == ["machine 4", "machine 3", "machine 2"]
    assert kept([], (0,), make) == "machine 5"
