"""Code of the pages of the documentation: its fenced blocks, and a run of them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]


def blocks(page: str, language: str = "python") -> list[str]:
    """The fenced blocks of a page, by its path in the project."""
    return re.findall(
        rf"^```{language}\n(.*?)^```",
        (ROOT / page).read_text(encoding="utf-8"),
        re.DOTALL | re.MULTILINE,
    )


def run(page: str, code: Iterable[str] | None = None, **names: Any) -> dict[str, Any]:
    """The names that blocks of Python leave behind, by default all of the page, one after the
    other; some are given.
    """
    for block in blocks(page) if code is None else code:
        exec(compile(block, page, "exec"), names)
    return names
