"""Parts: reduced bodies with the record of their training, as files that are used without mesh and full model.

    part = part_files.train(body, excite(body, Excitation()))        or the states of any runs
    part_files.save(part, "arm.part.h5")
    arm = parts.placed(part_files.load("arm.part.h5").body, "left arm", origin, rotation)

A file is a `core.container` of the body (shape functions at the weighted points and over the interpolation, places, mass, law,
section) and of notes on its training.
"""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..bodies.body import Body
from ..core import container, validation
from ..core.container import Kind
from ..core.validation import Misfit, require
from ..dynamics import departures
from . import parts

KIND = Kind("fmbs_skfem part", "a part", 1, "copy the file again, or train the part anew", "train and save the part anew")
USUAL = 1e-12  #: eps of the shape functions of a part
ETA = 1e-4  #: tolerance of its weighted points


@dataclass(frozen=True)
class Part:
    """A reduced body and what is known of its training."""

    body: Body
    notes: dict[str, Any] = field(default_factory=dict)


def train(
    body: Body, states: np.ndarray, tolerance: float = USUAL, modes: int | None = None, eta: float | None = ETA, /, **notes: Any
) -> Part:
    """The part of a full body from states (s, b, c) of any of its motions; without `eta` its energy is that of all points."""
    begun = clock.process_time()
    S = parts.shape_functions(body, states, tolerance, modes)
    z, found = parts.coordinates(body, S, states), parts.reduced_body(body, S)
    found = parts.ranged(found, z) if eta is None else parts.sampled(found, z, eta)
    assert found.shapes is not None
    low, high = found.shapes.trained
    names = departures.kinds_of(found.shapes)
    record = {
        "functions": S.shape[1],
        "functions_full": len(S),
        "points": found.shapes.table.shape[1],
        "points_full": parts.count_points(body),
        "tolerance": None if modes else tolerance,
        "hyper_tolerance": eta,
        "states": len(states),
        "strains": {name: [float(a), float(b)] for name, a, b in zip(names, low, high, strict=True)},
        "training_s": clock.process_time() - begun,
    }
    return Part(found, record | notes)


def save(part: Part, path: str | Path) -> Path:
    """Write a part; the file appears under its name when it is complete."""
    return container.write(path, KIND, bodies=(part.body,), notes=part.notes)


def load(path: str | Path) -> Part:
    """The part of a file; CorruptFile names what is wrong with one that is not as it was written."""
    content = container.read(path, KIND, bodies=tuple, notes=dict)
    with container.reading(Path(path), KIND):
        (body,) = content["bodies"]
        check(body)
    return Part(body, content["notes"])


def check(body: Body) -> None:
    """Refuse a body whose numbers do not fit each other."""
    validation.types(body, "body")
    points, functions = body.shapes, len(body.reference)
    if points is None or body.cells is None or body.spread is None:
        raise Misfit("body", "a reduced body", "a full one")
    dim = body.dim
    require(dim in (2, 3) and points.dim == dim, "body.reference", "vectors of two or three components", body.reference.shape)
    require(body.mass.shape == (functions, functions), "body.mass", f"an array ({functions}, {functions})", body.mass.shape)
    require(body.constant.shape == (functions,), "body.constant", f"an array ({functions},)", body.constant.shape)
    require(body.spread.shape[1] == functions, "body.spread", f"{functions} columns", body.spread.shape)
    require(points.table.shape[2] == functions, "body.shapes.table", f"{functions} functions", points.table.shape)
    count = int(getattr(body.space, "count", -1))
    require(count == body.spread.shape[0], "body.spread", f"{count} rows, as its interpolation has functions", body.spread.shape)
    validation.fit(points, "body.shapes", {"q": body.reference.size})
    validation.fit(body.cells, "body.cells", {"q": count * dim})
    rows = 0 if body.axes is None else body.axes.shape[0]
    require(rows == len(body.frames) * (1 + dim), "body.axes", f"{len(body.frames) * (1 + dim)} rows of frames", rows)
