"""The example scenes that travel with the package."""

from __future__ import annotations

from pathlib import Path

SCENES = ".yaml"
DEMO = f"double_pendulum{SCENES}"


def folder() -> Path:
    """Where they are; in a source tree those of the repository."""
    package = Path(__file__).resolve().parents[1]
    packed = package / "_demo" / "examples"
    return packed if packed.is_dir() else package.parents[1] / "examples"


def names() -> list[str]:
    """Their names."""
    return sorted(path.stem for path in folder().glob(f"*{SCENES}"))
