"""Plain systems M q'' + C q' + K(mu) q = 0 from a YAML file.

```yaml
name: mode coupling           # free text, optional
reference: where it is from   # free text, optional
parameter: mu                 # what the free parameter is called, optional
M: [[1, 0], [0, 1]]           # symmetric, positive definite
C0: [[0, 0], [0, 0]]          # optional: C = C0 + C1 mu + C2 mu^2 + ...
K0: [[2, -1], [-1, 2]]        # K = K0 + K1 mu + K2 mu^2 + ...
K1: [[0, 1.333], [0, 0]]      # a power that is left out is zero
```
"""

from dataclasses import dataclass, field
from keyword import iskeyword
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyval

from squeal.errors import InputError
from squeal.io.document import read_document
from squeal.linear.matrices import Array, reduce
from squeal.linear.system import Term, TermSystem
from squeal.numerics.formula import Formula
from squeal.schema.arguments import FILE, takes
from squeal.schema.keys import Group, Key
from squeal.schema.place import Place
from squeal.schema.values import Square, Text

POWER = 9


def system_keys(count: int | None) -> Group:
    """The table of a system file's keys, for matrices with so many rows."""
    found = {
        "name": Key("what the system is called", Text(), default="the name of the file"),
        "reference": Key("where it is from", Text(), default="empty"),
        "parameter": Key("what the free parameter is called", Text(), default="mu"),
        "M": Key("mass matrix, symmetric and positive definite", Square(), required=True),
    }
    for letter, what in (("C", "damping and gyroscopic forces"), ("K", "stiffness")):
        for power in range(POWER + 1):
            needed = (letter, power) == ("K", 0)
            meaning = f"{what}: what is multiplied with that power of the parameter"
            default = "" if needed else "0"
            found[f"{letter}{power}"] = Key(
                meaning, Square(count, "M"), required=needed, default=default
            )
    return Group(found, owner="every system")


@dataclass(frozen=True, eq=False)
class PlainSystem:
    """M q'' + C(mu) q' + K(mu) q = 0 with polynomials C and K; call it with mu for (M, C, K)."""

    name: str
    reference: str
    parameter: str
    M: Array = field(repr=False)  # (n, n)
    C: tuple[Array, ...] = field(
        repr=False
    )  # coefficients of rising powers of mu, (n, n) each; none if undamped
    K: tuple[Array, ...] = field(repr=False)

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return len(self.M)

    def terms(self) -> TermSystem:
        """The same as a system of terms; a parameter whose name is no word is called p."""
        word = self.parameter.isidentifier() and not iskeyword(self.parameter)
        name = self.parameter if word else "p"
        C, K = (
            tuple(Term(X, Formula(f"{name}**{k}")) if k else Term(X) for k, X in enumerate(powers))
            for powers in (self.C, self.K)
        )
        return TermSystem((Term(self.M),), C, K, {}, name, self.name)

    def __call__(self, mu: float) -> tuple[Array, Array | None, Array]:
        """The matrices at mu; C is None for an undamped system."""
        C = np.asarray(polyval(mu, np.array(self.C))) if self.C else None
        return self.M, C, np.asarray(polyval(mu, np.array(self.K)))


@takes(path=FILE)
def read_plain(path: Path | str) -> PlainSystem:
    """The system that a YAML file describes, completely checked.

    Raises InputError with one sentence that names the file, the key, the value and what is
    allowed.
    """
    return plain_system(read_document(Path(path)), Place(str(path)))


def plain_system(document: dict[str, Any], at: Place) -> PlainSystem:
    """The system in a mapping of the file's form; `at` tells messages where it stands."""
    rows = document.get("M")
    given = system_keys(len(rows) if isinstance(rows, list) else None).read(document, at)
    M = np.array(given["M"])
    try:
        reduce(M, None, np.zeros_like(M))
    except InputError:
        raise (at / "M").must_be(rows, "symmetric and positive definite") from None
    name, parameter = given.get("name") or Path(at.source).stem, given.get("parameter") or "mu"
    C, K = (_coefficients(part, given, len(M)) for part in ("C", "K"))
    return PlainSystem(name, given.get("reference", ""), parameter, M, C, K)


def _coefficients(letter: str, given: dict[str, Any], n: int) -> tuple[Array, ...]:
    powers = [p for p in range(POWER + 1) if f"{letter}{p}" in given]
    result = [np.zeros((n, n)) for _ in range(max(powers, default=-1) + 1)]
    for power in powers:
        result[power] = np.array(given[f"{letter}{power}"])
    return tuple(result)
