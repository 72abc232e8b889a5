# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""The settings of Sphinx; scripts/docs sets the paths."""

import os
import re
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import mend_furo  # noqa: E402

project = "loopbit"
author = "The loopbit authors"
copyright = "2026, the loopbit authors"  # noqa: A001: Sphinx's name for it
version = release = os.environ["LOOPBIT_VERSION"]
extensions = ["myst_parser", "sphinx.ext.autodoc"]

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autoclass_content = "both"

myst_heading_anchors = 3
root_doc = "index"
html_theme = "furo"
html_title = f"loopbit {release}"
html_copy_source = False
html_show_sourcelink = False
html_static_path = ["site.css"]
html_css_files = ["site.css"]
# Load nothing external, so that the pages open without a network.
html_theme_options = {"light_css_variables": {"font-stack": "system-ui, sans-serif"},
                      "dark_css_variables": {"font-stack": "system-ui, sans-serif"}}
pygments_style = "friendly"


def escape(app, what, name, obj, options, lines):
    """Docstrings are plain text, in which |O| is a count."""
    lines[:] = [line.replace("|", r"\|") for line in lines]


def without_self(app, what, name, obj, options, signature, returned):
    return signature and re.sub(r"self(: [\w.]+)?(, )?", "", signature), returned


def setup(app):
    app.connect("autodoc-process-signature", without_self)
    app.connect("autodoc-process-docstring", escape)
    app.connect("build-finished", mend_furo.mend)
