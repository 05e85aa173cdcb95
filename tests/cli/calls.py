"""Commands as a user gives them, in this process: what they print and how they end."""

import json

from squeal.cli.main import main
from tests.conftest import ROOT, SCENES

B1 = SCENES / "b1-c.yaml"
B2 = SCENES / "b2-c.yaml"
B3 = SCENES / "b3.yaml"


def run(capsys, *arguments):
    """Exit code, standard output and standard error."""
    return main([str(a) for a in arguments]), *capsys.readouterr()


def words(command, **paths):
    """The words of a command, with paths where their names stand; paths may hold blanks."""
    parts = command.replace(str(ROOT), "ROOT").split()
    return [str(paths.get(part, part)).replace("ROOT", str(ROOT)) for part in parts]


def answer(capsys, *arguments):
    """The JSON answer of a command that ends well and says no more than its warnings."""
    code, out, err = run(capsys, *arguments, "--json")
    assert code == 0, err
    found = json.loads(out)
    assert_warns(err, found)
    return found


def assert_warns(err, found):
    """Standard error holds the warnings of the answer and nothing else."""
    assert err.splitlines() == [f"squeal: warning: {words}" for words in found.get("warnings", [])]


def assert_refused(capsys, *arguments, code=2):
    """The one line of a refusal, after warnings; nothing is printed on standard output."""
    ended, out, err = run(capsys, *arguments)
    assert (ended, out) == (code, "")
    *warnings, last = err.splitlines()
    assert all(line.startswith("squeal: warning: ") for line in warnings)
    assert last.startswith("squeal: ")
    return f"{last}\n"
