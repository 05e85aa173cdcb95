"""The file that names how parameters scatter.

```yaml
samples: 400              # optional: how many pads are drawn
seed: 1                   # optional: the same seed draws the same pads
spreads:                  # each parameter scatters on its own
  k1: {relative: 0.05}    # normal, standard deviation over the value
  alpha1: {absolute: 0.01} # normal, standard deviation in the parameter's unit
  h: {within: 1.0e-4}     # even, between the value minus and plus this
```
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from squeal.analysis.scatter import Spread
from squeal.io.document import read_document
from squeal.schema.arguments import FILE as PATH
from squeal.schema.arguments import takes
from squeal.schema.keys import Group, Key
from squeal.schema.place import Place
from squeal.schema.values import Kind, Number, Whole

SAMPLES, SEED = 400, 1
_ABOVE = Number(low=0.0)
SPREAD = Group(
    {
        "relative": Key("normal, standard deviation over the value", _ABOVE),
        "absolute": Key("normal, standard deviation in the parameter's unit", _ABOVE),
        "within": Key("even, between the value minus and plus this", _ABOVE),
    },
    only_one=True,
)


@dataclass(frozen=True)
class _Spreads(Kind):
    """A mapping of parameters to how each scatters."""

    def allowed(self) -> str:
        return "a mapping of parameters to spreads such as {relative: 0.05}"

    def read(self, value: Any, at: Place, model: str = "") -> tuple[Spread, ...]:
        """The spreads. Raises InputError."""
        if not isinstance(value, dict) or not value:
            raise at.must_be(value, self.allowed())
        found = []
        for name, one in value.items():
            ((kind, size),) = SPREAD.read(one, at / name).items()
            found.append(Spread(str(name), kind, size))  # type: ignore[arg-type]
        return tuple(found)

    def schema(self) -> dict[str, Any]:
        return {"type": "object", "minProperties": 1, "additionalProperties": SPREAD.schema()}


FILE = Group(
    {
        "samples": Key("how many are drawn", Whole(10, 1_000_000), default=f"{SAMPLES}"),
        "seed": Key("of the random numbers", Whole(0, 2**32 - 1), default=f"{SEED}"),
        "spreads": Key("how each parameter scatters", _Spreads(), required=True),
    },
    owner="a file of spreads",
)


@dataclass(frozen=True)
class SpreadFile:
    """What a file of spreads asks for."""

    spreads: tuple[Spread, ...]
    samples: int = SAMPLES
    seed: int = SEED


@takes(path=PATH)
def read_spreads(path: Path | str) -> SpreadFile:
    """The file, completely checked but for its parameters, which a scene or system has to have.

    Raises InputError with one sentence that names the file, the key and what is allowed.
    """
    return SpreadFile(**FILE.read(read_document(Path(path)), Place(str(path))))
