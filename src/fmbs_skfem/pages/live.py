"""A model that runs in a page: its module of WebAssembly, its sliders, and how bodies follow from its unknowns.

Points of bodies and places of joints are linear in the unknowns x of a reduced model, so that a page needs their positions at
x = 0 and at the unit vectors alone.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

import numpy as np

from ..core.storage.records import dataclass
from ..dynamics import Trajectory
from ..results import motion
from ..results.frames import Array, Frames
from .packing import Block


@dataclass(frozen=True)
class Slider:
    """A number that a reader of the page changes."""

    name: str
    unit: str
    low: float
    high: float
    value: float


@dataclass(frozen=True)
class LiveModel:
    """A model as it runs in a page."""

    module: bytes  #: WebAssembly, see `exports.wasm`
    step: float  #: [s]
    parameters: tuple[Slider, ...] = ()
    inputs: tuple[Slider, ...] = ()
    positions: Frames | None = field(default=None)  #: at x = 0, and at the unit vectors


def positions(trajectory: Trajectory) -> Frames:
    """Bodies and joints of a reduced system at x = 0 and at the unit vectors (1 + n instants)."""
    n = trajectory.system.size
    x, none = np.concatenate([np.zeros((1, n)), np.eye(n)]), np.zeros((n + 1, n))
    states = replace(
        trajectory.states,
        times=np.arange(n + 1.0),
        x=x,
        v=none,
        a=none,
        multipliers=np.zeros((n + 1, trajectory.multipliers.shape[1])),
        memory=None,
        work=None,
        events=(),
    )
    return motion.frames(states, None, ())


def linear(points: Array) -> Array:
    """Columns (i, 1 + n) of points (1 + n, ...) at x = 0 and the unit vectors."""
    flat = points.reshape(len(points), -1)
    return np.column_stack([flat[0], (flat[1:] - flat[0]).T])


def body_map(points: Array, middle: Array, reference: Array, modes: Array) -> Array:
    """Coordinates (12 + m, 1 + n) of a body, an affine motion of its reference (x, 3) and its modes (m, x, 3), by least squares."""
    columns = linear(points)
    columns[:, 0] -= np.tile(middle, len(reference))
    corner = np.column_stack([np.ones(len(reference)), reference])
    affine = np.einsum("xk,cd->xcdk", corner, np.eye(3)).reshape(3 * len(reference), 12)
    basis = np.concatenate([affine, modes.astype(float).reshape(len(modes), -1).T], axis=1)
    return np.asarray(np.linalg.lstsq(basis, columns, rcond=1e-12)[0])


def joint_map(points: Array, middle: Array) -> Array:
    """Places (3, 1 + n) of a joint."""
    columns = linear(points)
    columns[:, 0] -= middle
    return columns


def describe(model: LiveModel, bodies: list[Any], joints: list[Any], block: Block) -> dict[str, Any]:
    """What the page needs to run it; `bodies` and `joints` are maps of the first film."""

    def sliders(listed: tuple[Slider, ...]) -> list[Mapping[str, Any]]:
        return [{"name": one.name, "unit": one.unit, "low": one.low, "high": one.high, "value": one.value} for one in listed]

    return {
        "film": 0,
        "stepSize": model.step,
        "parameters": sliders(model.parameters),
        "inputs": sliders(model.inputs),
        "bodies": [block.put(one) for one in bodies],
        "joints": [block.put(one) for one in joints],
        "unknowns": 0 if model.positions is None else len(model.positions.times) - 1,
        "module": base64.b64encode(zlib.compress(model.module, 9)).decode("ascii"),
    }
