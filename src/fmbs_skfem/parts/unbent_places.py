"""Places of parts whose direction is held or loaded, where their training had no moments: said
before anything is run.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.sparse import csc_array

from ..bodies.body import Body, ShapePoints
from ..core.algebra.linalg import as_dense
from ..core.notices import remark
from ..systems.prepared import remembered
from ..systems.system import System
from . import departures

REMEDY = (
    "train them on such motions, or with moments where they are clamped (fmbs part train --alone)"
)
TURNED = 1e-6  #: part of a row by which it reads directions of a place
#: part of a row, over its size, by which a joint or load acts elsewhere than at a place
ELSEWHERE = 1e-8


def warn_unbent(system: System, bodies: Iterable[Body]) -> None:
    """A remark of parts that are held or loaded in their direction at places where they were
    trained without moments.

    `system` has all multipliers, `bodies` are those that it is made of.
    """
    for part in bodies:
        if names := unbent_places(system, part):
            text = f"part '{part.name}': joints or loads act on its direction at {', '.join(names)}"
            remark(
                f"{text}, where its training had no moments: it may lack shapes that bend there, a run says how much; {REMEDY}"
            )


def unbent_places(system: System, part: Body) -> list[str]:
    """Places of a part on whose directions joints or loads of a system with all multipliers act,
    without moments in training.
    """
    points = next(
        (departures.shape_points(one) for one in system.elastic if one.name == part.name), None
    )
    if points is None or points.missing is None or not points.missing.unbent.size:
        return []
    turned = turned_places(
        points, rows_on(system, points.columns), as_dense(part.mass) @ part.constant
    )
    names = [*part.places, *part.frames]
    return [names[k] for k in sorted(turned & set(points.missing.unbent.tolist()))]


def turned_places(points: ShapePoints, probes: np.ndarray, weight: np.ndarray) -> set[int]:
    """Numbers of the places on whose directions probe rows (y, b c) of joints and loads act.

    Rows along the `weight` (b,) are not among them: by those constant loads grow to their whole
    size in statics.
    """
    missing = points.missing
    assert missing is not None
    b = missing.mass.shape[1]
    left = probes.reshape(len(probes), b, points.dim).transpose(0, 2, 1).reshape(-1, b)
    left = left[np.abs(left).max(axis=1) > ELSEWHERE * np.abs(left).max(initial=0.0)]
    across = left - np.outer(left @ weight, weight) / (weight @ weight)
    left = left[np.linalg.norm(across, axis=1) > ELSEWHERE * np.linalg.norm(left, axis=1)]
    found = set[int]()
    places = np.unique(missing.place)
    # points of a rim move with its frame: that first
    moved = places[np.argsort(np.isin(places, missing.unbent), kind="stable")]
    for place in moved:
        rows = missing.rows[missing.place == place][:, :b]
        weights = np.linalg.lstsq(rows.T, left.T, rcond=None)[0].T
        here = np.linalg.norm(left - weights @ rows, axis=1) <= ELSEWHERE * np.linalg.norm(
            left, axis=1
        )
        across = np.linalg.norm(weights[here][:, 1:] @ rows[1:], axis=1)
        if (across > TURNED * np.linalg.norm(left[here], axis=1)).any():
            found.add(int(place))
        left = left[~here]
    return found


def rows_on(system: System, columns: slice) -> np.ndarray:
    """Probe rows (j, b c) that read a body."""
    whole = remembered(system, "probes by columns", lambda: csc_array(system.probes.matrix))
    at, read, values = entries_of(whole, columns)
    rows, place = np.unique(read, return_inverse=True)
    found = np.zeros((len(rows), columns.stop - columns.start))
    np.add.at(found, (place, at), values)
    return found


def entries_of(A: csc_array, lines: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Entries (k,) of some rows of a matrix, or columns of one stored by these: the lines, counted
    from their first one, the places on them, and the values.
    """
    ends = A.indptr[lines.start : lines.stop + 1]
    stored = slice(ends[0], ends[-1])
    return np.repeat(np.arange(len(ends) - 1), np.diff(ends)), A.indices[stored], A.data[stored]
