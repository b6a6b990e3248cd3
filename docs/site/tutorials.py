"""Tutorials: pages whose Python is executed cell by cell, with what it prints and draws, and as notebooks to download."""

from __future__ import annotations

import base64
import contextlib
import io
import json
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PAGES = ROOT / "docs" / "tutorials"


@dataclass(frozen=True)
class Cell:
    """A piece of a page: text, or code with what it printed and drew."""

    source: str
    code: bool
    printed: str = ""
    drawn: tuple[bytes, ...] = ()  #: PNG files


def cells(text: str) -> list[Cell]:
    """The text and the blocks of Python of a page, in turn."""
    parts = re.split(r"```python\n(.*?)```\n?", text, flags=re.DOTALL)
    return [Cell(part.strip("\n"), bool(k % 2)) for k, part in enumerate(parts) if part.strip()]


def execute(page: list[Cell], name: str) -> tuple[list[Cell], dict[str, Any]]:
    """The cells with their results, and the names that they leave; they run in the root of the repository."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    names: dict[str, Any] = {}
    found = []
    with contextlib.chdir(ROOT):
        for cell in page:
            if not cell.code:
                found.append(cell)
                continue
            said, pictures = io.StringIO(), []
            with contextlib.redirect_stdout(said):
                exec(compile(cell.source, name, "exec"), names)
            for number in pyplot.get_fignums():
                picture = io.BytesIO()
                pyplot.figure(number).savefig(picture, dpi=100)
                pictures.append(picture.getvalue())
            pyplot.close("all")
            found.append(Cell(cell.source, True, said.getvalue().rstrip(), tuple(pictures)))
    return found, names


def notebook(page: list[Cell]) -> str:
    """The cells as a notebook of Jupyter, format 4.5."""
    known: list[dict[str, Any]] = []
    for k, cell in enumerate(page):
        entry: dict[str, Any] = {
            "id": f"cell-{k}",
            "metadata": {},
            "source": cell.source,
            "cell_type": "code" if cell.code else "markdown",
        }
        if cell.code:
            said = (
                [{"output_type": "stream", "name": "stdout", "text": cell.printed}]
                if cell.printed
                else []
            )
            images = [{"image/png": base64.b64encode(png).decode()} for png in cell.drawn]
            shown = [
                {"output_type": "display_data", "metadata": {}, "data": image} for image in images
            ]
            entry |= {"execution_count": None, "outputs": said + shown}
        known.append(entry)
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return json.dumps(
        {"nbformat": 4, "nbformat_minor": 5, "metadata": {"kernelspec": kernel}, "cells": known},
        indent=1,
    )


def write(folder: Path, executed: bool) -> None:
    """All tutorials with their notebooks; with their results where they are `executed`."""
    folder.mkdir(exist_ok=True)
    sys.path.insert(0, os.fspath(ROOT))  # for the package `examples`
    for path in sorted(PAGES.glob("*.md")):
        page = cells(path.read_text(encoding="utf-8"))
        page = execute(page, path.name)[0] if executed else page
        (folder / f"{path.stem}.ipynb").write_text(notebook(page), encoding="utf-8")
        parts, count = [], 0
        for cell in page:
            parts.append(f"```python\n{cell.source}\n```" if cell.code else cell.source)
            parts += [f"```text\n{cell.printed}\n```"] if cell.printed else []
            for png in cell.drawn:
                picture = folder / f"{path.stem}-{count}.png"
                picture.write_bytes(png)
                parts.append(f"![what the cell draws]({picture.name})")
                count += 1
        where = (
            "It runs in a clone of the repository, or in the folder that `fmbs demo --copy` makes."
        )
        parts.append(f"This page as a notebook: [{path.stem}.ipynb]({path.stem}.ipynb). {where}")
        (folder / path.name).write_text("\n\n".join(parts) + "\n", encoding="utf-8")
