"""Bodies as blocks of pyvista, for notebooks and one's own plots."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..core import extras
from . import frames as frames_
from .frames import Frames

if TYPE_CHECKING:
    from pyvista import MultiBlock


def blocks(frames: Frames) -> MultiBlock:
    """The bodies at the first instant, each a block with its name, its fields and its displacement."""
    extras.need("viz", "view")
    import pyvista

    found = pyvista.MultiBlock()
    for name, body in frames.bodies.items():
        cells = np.column_stack([np.full(len(body.cells), body.cells.shape[1]), body.cells]).ravel()
        mesh = pyvista.PolyData(body.points[0], **{"faces" if body.is_surface else "lines": cells})
        for field, values in frames_.fields(body).items():
            mesh.point_data[field] = values[0]
        found.append(mesh, name)
    return found
