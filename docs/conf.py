"""How Sphinx builds the documentation: `make docs`.

The pages are Markdown that is to be read on a Git host as well, so there is no syntax in them that only Sphinx knows,
but for the tables of contents and for comments `<!-- generated: ... -->`, which `_ext/kahanmaps_docs` replaces by what
it makes of the code. Nothing is fetched: formulas are MathML, set in a font that comes with the pages.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "_ext"))

from kahanmaps_docs.reference import api_pages_without_names  # noqa: E402

from kahanmaps.version import __version__  # noqa: E402

project = "kahanmaps"
author = "kahanmaps developers"
copyright = author
version = release = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "kahanmaps_docs"]
exclude_patterns = ["_build", "_ext", *api_pages_without_names(HERE)]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 5  # the anchors that a Git host makes, so that links to them hold in both places
myst_links_external_new_tab = False

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 80
add_module_names = False
toc_object_entries_show_parents = "hide"
smartquotes = False  # --eps is not a dash

# Every reference has to lead somewhere, but types in signatures may be those of other libraries or inner ones of ours.
nitpicky = True
nitpick_ignore_regex = [(r"py:(class|obj|data|exc|attr|meth|func|mod)", r".*")]

html_theme = "furo"
html_title = f"kahanmaps {release}"
html_static_path = ["_static", "../kahanmaps/reports/fonts"]  # reports and pages share the font of formulas
html_css_files = ["kahanmaps.css"]
html_math_renderer = "mathml"
html_use_index = False  # there is the search
html_domain_indices = False
html_show_copyright = False
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False
html_last_updated_fmt = None  # the same sources give the same pages
html_theme_options = {"navigation_with_keys": True}
highlight_language = "none"  # indented examples are commands, formulas, output
pygments_style = "friendly"
pygments_dark_style = "monokai"

linkcheck_timeout = 20
linkcheck_retries = 2
linkcheck_workers = 2
linkcheck_anchors = False
