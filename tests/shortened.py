"""The examples, of a tenth of the time, with fewer cells and small trainings."""

from __future__ import annotations

import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SHORTER = {
    "duration: 3 s": "duration: 0.3 s",
    "meshes/beam_100.msh": "meshes/beam_20.msh",
    "count: 512": "count: 64",
    "max_samples: 32": "max_samples: 8",
    "iterations: 12": "iterations: 2",
}


def shorten_examples(folder: Path) -> None:
    """The examples and their meshes in a folder, of a tenth of the time, with fewer cells and small
    trainings.
    """
    shutil.copytree(ROOT / "examples", folder / "examples")
    shutil.copytree(ROOT / "meshes", folder / "meshes")
    for path in (folder / "examples").glob("*.yaml"):
        text = path.read_text(encoding="utf-8")
        for long, short in SHORTER.items():
            text = text.replace(long, short)
        path.write_text(text, encoding="utf-8")
