"""3dm files of Rhino through rhino3dm (the extra `cad`): surfaces that are not trimmed, in the unit
of the file.

Meshes, subdivision surfaces, closed extrusions and blocks are refused; curves, points, texts and
lights are passed over.
"""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError, MissingFeature, say

#: names of openNURBS' units -> length [m]
_UNITS = {
    "Nanometers": 1e-9, "Microns": 1e-6, "Millimeters": 1e-3, "Centimeters": 1e-2, "Decimeters": 0.1, "Meters": 1.0,
    "Dekameters": 10.0, "Hectometers": 100.0, "Kilometers": 1e3, "Microinches": 2.54e-8, "Mils": 2.54e-5, "Inches": 0.0254,
    "Feet": 0.3048, "Yards": 0.9144, "Miles": 1609.344,
}  # fmt: skip
_REMEDY = "export untrimmed NURBS surfaces"


def read(path: Path, target: Path, where: str) -> None:
    """Write the surfaces as JSON, see `nurbs_file`."""
    try:
        package = importlib.import_module("rhino3dm")
    except ImportError as error:
        remedy = "install the extra fmbs_skfem[cad]"
        raise MissingFeature(
            say(where, "the package rhino3dm to read .3dm", error, remedy)
        ) from error
    model = package.File3dm.Read(str(path))
    if model is None:
        raise InputError(say(where, "a 3dm file", "something else", "save the model again"))
    unit = model.Settings.ModelUnitSystem.name
    if unit not in (*_UNITS, "None", "Unset"):
        raise InputError(
            say(where, "a usual unit of length", unit, "save the model in millimetres")
        )
    found = [
        _surface(package, f"{where}: object {i + 1}", item) for i, item in enumerate(model.Objects)
    ]
    patches = [patch for patch in found if patch is not None]
    target.write_text(json.dumps({"unit": _UNITS.get(unit), "patches": patches}), encoding="utf-8")


def _surface(package: Any, where: str, item: Any) -> dict[str, Any] | None:
    """The patch of an object, or nothing where it is no surface."""
    geometry = item.Geometry
    if isinstance(geometry, package.Brep):
        if not geometry.IsSurface:
            got = f"{len(geometry.Faces)} faces, or trims"
            remedy = "explode it and untrim its faces"
            raise InputError(say(where, "a single untrimmed surface", got, remedy))
        geometry = geometry.Faces[0].UnderlyingSurface()
    capped = isinstance(geometry, package.Extrusion) and geometry.CapCount > 0
    if capped or isinstance(geometry, package.Mesh | package.SubD | package.InstanceReference):
        raise InputError(
            say(
                where,
                "a NURBS surface",
                f"a {type(geometry).__name__}{' with caps' if capped else ''}",
                _REMEDY,
            )
        )
    return _patch(geometry.ToNurbsSurface()) if isinstance(geometry, package.Surface) else None


def _patch(found: Any) -> dict[str, Any]:
    """An openNURBS surface: its knot vectors leave out the first and the last knot, its points are
    (w x, w y, w z, w).
    """
    knots = [np.array(list(vector), dtype=float) for vector in (found.KnotsU, found.KnotsV)]
    points = [
        [found.Points.GetControlPoint(i, j) for j in range(found.Points.CountV)]
        for i in range(found.Points.CountU)
    ]
    homogeneous = np.array([[(p.X, p.Y, p.Z, p.W) for p in row] for row in points])
    weights = homogeneous[..., 3]
    item = {
        "degree": [found.Degree(0), found.Degree(1)],
        "knots": [np.concatenate([k[:1], k, k[-1:]]).tolist() for k in knots],
        "control": (homogeneous[..., :3] / weights[..., None]).tolist(),
    }
    return {**item, "weights": weights.tolist()} if found.IsRational else item
