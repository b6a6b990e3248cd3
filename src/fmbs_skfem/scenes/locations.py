"""Where a value of a scene stands, for messages."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from ..core.problems import Keys
from . import yamlfile

if TYPE_CHECKING:
    from .schema import Scene

Oddity: TypeAlias = tuple[Keys, str]  #: path of keys, and what is odd about what stands there


def where(scene: Scene, *keys: str | int) -> str:
    """`file:line: key.key` of the value at a path of keys and indices of the scene, for messages."""
    return location(str(scene.path or "scene"), scene.node, keys)


def location(name: str, node: yamlfile.Node | None, keys: Keys) -> str:
    """`file:line: key.key` of a path of keys in the tree of a file."""
    path = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(".")
    place = name if node is None else f"{name}:{yamlfile.line(node, keys)}"
    return f"{place}: {path}" if path else place
