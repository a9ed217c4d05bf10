# SPDX-License-Identifier: Apache-2.0
"""Sphinx's configuration; tools/docs.sh runs it on the tree that it puts together."""

import os

from pybtex.plugin import register_plugin
from pybtex.style.formatting.plain import Style
from pybtex.style.labels import BaseLabelStyle

project = "Wheelwright"
author = "The Wheelwright authors"
copyright = author
version = release = os.environ["WHEELWRIGHT_VERSION"]
language = "en"

extensions = ["myst_parser", "sphinxcontrib.bibtex"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["examples", "extra", "docs/site"]
myst_heading_anchors = 4
myst_enable_extensions = ["deflist"]
# Markdown for GitHub calls headings so, and begins pages with any level.
suppress_warnings = ["myst.header"]
highlight_language = "none"

html_theme = "alabaster"
html_theme_options = {"description": "Fault detection for wheeled robots with thresholds that are derived, not tuned",
                      "page_width": "1240px",
                      "sidebar_width": "260px", "font_family": "sans-serif", "fixed_sidebar": True}
html_sidebars = {"**": ["about.html", "navigation.html", "searchbox.html"]}
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_extra_path = [os.environ["WHEELWRIGHT_EXTRA"]]


class Keys(BaseLabelStyle):
    """Labels are the keys, which the comments in the code name."""

    def format_labels(self, sorted_entries):
        return [entry.key for entry in sorted_entries]


class Keyed(Style):
    default_label_style = Keys


register_plugin("pybtex.style.formatting", "keyed", Keyed)
bibtex_bibfiles = ["docs/references.bib"]
bibtex_default_style = "keyed"
