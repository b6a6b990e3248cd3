r"""Bushings: springs and dampers along and about the axes of a frame that a body carries, whatever
it has turned.

    f_i = - k_i (p_i . d - u_i) - c_i (p_i . d)',        d = r_at - r_to,    u_i = p_i . d in the reference
    m_i = - kappa_i theta_i - gamma_i theta_i'

p_i are the axes as `to` carries them, theta_i the angle turned about p_i: arg(u . p_j, u . p_k) of
a vector u of `at` that was p_j. Rotations of `to` may have any size, and so may theta_l about the
axis with the least stiffness, beside small others: u of the others is p_l, which turns with none of
it. Forces act at `at`; forces and moments on both bodies are in balance, as those of a potential
are.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar

import numpy as np
from scipy.sparse import csr_array

from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values.fields import AXES
from ...core.values.problems import Problem
from .. import fields
from ..connections.constraint_functions import mark, rows_of, unit
from ..places import Draft, Gauge, Ground, vector
from . import responses
from .loads import TORSION, Load, where


@dataclass(frozen=True)
class Bushing(Load):
    """Stiffness and damping along and about axes that `to`, a frame or the ground, carries: by
    default those of the scene.

    What it does along and about its axes is an output `load` each, `load: mount.x` or
    `load: mount.about_z`. It rests in the reference. `x_axis` and, in space, a direction in the
    plane of x and y say other axes. `at` may turn against `to` by any angle about the axis with the
    least torsional stiffness (the last of equal ones), and little about the others.

    {type: bushing, at: engine.mount, stiffness: [100 kN/m, 100 kN/m, 200 kN/m]}
    """

    name: str
    at: fields.Place
    to: fields.Carrier = None
    stiffness: Annotated[Ground | None, fields.vector("N/m"), "along the axes"] = None
    damping: Annotated[Ground | None, fields.vector("N s/m"), "along the axes"] = None
    torsional_stiffness: Annotated[
        float | Ground | None, fields.spin("N m/rad"), "about the axes"
    ] = None
    torsional_damping: Annotated[
        float | Ground | None, fields.spin("N m s/rad"), "about the axes"
    ] = None
    x_axis: fields.Direction | None = None
    y_axis: fields.Direction | None = None
    resists: ClassVar[bool] = True
    strengths: ClassVar[tuple[str, ...]] = (
        "stiffness",
        "damping",
        "torsional_stiffness",
        "torsional_damping",
    )

    @property
    def rests(self) -> bool:
        return True

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        for key in ("stiffness", "damping", "torsional_stiffness", "torsional_damping"):
            if (
                min(
                    np.ravel(getattr(self, key)).tolist()
                    if getattr(self, key) is not None
                    else [0.0]
                )
                < 0.0
            ):
                yield key, Problem("numbers >= 0", str(getattr(self, key)))
        if self.y_axis is not None and (dim == 2 or self.x_axis is None):
            yield "y_axis", Problem("a y_axis beside an x_axis in space", "another scene")

    def push(self, draft: Draft) -> None:
        mark(self, draft, "bushing", self.at)
        dim = draft.layout.dim
        axes = frame(self, draft.layout.dim)
        for letter, axis, k, c in zip(
            AXES, axes, *(given(self, key, dim) for key in ("stiffness", "damping")), strict=False
        ):
            if k or c:
                draft.gauges[f"{self.name}.{letter}"] = slide(self, draft, axis, k, c)
        turned = [np.array([0.0, 0.0, 1.0])] if dim == 2 else list(axes)
        numbers = [
            given(self, key, len(turned)) for key in ("torsional_stiffness", "torsional_damping")
        ]
        free = min(range(len(turned)), key=lambda i: (*(each[i] for each in numbers), -i))
        for i, (axis, k, c) in enumerate(zip(turned, *numbers, strict=True)):
            if k or c:
                about, u = (
                    (None, None)
                    if dim == 2
                    else (tuple(axis), turned[free if i != free else free - 1])
                )
                gauge, coordinate = responses.angle_between(
                    draft, where(self), self.at, self.to, about, u
                )
                draft.forces.act(TORSION[coordinate], gauge.rows, (k, c, gauge.free))
                draft.gauges[f"{self.name}.about_{AXES[i + 3 - len(turned)]}"] = gauge


def given(load: Bushing, key: str, size: int) -> np.ndarray:
    """Numbers (size,) of a field, zeros where there are none."""
    value = getattr(load, key)
    return (
        np.zeros(size)
        if value is None
        else vector(f"{where(load)}.{key}", np.atleast_1d(value), size)
    )


def frame(load: Bushing, dim: int) -> np.ndarray:
    """The axes (dim, c) of a bushing in the reference: unit vectors, one a row."""
    x = unit(f"{where(load)}.x_axis", np.eye(dim)[0] if load.x_axis is None else load.x_axis, dim)
    if dim == 2:
        return np.array([x, [-x[1], x[0]]])
    given = vector(
        f"{where(load)}.y_axis",
        np.eye(3)[int(load.x_axis is None or abs(x[1]) < 0.9)]
        if load.y_axis is None
        else load.y_axis,
        3,
    )
    y = unit(f"{where(load)}.y_axis", given - x * float(x @ given), 3)
    return np.array([x, y, np.cross(x, y)])


def slide(load: Bushing, draft: Draft, axis: np.ndarray, k: float, c: float) -> Gauge:
    """Add the spring k [N/m] and damper c [N s/m] of a bushing along an axis (c,); what measures
    them.

    InputError where `to` does not carry all axes.
    """
    layout = draft.layout
    name = where(load)
    rows = layout.read(name, load.at)
    apart = layout.reference(name, load.at)
    if load.to is None:
        carried = csr_array(rows.shape)
        offset = axis
        away = -apart
    else:
        if len(layout.vectors(name, load.to)) < layout.dim:
            raise InputError(
                say(
                    name,
                    "a frame that carries the axes",
                    f"{load.to}",
                    "name a rigid frame, or the ground",
                )
            )
        carried = rows_of(name, layout, load.to, axis)
        offset = np.zeros(layout.dim)
        rows = rows - layout.read(name, load.to)
        apart = apart - layout.reference(name, load.to)
        away = np.zeros(layout.dim)
    first = [draft.probes.add(carried, offset), draft.probes.add(csr_array(rows), away)]
    free = 0.0 if load.to is None else float(axis @ apart)
    gauge = Gauge("slide", tuple(row + i for row in first for i in range(layout.dim)), free)
    draft.forces.act(f"slide_{layout.dim}", gauge.rows, (k, c, free))
    return gauge
