"""What every report of a scene begins with: which one it is, and its sizes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .. import job as jobs

if TYPE_CHECKING:
    from ...scenes import Scene
    from ...systems import System


def heading(scene: Scene) -> dict[str, Any]:
    """Which scene, with which parameters, and what is done with it."""
    return {
        "scene": jobs.title(scene),
        "file": scene.path,
        "parameters": dict(scene.parameters),
        "analysis": scene.analysis.word,
    }


def sizes(raw: System, reduced: System) -> dict[str, int]:
    """Coordinates and constraint rows with all multipliers, and what is left to solve for."""
    return {
        "dofs": raw.size,
        "constraints": len(raw.constraints.names),
        "unknowns": reduced.size,
        "multipliers": len(reduced.constraints.names),
    }
