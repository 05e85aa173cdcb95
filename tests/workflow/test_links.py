"""Links of the site: what leads nowhere is named."""

import pytest

from tests.conftest import ROOT
from workflow.release.links import wrong


def page(folder, name, body):
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).write_text(f"<html><body>{body}</body></html>")


@pytest.mark.parametrize(
    "link",
    [
        "other.html",
        "other.html#here",
        "deep/",
        "#top",
        "a%20b.txt",
        "https://example.org/x#y",
        "data:image/png;base64,AA==",
    ],
)
def test_links_that_lead_somewhere_pass(tmp_path, link):
    page(tmp_path, "start.html", f'<p id="top"></p><a href="{link}">x</a>')
    page(tmp_path, "other.html", '<h1 id="here"></h1>')
    page(tmp_path, "deep/index.html", '<img src="../a b.txt">')
    (tmp_path / "a b.txt").touch()
    assert not list(wrong(tmp_path))


@pytest.mark.parametrize(
    ("link", "words"),
    [
        ("missing.html", "no such file"),
        ("start.html#nowhere", "no such place"),
        ("#nowhere", "no such place"),
        ("deep/", "no such file"),
        ("http://example.org", "no https address"),
        ("https:///x", "no https address"),
        ("//host", "no https address"),
    ],
)
def test_links_that_lead_nowhere_are_named(tmp_path, link, words):
    (tmp_path / "deep").mkdir()
    page(tmp_path, "start.html", f'<a href="{link}">x</a>')
    (found,) = wrong(tmp_path)
    assert found.startswith(f"start.html: {link}: {words}")


def test_no_page_has_the_name_of_one_that_sphinx_makes():
    """Sphinx writes its search form and its index over such a page."""
    made = {"search", "genindex", "py-modindex", "objects"}
    assert not made & {page.stem for page in (ROOT / "docs").glob("*.md")}
