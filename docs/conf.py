"""The documentation site: ``sphinx-build -W -b html docs build/site``, no network needed."""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import ident

project = "ident"
author = "the authors of ident"
version = release = ident.__version__
project_copyright = author

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx_gallery.gen_gallery",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
# What the gallery leaves beside its pages.
exclude_patterns = ["gallery/**", "auto_gallery/*.ipynb", "auto_gallery/*.py", "**sg_execution_times.rst"]
myst_heading_anchors = 3
suppress_warnings = ["config.cache"]

html_theme = "furo"
html_title = f"ident {version}"

autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "auto_gallery",
    "filename_pattern": r"\d\d_",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "remove_config_comments": True,
    "min_reported_time": 1e9,
}

_ITEM = re.compile(r"^(\*{0,2}\w[\w, .]*?) : (.+)$")
_TITLED = ("Parameters", "Attributes")


def numpydoc_items(app, what, name, obj, options, lines):
    """``x, y : what they are`` is a meaning here, not a type: it goes below the name."""
    section, out = "", []
    for i, line in enumerate(lines):
        if i + 1 < len(lines) and lines[i + 1] and set(lines[i + 1]) == {"-"}:
            section = line
        item = _ITEM.match(line)
        if item and section in _TITLED:
            out += [item[1], "    " + item[2]]
        else:
            out.append(line)
    lines[:] = out


def setup(app):  # noqa: D103
    # Before napoleon, which reads the sections.
    app.connect("autodoc-process-docstring", numpydoc_items, priority=100)
