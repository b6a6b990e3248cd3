"""VTK series: one .vtu an instant and a .pvd that lists them with their times; opens in ParaView,
meshio and pyvista.

    name.pvd -> name/00000.vtu, name/00001.vtu, ...

Every .vtu holds all bodies as one unstructured grid: lines as two-point cells, the skins of beams
and the middle surfaces of plates and shells as quadrilaterals. Point data: displacement, radius of
lines and skins, thickness of surfaces, and every field (velocity, strain, von_mises_top, ...), NaN
on bodies that lack it. Cell data: body, the place of the body in `Frames.bodies`. Format: VTK XML,
https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..core.errors import InputError, say
from ..core.storage import durable
from ..core.values.arguments import checked
from . import frames as frames_
from .frames import Array, Frames

if TYPE_CHECKING:
    import meshio


@checked
def write(frames: Frames, folder: Path | str, name: str) -> Path:
    """Write the series into `folder` and return the path of `name`.pvd; a series of that name is
    replaced.

    Raises InputError for a name that is none of a file, for scenes of mass points only, and for a
    field that is a scalar on one body and a vector on another; NoRoom where the disk is full.
    """
    return write_each(
        (frames_.select(frames, np.array([sample])) for sample in range(frames.times.size)),
        folder,
        name,
    )


def write_each(pieces: Iterable[Frames], folder: Path | str, name: str) -> Path:
    """`write` for frames that come piece by piece, in the order of time, so that they need not be
    in memory together.

    The file NAME.pvd names those in the folder NAME. InputError for a name with other than letters,
    digits, '_', '-' and '.', and where NAME is a file.
    """
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", name):
        raise InputError(say("series: name", "letters, digits, '_', '-' and '.'", repr(name)))
    target = Path(folder) / f"{name}.pvd"
    parts = Path(folder) / name
    if parts.is_file():
        raise InputError(
            say(f"series: {parts}", "a free folder name", "a file", "choose another name")
        )
    parts.mkdir(parents=True, exist_ok=True)
    times: list[float] = []
    for piece in pieces:
        for sample, mesh in enumerate(_meshes(piece)):
            _write_part(mesh, parts / f"{len(times):05d}.vtu")
            times.append(float(piece.times[sample]))
    _forget_rest(parts, len(times))
    return durable.write(target, _collection(np.array(times), name).encode())


def _meshes(frames: Frames) -> Iterator[meshio.Mesh]:
    """One mesh an instant: all lines, then all surfaces, over the points of all bodies in a row."""
    import meshio

    require_bodies(frames)
    cells, bodies = cells_of(frames)
    data = point_data(frames)
    points = np.concatenate([body.points for body in frames.bodies.values()], axis=1)
    for sample in range(frames.times.size):
        yield meshio.Mesh(
            points[sample],
            cells,
            {key: values[sample] for key, values in data.items()},
            {"body": bodies},
        )


def require_bodies(frames: Frames) -> None:
    """InputError for frames that have nothing to write."""
    if not frames.bodies:
        expected = "at least one cable, plate, shell or rigid body with points"
        raise InputError(say("series: bodies", expected, "point masses only"))


def cells_of(frames: Frames) -> tuple[list[tuple[str, np.ndarray]], list[np.ndarray]]:
    """Blocks of cells (e,2) and (e,4) over the points of all bodies in a row, and the number of the
    body of each cell (e,).
    """
    starts = np.cumsum([0, *(len(body.reference) for body in frames.bodies.values())])
    blocks, numbers = [], []
    for kind, surface in (("line", False), ("quad", True)):
        mine = [
            (k, starts[k] + body.cells)
            for k, body in enumerate(frames.bodies.values())
            if body.is_surface == surface
        ]
        if mine:
            blocks.append((kind, np.concatenate([cells for _, cells in mine])))
            numbers.append(
                np.concatenate([np.full(len(cells), k, dtype=np.int64) for k, cells in mine])
            )
    return blocks, numbers


def point_data(frames: Frames) -> dict[str, Array]:
    """Every field over the points of all bodies in a row: name -> (s,x) or (s,x,3).

    InputError for a field that is a scalar in one body and a vector in another one; NaN in bodies
    without it.
    """
    bodies = frames.bodies.values()
    data = _sizes(frames)
    each = [frames_.fields(body) for body in bodies]
    for name in frames_.names(frames):
        vector = {own[name].ndim == 3 for own in each if name in own}
        if len(vector) > 1:
            remedy = "give one of them another name"
            raise InputError(say(f"series: field '{name}'", "a scalar or a vector", "both", remedy))
        shapes = [
            body.points.shape if vector == {True} else body.points.shape[:2] for body in bodies
        ]
        data[name] = np.concatenate(
            [
                own[name] if name in own else np.full(shape, np.nan)
                for own, shape in zip(each, shapes, strict=True)
            ],
            axis=1,
        )
    return data


def _sizes(frames: Frames) -> dict[str, Array]:
    """Radius of lines and thickness of surfaces, NaN on the others, as far as there are such
    bodies.
    """
    found = {}
    for name, surface in (("radius", False), ("thickness", True)):
        own = [
            body.size if body.is_shell == surface else np.full(len(body.size), np.nan)
            for body in frames.bodies.values()
        ]
        values = np.concatenate(own)
        if np.isfinite(values).any():
            found[name] = np.broadcast_to(values, (frames.times.size, len(values)))
    return found


def _write_part(mesh: meshio.Mesh, path: Path) -> None:
    from meshio import vtu

    with durable.place(path) as part:
        vtu.write(str(part), mesh, binary=True, compression="zlib")


def _forget_rest(parts: Path, count: int) -> None:
    """Remove the instants of a longer series written here before."""
    for path in parts.glob("*.vtu"):
        if re.fullmatch(r"\d{5,}", path.stem) and int(path.stem) >= count:
            path.unlink()


def _collection(times: Array, name: str) -> str:
    """The list of a series; along a path whose load factor turns, its points are numbered instead,
    since readers sort by time.
    """
    times = np.arange(len(times), dtype=float) if (np.diff(times) <= 0.0).any() else times
    rows = "\n".join(
        f'    <DataSet timestep="{float(time)!r}" group="" part="0" file="{name}/{sample:05d}.vtu"/>'
        for sample, time in enumerate(times)
    )
    return f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n{rows}\n  </Collection>\n</VTKFile>\n'
