"""One file for a whole motion, name.vtkhdf: the mesh once, in the reference, and all fields over
time.

Points stand in the reference; the field `displacement` moves them (Warp By Vector in ParaView).
Bodies, cells and fields are those of `series`. Format: VTK HDF 2.0 with transient data,
https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..core.storage import durable
from . import series
from .frames import Frames

SUFFIX = ".vtkhdf"
TYPES = {"line": 3, "quad": 9}  #: numbers of cells in VTK
FIXED = ("PartOffsets", "PointOffsets")  #: of the mesh, which is the same in all steps


def write(pieces: Iterable[Frames], path: Path) -> Path:
    """Write frames, which come piece by piece in the order of time; NoRoom where the disk is full."""
    import h5py

    times: list[float] = []
    with durable.place(path) as part, h5py.File(part, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 0])
        root.attrs.create("Type", np.bytes_("UnstructuredGrid"))
        for piece in pieces:
            if not times:
                write_mesh(root, piece)
            for name, values in series.point_data(piece).items():
                append(root, f"PointData/{name}", values.reshape(-1, *values.shape[2:]))
            times.extend(float(time) for time in piece.times)
        write_steps(root, np.array(times))
    return path


def write_mesh(root: Any, frames: Frames) -> None:
    """Points in the reference, cells, and the body of every cell."""
    series.require_bodies(frames)
    blocks, bodies = series.cells_of(frames)
    points = np.concatenate([body.reference for body in frames.bodies.values()])
    sizes = np.concatenate([np.full(len(cells), cells.shape[1]) for _, cells in blocks])
    connectivity = np.concatenate([cells.ravel() for _, cells in blocks])
    for name, count in (
        ("Points", len(points)),
        ("Cells", len(sizes)),
        ("ConnectivityIds", len(connectivity)),
    ):
        root[f"NumberOf{name}"] = np.array([count])
    root["Points"], root["Connectivity"] = points, connectivity
    root["Offsets"] = np.concatenate([[0], np.cumsum(sizes)])
    root["Types"] = np.concatenate(
        [np.full(len(cells), TYPES[kind], dtype=np.uint8) for kind, cells in blocks]
    )
    root["CellData/body"] = np.concatenate(bodies)


def append(root: Any, name: str, values: np.ndarray) -> None:
    """Rows (i, ...) behind those that are there."""
    if name not in root:
        root.create_dataset(
            name, data=values, maxshape=(None, *values.shape[1:]), chunks=True, compression="gzip"
        )
        return
    there = root[name]
    there.resize(len(there) + len(values), axis=0)
    there[-len(values) :] = values


def write_steps(root: Any, times: np.ndarray) -> None:
    """Where every step finds its mesh, which is the first, and its fields."""
    steps = root.create_group("Steps")
    count = len(times)
    steps.attrs["NSteps"] = count
    steps["Values"], steps["NumberOfParts"] = times, np.ones(count, dtype=np.int64)
    none = np.zeros(count, dtype=np.int64)
    for name in FIXED:
        steps[name] = none
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = none[:, None]
    steps["CellDataOffsets/body"] = none
    for name, values in root["PointData"].items():
        steps[f"PointDataOffsets/{name}"] = np.arange(count, dtype=np.int64) * (
            len(values) // count
        )
