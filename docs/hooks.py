"""Equations become MathML while the site is built, so that pages load nothing from elsewhere."""

import html
import re
from typing import Any

from latex2mathml.converter import convert

_INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
_BLOCK = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.DOTALL)


def on_page_content(content: str, **_: Any) -> str:
    """Replace what pymdownx.arithmatex marked as LaTeX (called by MkDocs for each page)."""
    content = _INLINE.sub(lambda found: convert(html.unescape(found[1])), content)
    return _BLOCK.sub(_displayed, content)


def _displayed(found: re.Match[str]) -> str:
    equation = convert(html.unescape(found[1]).strip(), display="block")
    return f'<div class="equation">{equation}</div>'
