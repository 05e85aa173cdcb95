"""Sphinx: the site. `make site` builds it offline, with warnings as errors."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_extensions"), str(HERE.parent)]

import squeal  # noqa: E402

project = "squeal"
author = "squeal contributors"
copyright = "squeal contributors; text and figures CC BY 4.0, program MIT"
version = release = squeal.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_gallery.gen_gallery",
    "docstrings",
    "mathml",
    "pages",
    "run",
]
root_doc = "index"
exclude_patterns = ["_build", "_extensions", "gallery/*", "generated/*.md", "generated/commands"]
nitpicky = True
# names of other packages, whose documentation is not at hand, and type variables
OTHERS = (*sys.stdlib_module_names, "numpy", "np", "scipy", "matplotlib", "heyoka", "hy")
nitpick_ignore_regex = [
    (r"py:.*", rf"({'|'.join(OTHERS)})\b.*"),
    (r"py:class", r"tuple\[.*"),
    (r"py:class", r"(.*\.)?([A-Z]|Machine|Answer|StateSpace|Subject|string|\w*Array|Reference)"),
]
suppress_warnings = ["ref.python"]  # classes of one name in two modules

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

autodoc_default_options = {"members": True, "member-order": "bysource", "ignore-module-all": True}
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "generated/gallery",
    "filename_pattern": r"\.py$",
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
    "min_reported_time": 600,
    "notebook_extensions": set(),
    "abort_on_example_error": True,
}

html_theme = "pydata_sphinx_theme"
html_title = "squeal"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {
    "logo": {"text": "squeal"},
    "navigation_with_keys": False,
    "navbar_align": "left",
    "header_links_before_dropdown": 7,
    "show_toc_level": 2,
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
# a sidebar where there are pages below
html_sidebars = {path.stem: [] for path in HERE.glob("*.md")}
