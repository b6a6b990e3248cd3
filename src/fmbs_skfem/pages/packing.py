"""Arrays and texts in a page: one block of compressed bytes, and JSON that names places in it.

    {"at": 1024, "shape": [601, 25], "type": "f4"}        little-endian, the places are multiples of four bytes

Nothing in a text can end the element that it stands in: `<` is written as an escape of JSON, and
Base64 has no such letter.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

TYPES = {"f2": "<f2", "f4": "<f4", "u4": "<u4"}  #: names of the numbers in a page


class Block:
    """Arrays behind each other."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.size = 0

    def put(self, values: Any, kind: str = "f4") -> dict[str, Any]:
        """Where an array stands, which is stored as numbers of a kind of `TYPES`."""
        array = np.ascontiguousarray(values, dtype=TYPES[kind])
        data = array.tobytes()
        data += bytes(-len(data) % 4)
        place = {"at": self.size, "shape": list(array.shape), "type": kind}
        self.parts.append(data)
        self.size += len(data)
        return place

    @property
    def text(self) -> str:
        """All of them, compressed (zlib), as Base64."""
        return base64.b64encode(zlib.compress(b"".join(self.parts), 9)).decode("ascii")


def dumps(content: Mapping[str, Any]) -> str:
    """JSON that can stand inside of an element of HTML, and that a script can read as it is."""
    text = json.dumps(content, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
