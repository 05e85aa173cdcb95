"""The documentation of the keys is current."""

from tests.conftest import ROOT
from workflow.release.keys import page


def test_the_committed_documentation_is_current():
    committed = (ROOT / "docs" / "scene.md").read_text(encoding="utf-8")
    assert committed == page(), "run python -m workflow.release.keys docs"
