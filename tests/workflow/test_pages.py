"""The trial of the pages: which steps it reads, and that it tells of one that fails."""

import os
from importlib.metadata import distribution

from tests.conftest import ROOT
from workflow.trials.pages import EXTRAS, NAME, Step, required, run_step, steps_of

PAGE = """\
# A page

```{run}
:head: 0
:code: 2
echo one > file
cat file; exit 2
```

```yaml
squeal: not a command
```

```console
$ make report
printed
```

```python
print(open("file").read())
raise SystemExit("broken")
```
"""


def test_steps_stand_at_their_lines_with_the_code_that_the_page_expects():
    steps = list(steps_of("page.md", PAGE))
    places = ["page.md:6", "page.md:7", "page.md:15", "page.md:20"]
    assert [step.place for step in steps] == places
    assert [step.code for step in steps] == [2, 2, 0, 0]
    assert [bool(step.reason_to_skip) for step in steps] == [False, False, True, False]
    assert [step.snippet for step in steps] == [False, False, False, True]


def test_steps_of_a_page_share_a_folder_and_errors_stand_in_the_output(tmp_path):
    first, second, _, snippet = steps_of("page.md", PAGE)
    variables = dict(os.environ)
    assert run_step(first, tmp_path, variables).returncode == 0
    assert run_step(second, tmp_path, variables).stdout == "one\n"
    done = run_step(snippet, tmp_path, variables)
    assert (done.returncode, done.stdout) == (1, "one\n\nbroken\n")


def test_the_environment_holds_what_the_wheel_requires_and_nothing_else():
    names = {package.metadata["Name"].lower() for package in required(distribution(NAME), EXTRAS)}
    assert {"numpy", "matplotlib", "pillow", "python-flint"} <= names
    assert not {"pytest", "pandas", "snakemake", "sphinx", "brake-squeal"} & names


def test_only_what_is_named_is_skipped():
    assert not Step("page.md", 1, "squeal example pad").reason_to_skip
    assert not Step("page.md", 1, "makeup").reason_to_skip
    assert Step("page.md", 1, "squeal article take fig11").reason_to_skip


def test_every_block_of_commands_is_read():
    """No page hides commands from the trial, in a block of another name or indented."""
    for path in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]:
        lines = [
            line for line in path.read_text(encoding="utf-8").split("\n") if line.startswith("$ ")
        ]
        steps = steps_of(path.name, path.read_text(encoding="utf-8"))
        assert set(lines) <= {f"$ {step.text}" for step in steps}, path
