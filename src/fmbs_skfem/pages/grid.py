"""Grid planes around what a page shows, at multiples of one round length."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.values.display import DisplayUnits
from ..results.frames import Array
from ..results.rendering.camera import round_length

CELLS = 4  #: of the longest side, at least; others have at least two


def surround(
    points: Array, planar: bool, display: DisplayUnits
) -> tuple[Array, float, dict[str, Any]]:
    """The middle (3,) [m] of a grid of whole steps around points (n,3) [m], its longest side [m],
    and what the page draws it of.

    The step is round in the unit in which lengths are read; planar scenes have a grid that is flat
    in z.
    """
    lower = points.min(axis=0)
    upper = points.max(axis=0)
    # coinciding points still get a box
    extent = max(float((upper - lower).max()), 1e-6 * float(np.abs(points).max()))
    unit, size = display.find("m", float(np.abs(points).max()))
    step = round_length((extent / size if extent > 1e-12 else 1.0) / CELLS) * size
    low = np.floor(lower / step + 1e-6)
    high = np.ceil(upper / step - 1e-6)
    thin = high - low < 2
    low, high = np.where(thin, low - 1, low) * step, np.where(thin, high + 1, high) * step
    if planar:
        low[2], high[2] = lower[2], upper[2]
    box = {"half": ((high - low) / 2.0).tolist(), "step": step, "cell": f"{step / size:.6g} {unit}"}
    return (low + high) / 2.0, float((high - low).max()), box
