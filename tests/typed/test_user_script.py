"""Types as a user meets them: scripts against the package, checked by mypy and run."""

import math
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT

HERE = Path(__file__).parent


def checked(script: str) -> str:
    """What `mypy --strict` says of a script, in the shortest form."""
    pytest.importorskip("mypy")
    options = ["--strict", "--config-file", str(ROOT / "pyproject.toml"), "--follow-imports=silent"]
    command = [sys.executable, "-m", "mypy", *options, "--no-error-summary", str(HERE / script)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.stderr == ""  # else mypy itself failed, and said nothing of the script
    return run.stdout


def test_a_users_script_passes_strict_types():
    assert checked("user_script.py") == ""


def test_what_is_no_subject_or_no_name_is_refused_by_types():
    lines = (HERE / "refused_script.txt").read_text(encoding="utf-8").splitlines()
    wanted = set()
    for number, line in enumerate(lines, 1):
        if line.startswith("squeal."):
            wanted.add((number, line.partition("  # ")[2]))
    said = re.findall(r":(\d+): error: .*\[([\w-]+)\]", checked("refused_script.txt"))
    assert {(int(number), code) for number, code in said} == wanted


def test_a_users_script_runs(tmp_path):
    command = [sys.executable, str(HERE / "user_script.py"), str(tmp_path)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    critical, roots, growth, rows = run.stdout.split()
    # roots of s^2 + c s + 2 = +-i w: s = +-sqrt(-2 +- i w) has Re = 0 with c where w^2 = 2 c^2
    exact = 0.75 * (1.0 + 2.0 * 0.01**2)
    assert math.isclose(float(critical), exact, abs_tol=2e-6)
    assert (roots, growth, rows) == ("4", "11", "44")
    assert (tmp_path / "swept.csv").is_file()
    assert (tmp_path / "thresholds.svg").is_file()
