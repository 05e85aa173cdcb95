"""The live page: the integrator's own code as WebAssembly, in one HTML file. Run `make page`."""

PAGE = "squeal.html"
SITE = "../../docs/_build/html/"
"""From the page, where it is built, to the site; the site's own copy goes without."""
