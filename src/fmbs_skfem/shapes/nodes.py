"""Nodes whose matrices are known and nothing between them: the space of a body that comes as
matrices.
"""

from __future__ import annotations

from ..core.storage.container import storable
from ..core.storage.records import dataclass


@storable
@dataclass(frozen=True)
class Nodes:
    """A space of `count` functions, each 1 at its node or the one vector that it is of."""

    count: int
