"""Sphinx settings of the site: Markdown pages, docstrings as they stand in the source, equations without network."""

from __future__ import annotations

import gc
import html
import importlib.metadata
import sys
from pathlib import Path
from typing import Any

import ziamath
from docutils import nodes
from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent))
import docstrings

# pages are millions of nodes that stay: searches for garbage take long
gc.set_threshold(100_000, 20, 100)

project = "fmbs_skfem"
author = "fmbs_skfem developers"
release = version = importlib.metadata.version("fmbs_skfem")
extensions = ["myst_parser", "sphinx.ext.autodoc"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 4
exclude_patterns = ["README.md"]  # the index includes it
html_theme = "furo"
html_title = "fmbs_skfem"
html_static_path = ["site.css", "site.js"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_search_scorer = str(Path(__file__).parent / "scorer.js")
html_favicon = "icon.svg"  # a browser asks a server for one on its own
html_math_renderer = "drawn"
html_copy_source = False
html_show_sourcelink = False
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
html_use_index = html_domain_indices = False
toc_object_entries = False  # every page of the reference begins with a table of its objects
python_maximum_signature_line_length = 100
suppress_warnings = ["ref.python"]  # short names of types that stand in several modules


def drawn(text: str, size: int, inline: bool) -> str:
    """An equation of TeX as SVG of the colour of the text, on its baseline, with the TeX for those who do not see it."""
    found = ziamath.Latex(text, size=size, inline=inline, color="currentColor")
    label = html.escape(text, quote=True)
    return found.svg().replace(
        "<svg ",
        f'<svg role="img" aria-label="{label}" style="vertical-align:{found.getyofst():.2f}px" ',
        1,
    )


def write_math(writer: Any, node: nodes.math) -> None:
    writer.body.append(drawn(node.astext(), 16, True))
    raise nodes.SkipNode


def write_equation(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(
        f'<div class="equation" tabindex="0">{drawn(node.astext(), 18, False)}</div>'
    )
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    app.add_html_math_renderer("drawn", (write_math, None), (write_equation, None))
    app.connect("autodoc-process-docstring", docstrings.rewrite)
    app.connect("autodoc-process-signature", docstrings.sign)
