"""The site: Sphinx with Furo, Markdown by MyST, formulas by MathJax from a package; nothing is fetched."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import mechdesign

project = "mechdesign"
author = "the developers of mechdesign"
copyright = author
release = version = mechdesign.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
    "sphinxcontrib.typer",
    "pages",
]
exclude_patterns = [
    "_run",
    "_build",
    "gallery/_home.md",
    "theory/_path_problems*.md",
    "theory/_limits.md",
    "_benchmarks*.md",
]
nitpicky = True
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist", "fieldlist"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = "mechdesign"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_param = False
napoleon_use_rtype = False
autodoc_class_signature = "separated"
autodoc_preserve_defaults = True
autodoc_default_options = {"exclude-members": "__init__, __new__"}
