"""VTK series: one .vtu an instant and a .pvd that lists them with their times; opens in ParaView, meshio and pyvista.

    name.pvd -> name/00000.vtu, name/00001.vtu, ...

Every .vtu holds all bodies as one unstructured grid of two-point line cells. Point data: displacement, radius and every field
(velocity, strain, curvature, ...), NaN on bodies that lack it. Cell data: body, the place of the body in `Frames.bodies`.
Format: VTK XML, https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..core import errors
from . import frames as frames_
from .frames import Array, Frames

if TYPE_CHECKING:
    import meshio


def write(frames: Frames, folder: Path | str, name: str) -> Path:
    """Write the series into `folder` and return the path of `name`.pvd; a series of that name is replaced."""
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", name):
        raise errors.InputError(errors.say("series: name", "letters, digits, '_', '-' and '.'", repr(name)))
    import meshio

    target = Path(folder) / f"{name}.pvd"
    parts = Path(folder) / name
    if parts.is_file():
        raise errors.InputError(errors.say(f"series: {parts}", "a free folder name", "a file", "choose another name"))
    parts.mkdir(parents=True, exist_ok=True)
    cells, bodies = _cells(frames)
    data = _point_data(frames)
    points = np.concatenate([lines.points for lines in frames.bodies.values()], axis=1)
    for sample in range(frames.times.size):
        mesh = meshio.Mesh(
            points[sample], [("line", cells)], {key: values[sample] for key, values in data.items()}, {"body": [bodies]}
        )
        _write_part(mesh, parts / f"{sample:05d}.vtu")
    _forget_rest(parts, frames.times.size)
    _replace(target, _collection(frames.times, name))
    return target


def _cells(frames: Frames) -> tuple[np.ndarray, np.ndarray]:
    """Line cells (e,2) over the points of all bodies in a row, and the number of the body of each cell (e,)."""
    cells, bodies, start = [], [], 0
    for number, lines in enumerate(frames.bodies.values()):
        count = lines.reference.shape[0]
        first = start + np.arange(count - 1)
        cells.append(np.column_stack([first, first + 1]))
        bodies.append(np.full(count - 1, number, dtype=np.int64))
        start += count
    return np.concatenate(cells), np.concatenate(bodies)


def _point_data(frames: Frames) -> dict[str, Array]:
    """Every field over the points of all bodies in a row: name -> (s,x) or (s,x,3)."""
    data: dict[str, Array] = {}
    each = [frames_.fields(lines) for lines in frames.bodies.values()]
    for name in frames_.names(frames):
        vector = {own[name].ndim == 3 for own in each if name in own}
        if len(vector) > 1:
            remedy = "give one of them another name"
            raise errors.InputError(errors.say(f"series: field '{name}'", "a scalar or a vector", "both", remedy))
        shapes = [lines.points.shape if vector == {True} else lines.points.shape[:2] for lines in frames.bodies.values()]
        data[name] = np.concatenate(
            [own[name] if name in own else np.full(shape, np.nan) for own, shape in zip(each, shapes, strict=True)], axis=1
        )
    radii = [np.full(lines.points.shape[:2], lines.radius) for lines in frames.bodies.values()]
    return {"radius": np.concatenate(radii, axis=1)} | data


def _write_part(mesh: meshio.Mesh, path: Path) -> None:
    from meshio import vtu

    closed = path.with_suffix(".part")
    vtu.write(str(closed), mesh, binary=True, compression="zlib")
    os.replace(closed, path)


def _forget_rest(parts: Path, count: int) -> None:
    """Remove the instants of a longer series written here before."""
    for path in parts.glob("*.vtu"):
        if re.fullmatch(r"\d{5,}", path.stem) and int(path.stem) >= count:
            path.unlink()


def _collection(times: Array, name: str) -> str:
    rows = "\n".join(
        f'    <DataSet timestep="{float(time)!r}" group="" part="0" file="{name}/{sample:05d}.vtu"/>'
        for sample, time in enumerate(times)
    )
    return (
        f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n{rows}\n  </Collection>\n</VTKFile>\n'
    )


def _replace(path: Path, text: str) -> None:
    closed = path.with_suffix(".part")
    closed.write_text(text, encoding="utf-8")
    os.replace(closed, path)
