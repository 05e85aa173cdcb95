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
    "sphinx.ext.intersphinx",
    "sphinx.ext.napoleon",
    "mathml",
    "pages",
    "pictures",
    "run",
]
root_doc = "index"
exclude_patterns = ["_build", "_extensions", "gallery/*", "generated/*.md", "generated/commands"]
nitpicky = True
nitpick_ignore_regex = [
    (r"py:class", r"squeal\..*\..*"),  # of rooms and types
    (r"py:class", r"[^.]*"),  # types of attributes in words, which are no links
]
# names of other projects that are linked stand in files here, so that nothing is fetched: version 1
# of Sphinx' inventories, which is plain text; a name that is in none of them stops the build
intersphinx_mapping = {
    name: (home, f"inventories/{name}.inv")
    for name, home in {
        "control": "https://python-control.readthedocs.io/en/stable/",
        "matplotlib": "https://matplotlib.org/stable/",
        "numpy": "https://numpy.org/doc/stable/",
        "pandas": "https://pandas.pydata.org/docs/",
        "scipy": "https://docs.scipy.org/doc/scipy/",
    }.items()
}
default_role = "code"
smartquotes = False  # the dashes of q'' are no quotation marks

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

autodoc_default_options = {"member-order": "bysource", "exclude-members": "columns, parts, table"}
autodoc_typehints = "none"  # docstrings say more: shapes and units
napoleon_use_param = napoleon_use_rtype = False  # types in words, which are no links
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
    "abort_on_example_error": True,
}

html_theme = "pydata_sphinx_theme"
html_title = "squeal"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["names.js"]
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
html_sidebars = {name: [] for name in ("index", "start")}  # no pages beside them
