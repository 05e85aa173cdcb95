"""Builds that were killed, damaged, or made elsewhere."""

import fcntl
import json
import os
import subprocess
import sys
import zlib
from importlib import import_module

import pytest

from tests.conftest import ROOT
from workflow.processes import BUILD, begin
from workflow.release import verify


def test_a_job_ends_with_its_build():
    build = subprocess.Popen(["sleep", "100"])
    begins = "import time; print(flush=True)"
    waiting = ["timeit", "-n1", "-s", begins, "time.sleep(100)"]
    job = subprocess.Popen(
        [sys.executable, "-m", "workflow.processes", *waiting],
        cwd=ROOT,
        env=os.environ | {BUILD: str(build.pid)},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert job.stdout.readline() == b"\n"  # the job works while its build lives
    build.kill()
    build.wait()
    job.communicate()
    assert job.returncode != 0


def test_locks_are_removed_only_where_nobody_is(tmp_path, monkeypatch):
    monkeypatch.delenv(BUILD, raising=False)
    monkeypatch.setattr(sys, "argv", ["snakemake"])
    lock = tmp_path / "locks" / "0.output.lock"
    lock.parent.mkdir()
    lock.touch()
    with (tmp_path / "alive").open("a") as other:
        fcntl.flock(other, fcntl.LOCK_SH)
        begin(tmp_path).close()
        assert lock.exists()
    begin(tmp_path).close()
    assert not lock.exists()


MADE = b'"provenance": {"inputs": [], "module": "m", "versions": {}}'
FILES = {
    "results/a.json": b'{"mu": [0.4, 0.5], "name": "a", %b}' % MADE,
    "results/b.json": b'{"mu": [0.4, 0.6], "name": "b", %b}' % MADE,
    "results/a.csv": b"t [s],x [m]\n0.0,1.0\n0.1,2.0\n",
    "figures/a.txt": b"Two panels.\n",
    "figures/a.pdf": b"%PDF-1.4\n/Title (A)\n/Keywords (by 38664676)\n\nxref\n0 1\n%%EOF\n",
}


@pytest.fixture
def build(tmp_path, monkeypatch):
    for name, content in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    monkeypatch.setattr(verify, "built", lambda: [*FILES])
    return tmp_path, verify.manifest(tmp_path)


def test_where_a_build_comes_from_takes_no_part(build):
    place, known = build
    path = place / "results/a.json"
    path.write_bytes(FILES["results/a.json"].replace(b"{}", b'{"numpy": "3"}'))
    path = place / "figures/a.pdf"
    path.write_bytes(
        FILES["figures/a.pdf"].replace(b"by 38664676", b"by 0").replace(b"0 1", b"0 2")
    )
    assert verify.compared(known, place, same_tools=True) == ([], [])


def test_numbers_of_another_machine_agree(build):
    place, known = build
    path = place / "results/a.json"
    path.write_bytes(FILES["results/a.json"].replace(b"0.5", b"0.5000000001"))
    assert verify.compared(known, place, same_tools=False) == (["results/a.json"], [])
    assert verify.compared(known, place, same_tools=True)[1]
    path.write_bytes(FILES["results/a.json"].replace(b"0.5", b"0.50001"))
    assert verify.compared(known, place, same_tools=False)[1]


def paper(line, words=b"Points lose contact."):
    """A PDF as TeX writes it, with the line that names its commit."""
    page = zlib.compress(b"BT (%b) Tj ET /Source BMC BT (%b) Tj ET EMC BT ET" % (words, line))
    head = b"%%PDF-1.5\n1 0 obj\n<</Length %d /Filter /FlateDecode>>\n" % len(page)
    table = b"2 0 obj\n<</Type /XRef /Length 4>>\nstream\n%04d\nendstream\n" % len(page)
    return head + b"stream\n%b\nendstream\n" % page + table + b"startxref\n%d\n" % len(page)


def test_the_commit_of_a_paper_takes_no_part():
    first = paper(b"commit 1111111111")
    assert verify._paper(first) == verify._paper(paper(b"commit 22 with uncommitted changes"))
    assert verify._paper(first) != verify._paper(paper(b"commit 1111111111", b"A line does."))
    with pytest.raises(zlib.error):
        verify._paper(first.replace(zlib.compress(b"x")[:2], b"xx", 1))


def test_sensitive_numbers_agree_within_their_spread(build):
    place, known = build
    moved = b'"spread": [{"key": "mu.1", "low": 0.4, "high": 0.6}], "mu"'
    text = b"Two panels, 7 (5--9) of 10 motions.\n"
    json_file = place / "results/a.json"
    text_file = place / "figures/a.txt"
    json_file.write_bytes(FILES["results/a.json"].replace(b'"mu"', moved))
    text_file.write_bytes(text)
    known = verify.manifest(place)
    other = json_file.read_bytes().replace(b"0.4, 0.5]", b"0.4, 0.55]")
    json_file.write_bytes(other.replace(b'"low": 0.4', b'"low": 0.5'))
    text_file.write_bytes(text.replace(b"7 (5--9)", b"9 (8--10)"))
    assert verify.compared(known, place, same_tools=False)[1] == []
    json_file.write_bytes(other.replace(b"0.4, 0.55]", b"0.4, 1.5]"))
    text_file.write_bytes(text.replace(b"7 (5--9)", b"10"))
    assert verify.compared(known, place, same_tools=False)[1] == [
        "results/a.json: other numbers under mu",
        "figures/a.txt: prints 7 (5--9) there, 10 here",
    ]
    text_file.write_bytes(text.replace(b"motions", b"starts"))
    assert "figures/a.txt: other words" in verify.compared(known, place, same_tools=False)[1]


def test_other_instructions_make_another_machine():
    """NumPy's, OpenBLAS's and the C library's own switches hide instructions from them."""
    numpy_core = import_module("numpy._core._multiarray_umath")
    hidden = {
        "OPENBLAS_CORETYPE": "Prescott",
        "NPY_DISABLE_CPU_FEATURES": " ".join(numpy_core.__cpu_dispatch__),
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX,-FMA4,-AVX512F",
    }
    code = "import json; from workflow.release.verify import here; print(json.dumps(here()))"

    def machine(variables):
        run = subprocess.run(
            [sys.executable, "-c", code],
            cwd=ROOT,
            env=os.environ | variables,
            stdout=subprocess.PIPE,
            check=True,
        )
        return json.loads(run.stdout.splitlines()[-1])  # heyoka may warn before

    now = machine({})
    other = machine(hidden)
    if now["NumPy's instructions"] == other["NumPy's instructions"]:
        pytest.skip("this processor has no instructions that could be hidden")
    names = [line.partition(":")[0] for line in verify.unlike(now, other)]
    assert "NumPy's instructions" in names
    assert now["OpenBLAS's kernels"] == "none" or "OpenBLAS's kernels" in names
    assert now["processor"] == other["processor"]


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("alike", [True, False])
def test_every_damage_is_seen(build, name, alike):
    place, known = build
    damaged = [b"", FILES[name][: len(FILES[name]) * 2 // 3]]
    if name == "results/a.json":
        damaged.append(FILES["results/b.json"])
    for content in damaged:
        (place / name).write_bytes(content)
        assert [one.partition(":")[0] for one in verify.compared(known, place, alike)[1]] == [name]
    (place / name).unlink()
    assert verify.compared(known, place, alike)[1]
