"""What unknowns and constraint rows are called in messages."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from ..core.values.fields import AXES
from ..systems.system import System
from .outputs import positions, skins

SHOWN = 5  #: entries of a residual in a message


def coordinate_names(system: System) -> list[str]:
    """A name for every unknown: body and coordinate of a full model, component and mode of a
    reduced one.

    One text for each of the n unknowns. Of lines and surfaces it says where they act most,
    `beam at s = 0.45 m, y`.
    """
    if system.components:
        return [
            f"{name} mode {k + 1}"
            for name, first, last in system.components
            for k in range(last - first)
        ]
    names = [
        f"{body} coordinate {k}"
        for body, first, last in system.coordinates
        for k in range(last - first)
    ]
    for k, name in places(system).items():
        names[k] = name
    lead = csr_array(system.lift.matrix).tocsc()
    return [names[lead.indices[lead.indptr[j]]] for j in range(system.size)]


def places(system: System) -> dict[int, str]:
    """Where coordinates of lines and surfaces act most, by their numbers in q:
    `beam at s = 0.45 m, y`.
    """
    q = system.lift(system.x0)
    dim = system.dim
    found = dict[int, str]()
    first = {name: (start, end) for name, start, end in system.coordinates}
    for line in system.lines:
        points = positions(line, q[None], dim)[0]
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        if len(points) > 1:
            start, end = first[line.name]
            rows = abs(csr_array(line.samples)[: points.size, start:end]).argmax(axis=0)
            for k, row in enumerate(np.ravel(rows)):
                found[start + k] = f"{line.name} at s = {along[row // dim]:.3g} m, {AXES[k % dim]}"
    for skin in system.skins:
        points = skins(system, q)[skin.name][0]
        for b, place in enumerate(
            np.ravel(abs(csr_array(skin.samples)[: len(points)]).argmax(axis=0))
        ):
            at = ", ".join(f"{value:.3g}" for value in points[place])
            for c in range(dim):
                found[skin.columns.start + b * dim + c] = f"{skin.name} at ({at}), {AXES[c]}"
    return found


def row_names(system: System) -> list[str]:
    """A name for every unknown and every constraint row, as residuals are listed.

    n + m texts, `joint name.row` behind the unknowns.
    """
    return coordinate_names(system) + [
        f"joint {joint}.{label}" for joint, label in system.constraints.names
    ]


def worst(names: list[str], residual: np.ndarray) -> tuple[tuple[str, float], ...]:
    """The SHOWN largest entries of a residual by name; what is no number counts as infinite.

    `names` and `residual` are (n + m,); the values are magnitudes, the largest first.
    """
    values = np.abs(np.nan_to_num(residual, nan=np.inf))
    return tuple((names[k], float(values[k])) for k in np.argsort(values)[::-1][:SHOWN])


def as_text(values: tuple[tuple[str, float], ...]) -> str:
    """Names with their values as text.

    `name: value, name: value`, three digits each.
    """
    return ", ".join(f"{name}: {value:.3g}" for name, value in values)


def owners(system: System) -> list[str]:
    """The body or component of every unknown, and the joint of every constraint row.

    n + m texts. An unknown of an eliminated system belongs to the body of the first coordinate that
    it moves.
    """
    if system.components:
        names = [name for name, first, last in system.components for _ in range(last - first)]
    else:
        lead = csr_array(system.lift.matrix).tocsc()
        bodies = [name for name, first, last in system.coordinates for _ in range(last - first)]
        names = [bodies[lead.indices[lead.indptr[j]]] for j in range(system.size)]
    return names + [f"joint {joint}" for joint, _ in system.constraints.names]
