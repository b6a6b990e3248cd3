"""One file of HTML with everything in it: style, scripts, texts and arrays; nothing is loaded from
anywhere.

The policy in its head lets no script run but the one that was written here, and no request leave
the page.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Mapping
from html import escape
from importlib import resources
from typing import Any

from ..core.storage.records import dataclass
from .packing import Block, dumps

SCRIPTS = (
    "data.js",
    "plots.js",
    "shaders.js",
    "scene.js",
    "live.js",
    "wasm.js",
    "player.js",
    "tables.js",
)
POLICY = (
    "default-src 'none'; script-src 'sha256-{}' 'wasm-unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:; "
    "base-uri 'none'; form-action 'none'"
)


@dataclass(frozen=True)
class Page:
    """A page before it is written."""

    title: str
    content: Mapping[str, Any]
    block: Block
    body: str = ""  #: HTML behind the scene


def text(page: Page) -> str:
    """The file."""
    script = "\n".join(read(name) for name in SCRIPTS)
    mark = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    parts = {
        "policy": POLICY.format(mark),
        "title": escape(page.title),
        "style": read("page.css"),
        "body": page.body,
        "content": dumps(page.content),
        "block": page.block.text,
        "script": script,
    }
    # in one pass: what is put in is never looked at
    return re.sub(r"@(\w+)@", lambda found: parts[found[1]], read("page.html"))


def read(name: str) -> str:
    """A file of the folder `web`."""
    return resources.files(__package__).joinpath("web", name).read_text(encoding="utf-8")
