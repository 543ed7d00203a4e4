"""The manual as HTML, by Sphinx with MyST (Debian: python3-sphinx, python3-myst-parser): the CMake target `manual`."""
project = "Alidade"
author = "Alidade developers"
language = "en"
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
root_doc = "index"
exclude_patterns = ["README.md", "_*"]
# Anchors of headings as GitHub makes them, so that a link serves both.
myst_heading_anchors = 4
# Neither dates nor paths of the machine: the same sources make the same pages.
html_last_updated_fmt = None
html_theme = "alidade"
html_theme_path = ["_theme"]
html_title = "Alidade manual"
html_show_sourcelink = False
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
html_use_index = False
html_sidebars = {"**": ["search_field.html", "globaltoc.html"]}
# What pages link to that is not a page.
html_extra_path = ["files"]
html_permalinks_icon = "#"
pygments_style = "sphinx"
nitpicky = True
