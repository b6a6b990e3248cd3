"""MED files (HDF5) of Salome, Code_Aster and gmsh: nodes, cells, and the groups of their families.

A family is a set of nodes or cells with the names of the groups that they are in. gmsh names points
by groups of point cells, Salome by groups of nodes: both are point groups here. Fields are not
read. Source: MED file format 3 and 4,
https://docs.salome-platform.org/latest/dev/MEDCoupling/developer/med-file.html
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError, say
from ..core.values.problems import printable
from . import exchange
from .exchange import Groups, Ints

_KINDS = {
    "SE2": "line",
    "SE3": "line3",
    "TR3": "triangle",
    "TR6": "triangle6",
    "TR7": "triangle7",
    "QU4": "quad",
    "QU8": "quad8",
}
_KINDS |= {
    "QU9": "quad9",
    "TE4": "tetra",
    "T10": "tetra10",
    "HE8": "hexahedron",
    "H20": "hexahedron20",
    "H27": "hexahedron27",
}
_KINDS |= {"PY5": "pyramid", "P13": "pyramid13", "PE6": "wedge", "P15": "wedge15", "PO1": "vertex"}


def read(path: Path, target: Path, where: str) -> None:
    """Write the mesh of a file for `exchange.load`."""
    import h5py

    try:
        with h5py.File(path) as file:
            exchange.save(_mesh(file, where), target)
    except (OSError, KeyError, ValueError, TypeError, AttributeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            say(where, "a MED file that can be read", str(error), "export it again, or as .msh 4.1")
        ) from None


def _mesh(file: Any, where: str) -> exchange.Mesh:
    name, mesh = _only(file["ENS_MAA"], where, "mesh")
    dimension = int(mesh.attrs["ESP"])
    if "NOE" not in mesh:
        _, mesh = _only(mesh, where, "time step")
    nodes = mesh["NOE"]
    count = int(nodes["COO"].attrs["NBR"])
    points = np.zeros((count, 3))
    points[:, :dimension] = nodes["COO"][()].reshape(dimension, count).T
    numbers = nodes["NUM"][()].astype(np.int64) if "NUM" in nodes else np.arange(1, count + 1)
    families = file["FAS"][name] if name in file.get("FAS", {}) else {}
    point_groups = _members(_families(families.get("NOEUD")), _tags(nodes, count))
    named = _families(families.get("ELEME"))
    blocks = []
    tags = []
    for code, part in mesh.get("MAI", {}).items():
        total = int(part["NOD"].attrs["NBR"])
        kind = _KINDS.get(code, f"MED type {code}")
        rows = (
            part["NOD"][()].astype(np.int64).reshape(-1, total).T - 1
            if code in _KINDS
            else np.zeros((total, 0), np.int64)
        )
        if rows.size and (rows.min() < 0 or rows.max() >= count):
            raise InputError(
                say(
                    where,
                    f"cells on nodes 1 to {count}",
                    f"{rows.min() + 1} to {rows.max() + 1}",
                    "export it again",
                )
            )
        if code == "PO1":
            for group, members in _members(named, _tags(part, total)).items():
                if len(members):
                    point_groups[group] = np.union1d(
                        point_groups.get(group, members[:0]), rows[members, 0]
                    )
            continue
        blocks.append(
            (
                kind,
                rows,
                part["NUM"][()].astype(np.int64) if "NUM" in part else np.arange(1, total + 1),
            )
        )
        tags.append(_tags(part, total))
    cell_groups = _members(named, np.concatenate([np.zeros(0, np.int64), *tags]))
    points_only = {group for group in point_groups if not len(cell_groups.get(group, ()))}
    cell_groups = {
        group: members for group, members in cell_groups.items() if group not in points_only
    }
    return exchange.gathered(points, numbers, blocks, point_groups, cell_groups)


def _only(group: Any, where: str, what: str) -> tuple[str, Any]:
    names = list(group)
    if len(names) != 1:
        got = f"{len(names)}" + (f" ({', '.join(map(printable, names[:5]))})" if names else "")
        raise InputError(say(where, f"one {what}", got, "export one"))
    return names[0], group[names[0]]


def _tags(part: Any, count: int) -> Ints:
    return np.asarray(part["FAM"][()], np.int64) if "FAM" in part else np.zeros(count, np.int64)


def _families(parent: Any) -> dict[str, list[int]]:
    """Names of groups, each with the numbers of its families."""
    found: dict[str, list[int]] = {}
    for family in (parent or {}).values():
        for row in family["GRO"]["NOM"][()] if "GRO" in family else ():
            name = printable(
                bytes(np.asarray(row).astype(np.uint8))
                .split(b"\0")[0]
                .decode("utf-8", errors="replace")
                .strip()
            )
            found.setdefault(name, []).append(int(family.attrs["NUM"]))
    return found


def _members(named: dict[str, list[int]], tags: Ints) -> Groups:
    return {name: np.flatnonzero(np.isin(tags, numbers)) for name, numbers in named.items()}
