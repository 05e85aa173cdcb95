"""One file a result: the function `study` of module X computes what results/X.json holds.

`python -m squeal.article.studies X FILE ... > results/X.json` runs it. Light on purpose: the
workflow reads the table of what each study needs.
"""

from squeal.article.cases import CASES, HISTORY_FIGURES, STEMS, stem

STORED = "identified.json"


def _scenes(*stems: str) -> tuple[str, ...]:
    return tuple(f"scenes/{name}.yaml" for name in stems)


_B2 = tuple(stem("B2", case) for case in CASES)
STUDIES = {
    "accuracy": _scenes(*HISTORY_FIGURES),
    "angles": _scenes(*_B2, "b3"),
    "claims": (*_scenes(*HISTORY_FIGURES), STORED),
    "eigenvalues": _scenes(*_B2),
    "extreme": (),
    "findings": _scenes(*STEMS),
    "loci": _scenes(*HISTORY_FIGURES),
    "precision": _scenes("b1-c", "b2-c", "b3"),
    "quasi_static": _scenes("b3"),
    "robustness": (STORED,),
    "stability": _scenes(*HISTORY_FIGURES),
    "verify": (STORED,),
}
"""What each study reads, in the folder `workflow`."""
