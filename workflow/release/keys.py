"""The table of keys as a page: `python -m workflow.release.keys docs` writes it.

A test says whether it is current.
"""

import sys
from pathlib import Path

from squeal.io.components import ASSEMBLY, COMPONENT, CONTACT, LOAD, REDUCED, ROTATION
from squeal.io.scene import SCENE
from squeal.io.system_keys import DAMPING, POWER, SYSTEM, TABLE, TERM
from squeal.io.writing import write_text
from squeal.model.contact import MODELS
from squeal.schema import Group, Key

_INTRODUCTION = """\
# Scene and system files

Written by `python -m workflow.release.keys docs` from the table that also reads the files.

A scene is one YAML file in UTF-8: a model, its pad, and what is wanted. Numbers are finite and in
SI units; an angle is a number of radians or a multiple of pi such as `0.75*pi` or `pi/2`, which is
taken as its double, also by proofs: the formula `0.25*pi` stands for 0.7853981633974483. A key that
the model does not use is refused, and so is every unknown or doubled key, with one sentence that
names the file, the key, the value and what is allowed. `squeal COMMAND -` reads the file from
standard input, and `--set NAME=VALUE` changes one value of it, such as `--set mu=0.3` or
`--set time.stop=0.1`; `--set k3=null` leaves a key out, to try another model.

```yaml
model: B1
parameters:
  {m: 0.2, w: 0.04, h: 0.014, k1: 2.0e7, k2: 2.6e7, k3: 8.7e6, k4: 8.7e6,
   L1: 0.8, L2: 0.8, alpha1: 0.5*pi, alpha2: pi, mu: 0.4, F_n: 4500.0}
time: {stop: 0.01, samples: 2001}       # only `simulate` needs it
```
"""
_SYSTEM = """\
# System files

A linear system M q'' + C q' + K q = 0 in place of a scene, for every command but those of motions
(`simulate`, `cycles`) and of the article. M, C and K are rows of numbers, files, or lists of terms
with a factor each, a formula of named numbers with + - * / ** and parentheses:

```yaml
name: brake
parameters: {Omega: 12.566, mu: 0.4}
parameter: Omega
M: {file: M.mtx}
C:
  - {file: D.mtx}
  - {file: G.mtx, factor: Omega}
K: [{file: K0.mtx}, {file: K1.mtx, factor: mu}]
damping: {rayleigh: [2.0, 1.0e-7]}
```

A file stands beside the system file. Its format is read from its content, and the suffix is a hint
where that does not tell: Matrix Market, MATLAB, NumPy, Harwell-Boeing (HBMAT of Ansys), Ansys
`.full`, Nastran OP4, OP2 and DMIG, and the text that Abaqus and CalculiX write. [](files.md) shows
how to get them from each program. Where no entry of such text has another one on the other side of
the diagonal, a line that begins with `*` may say TYPE=SYMMETRIC or TYPE=UNSYMMETRIC, or the key
`symmetric` beside the file. Without either, what can only be a stiffness or mass is completed with
a warning, and anything else is refused.

Rows whose diagonal stands decades above all others are supports, as finite-element programs write
them: they are left out, with a warning. Entries that stand twice are summed and rows that M or K
alone have are united, both with a warning too. `--set mu=0.3` changes a named
number. Up to 2000 rows may be written into the file itself.

For small systems that depend on a parameter p alone there are K0, K1, ... in place of K, rows of
numbers: K = K0 + K1 p + K2 p^2 + ..., and C likewise; a power that is left out is zero, and M must
then be symmetric and positive definite.

```yaml
name: mode coupling
M: [[1, 0], [0, 1]]
K0: [[2, -1], [-1, 2]]
K1: [[0, 1.333], [0, 0]]
```
"""
_ASSEMBLY = """\
# Assembly files

Components, each a system file, joined by contact in place of a system; [](components.md) has one.
"""


def page() -> str:
    """Every key of scene, system and assembly files, as Markdown."""
    parts = [_INTRODUCTION, _table("The file", SCENE)]
    for name, key in SCENE.keys.items():
        if isinstance(key.kind, Group):
            parts.append(_table(f"`{name}`", key.kind))
    # C1 to C9 and K1 to K9 have no rows of their own: the rows of C0 and K0 stand for them
    higher_powers = [str(power) for power in range(1, POWER + 1)]
    shown = {}
    for name, key in SYSTEM.keys.items():
        if name in ("C0", "K0"):
            shown[f"{name} to {name[0]}{POWER}"] = key
        elif name[1:] not in higher_powers:
            shown[name] = key
    general = [_table("The file", Group(shown)), _table("A term", TERM), _table("`table`", TABLE)]
    tables = {
        "A component": COMPONENT,
        "`load`": LOAD,
        "`rotation`": ROTATION,
        "`reduced`": REDUCED,
        "A contact": CONTACT,
    }
    joined = [_table(title, group) for title, group in ({"The file": ASSEMBLY} | tables).items()]
    return "\n".join([*parts, _SYSTEM, *general, _table("`damping`", DAMPING), _ASSEMBLY, *joined])


def _table(title: str, group: Group) -> str:
    head = ["key", "what it is", "unit", "allowed", "left out", "models"]
    rows = [head, ["---"] * len(head), *(_row(name, key) for name, key in group.keys.items())]
    if all(row[-1] == "all" for row in rows[2:]):
        rows = [row[:-1] for row in rows]
    note = "Exactly one of these.\n\n" if group.only_one else ""
    lines = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    return f"## {title}\n\n{note}{lines}\n"


def _row(name: str, key: Key) -> list[str]:
    left_out = "refused" if key.required and not key.unless else key.default or "-"
    models = ", ".join(key.models) if key.models and key.models != tuple(MODELS) else "all"
    return [f"`{name}`", key.meaning, key.unit or "-", key.kind.allowed, left_out, models]


def main() -> int:
    """Write the page into the folder that is named."""
    write_text(Path(sys.argv[1]) / "scene.md", page())
    return 0


if __name__ == "__main__":
    sys.exit(main())
