"""The command line as a user meets it: exit codes, JSON, refusals, and nothing loaded in vain."""

import contextlib
import json
import math
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from squeal.cli.main import ARTICLE, COMMANDS, GROUPS, main, parser_of
from tests.cli.calls import B1, B2, B3, answer, run, words
from tests.conftest import ROOT

ROOT_KEYS = "real imag frequency_hz damping_ratio residual"
SYSTEM = """parameters: {mu: 0}
M: [[1, 0], [0, 1]]
K: [{matrix: [[2, -1], [-1, 2]]}, {matrix: [[0, 1.3333333333333333], [0, 0]], factor: mu}]
"""
# fmt: off
THRESHOLDS = {
    "": "verdict_at_zero verdict_at_start mu_start mu_end",
    "critical": "mu kind frequency_hz interval residual",
    "crossings": "mu kind direction frequency_hz mode changes_verdict",
}
KEYS = {
    f"simulate {B2}": {
        "": "model final events shares extrema sliding_holds", "shares": "SS PC FC",
        "final": "t x y theta x_dot y_dot theta_dot", "extrema": "Rn delta", "events": "t from to",
    },
    f"eigenvalues {B1} --mu 0:1:5": {
        "": "equilibrium M C K eigenvalues verdict sweep", "equilibrium": "x y theta R_n contact",
        "eigenvalues": ROOT_KEYS, "sweep": "mu eigenvalues verdict",
    },
    "eigenvalues SYSTEM --sweep 0:1:3 --method reduced --band 0:10": {
        "": "certified count basis", "eigenvalues": ROOT_KEYS, "sweep": "mu eigenvalues verdict",
    },
    f"simulate {B2} --set F_n=0 --set outputs=[events] --set stop=1e-3": {"": "events"},
    "critical-friction PAD": THRESHOLDS,
    "critical-friction SYSTEM": THRESHOLDS,
    f"sliding {B2}": {
        "": "K determinant rank printed_K33_singular bound_23a bound_23b holds_as_printed "
        "holds_sign_aware K31_mismatch",
        "equilibria": "x y theta verdict",
    },
    f"map {B3} --n 20": {"": "share"},
    "advise PAD": {"": "critical levers", "levers": "parameter step lowered raised"},
    "claims": {"": "claims", "claims": "id verdict measured where"},
}
# fmt: on


def test_a_damping_ratio_has_one_form_for_people_and_one_for_programs(capsys, pad):
    """Sentence and table say the same in %, JSON holds -Re/|lambda|."""
    found = answer(capsys, "eigenvalues", pad)["unstable"][0]
    by_hand = -found["growth_rate"] / math.hypot(
        found["growth_rate"], math.tau * found["frequency_hz"]
    )
    assert found["damping_ratio"] == pytest.approx(by_hand)
    text = run(capsys, "eigenvalues", pad)[1]
    said = float(re.search(r"damping (\S+) %", text)[1])
    head, row = (line.split("  ") for line in text.split("unstable modes\n")[1].splitlines()[:2])
    shown = dict(zip(filter(None, map(str.strip, head)), filter(None, row), strict=True))
    assert float(shown["damping ratio, %"]) == pytest.approx(100 * by_hand, rel=1e-5)
    assert said == pytest.approx(100 * by_hand, rel=0.05)


@pytest.mark.parametrize("command", KEYS)
def test_json_has_the_promised_keys(capsys, tmp_path, pad, command):
    system = tmp_path / "system.yaml"
    system.write_text(SYSTEM)
    found = answer(capsys, *words(command, SYSTEM=system, PAD=pad))
    for place, keys in KEYS[command].items():
        one = found[place] if place else found
        assert set(keys.split()) <= (one[0] if isinstance(one, list) else one).keys(), place


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(capsys, command):
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    group = "article " if command in GROUPS[ARTICLE] else ""
    assert f"usage: squeal {group}{command}" in capsys.readouterr().out


@pytest.mark.parametrize("words", [(), ("eigenvalues",), ("article",), ("article", "claims")])
def test_help_may_stand_before_a_command(capsys, words):
    texts = []
    for typed in ([*words, "--help"], ["help", *words]):
        with contextlib.suppress(SystemExit):  # of the parser of a command
            assert main(typed) == 0
        texts.append(capsys.readouterr().out)
    assert texts[0] == texts[1] != ""


def test_sensitivity_has_a_slope_of_each_root_by_each_parameter(capsys, tmp_path):
    found = answer(capsys, "eigenvalues", B1, "--sensitivity")
    by = {row["parameter"]: row["eigenvalues"] for row in found["sensitivity"]}
    assert {"m", "I", "k1", "k4", "alpha2", "mu", "F_n"} <= by.keys()
    assert all(len(slopes) == 6 for slopes in by.values())
    found = answer(capsys, "critical-friction", B1, "--sensitivity")
    assert found["sensitivity"] is None
    # at another value of the parameter they are those of that value
    system = tmp_path / "system.yaml"
    system.write_text(SYSTEM.replace("factor: mu", "factor: mu**3"))
    there = answer(capsys, "eigenvalues", system, "--sensitivity", "--at", "2")["sensitivity"]
    set_there = answer(capsys, "eigenvalues", system, "--sensitivity", "--set", "mu=2")[
        "sensitivity"
    ]
    assert there == set_there


CODE = """
import json, sys; from squeal.cli.main import main
for words in json.loads(sys.argv[1]):
    main(words); print(' '.join(sys.modules), file=sys.stderr)
"""


def test_queries_load_neither_integrators_nor_plots(pad):
    # a pad that flutters and its onset first, and what costs a tenth of a second to load has no
    # place in a query of a third
    lean = {"heyoka", "scipy", "matplotlib", "control", "squeal.simulation.run"}
    leanest = lean | {"squeal.io.system", "squeal.sparse.argument_principle"}
    refused = {f"{name} PAD": leanest for name in ("eigenvalues", "critical-friction")}
    others = ("eigenvalues", "sliding", "critical-friction", "advise", "map --n 5")
    refused |= {f"{name} {B3}": lean for name in others}
    code = [sys.executable, "-c", CODE, json.dumps([words(one, PAD=pad) for one in refused])]
    done = subprocess.run(code, capture_output=True, text=True, check=True)
    for (command, no), line in zip(refused.items(), done.stderr.splitlines(), strict=True):
        assert not set(line.split()) & no, command


BRAKE = """parameters: {mu: 0.4, Omega: 12}
M: [[1, 0], [0, 1]]
C: [{matrix: [[20, 0], [0, 20]]}, {matrix: [[0, 1], [-1, 0]], factor: Omega}]
K: [{matrix: [[2e8, -1e8], [-1e8, 2e8]]}, {matrix: [[0, 1.5e8], [0, 0]], factor: mu}]
"""


TILT = """parameter: speed
M: [[1, 0], [0, 1]]
C: [{matrix: [[0, 2], [-2, 0]], factor: speed}]
K: [[2.5e5, 0], [0, 2.5e5]]
"""


@pytest.mark.usefixtures("coarse_charts", "without_layout")
@pytest.mark.parametrize("command", sorted(set(COMMANDS) - set(GROUPS[ARTICLE])))
def test_the_examples_of_help_run(capsys, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    if command != "example":  # which overwrites nothing
        shutil.copy(ROOT / "examples" / "pad.yaml", tmp_path)
        Path("samples.yaml").write_text("spreads: {mu: {relative: 0.1}}\nsamples: 40\n")
    Path("brake.yaml").write_text(BRAKE)
    Path("rotor.yaml").write_text(TILT)
    lines = parser_of(command)[1].epilog.splitlines()[1:]
    for line in lines:
        assert run(capsys, *shlex.split(line)[1:])[0] == 0, line
    assert lines


def test_names_that_are_not_shown_are_taken(capsys, tmp_path):
    new = tmp_path / "new.csv"
    old = tmp_path / "old.csv"
    both = (["--sweep", "0:1:3", "--table", new], ["--mu", "0:1:3", "--csv", old])
    for given in both:
        assert run(capsys, "eigenvalues", B3, *given)[0] == 0
    assert new.read_bytes() == old.read_bytes()
    assert not {"--mu ", "--csv"} & set(parser_of("eigenvalues")[1].format_help().split())
    of = [run(capsys, *group, "sliding", B2) for group in ([], ["article"])]
    assert of[0] == of[1]


def test_without_docstrings_every_command_answers_the_same(capsys):
    """As `python -OO` runs them, or PYTHONOPTIMIZE=2."""
    parse = "[parser_of(name)[1].format_help() for name in COMMANDS]"
    work = f"import sys; from squeal.cli.main import *; {parse}; sys.exit(main(sys.argv[1:]))"
    stripped = [sys.executable, "-OO", "-c", work, "eigenvalues", str(B1)]
    done = subprocess.run(stripped, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == run(capsys, "eigenvalues", B1)
