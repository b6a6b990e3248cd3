"""Rigid bodies, a beam and a plate with a rim in one place, and joints of every type with axes
between them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fmbs_skfem.bodies import Body, Given, Material, cable
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.shapes import ancf_plate
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import At
from fmbs_skfem.systems.connections import joints

from ..models import segment
from .parts import swing

A0, A1, B1, B2, BEAM, RIM = (
    At("a", "O"),
    At("a", "P"),
    At("b", "P"),
    At("b", "Q"),
    At("beam", "left"),
    At("plate", "rim"),
)
OTHER = At("lid", "rim")
SPATIAL_AXIS = (0.0, 0.6, 0.8)


def grid(
    nx: int,
    ny: int,
    width: float = 1.0,
    height: float = 1.0,
    skew: float = 0.0,
    make: Callable[..., Surface] = ancf_plate.surface,
) -> Surface:
    """Plate on nx x ny quads from (0, 0), ANCF by default, with the four edges and the points
    `corner` (1, 1) and `middle`.
    """
    x, y = np.meshgrid(np.linspace(0, width, nx + 1), np.linspace(0, height, ny + 1), indexing="ij")
    points = np.column_stack([(x + skew * y).ravel(), y.ravel()])
    n = np.arange(points.shape[0]).reshape(nx + 1, ny + 1)
    quads = np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], axis=-1).reshape(-1, 4)
    edges = {"left": n[0], "right": n[-1], "bottom": n[:, 0], "top": n[:, -1]}
    pairs = {name: np.stack([ids[:-1], ids[1:]], axis=1) for name, ids in edges.items()}
    named = {"corner": [n[-1, -1]], "middle": [n[nx // 2, ny // 2]]}
    return make(points, quads, point_groups=named, edge_groups=pairs, face_groups={"first": [0]})


def bodies(dim: int) -> list[Body]:
    """a at (0.5, 0), b at (1, 0.5), both turned, a beam from (1, 0), two plates on [1, 2] x [0, 1]
    whose left edges are rigid.
    """
    rest = (0.0,) * (dim - 2)
    turn = np.eye(dim)
    turn[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]

    def part(name: str, center: Sequence[float], **places: Sequence[float]) -> Body:
        named = {key: (*at, *rest) for key, at in places.items()}
        inertia = 0.3 if dim == 2 else np.array([0.2, 0.25, 0.3])
        return rigid(name, 1.5, inertia, (*center, *rest), dim=dim, rotation=turn, places=named)

    beam = cable(
        "beam", segment(3, (1, 0, 0), (1.8, 0.6, 0)), Given(EA=2000.0, EI=3.0, rhoA=0.5), dim=dim
    )
    shape, rims = grid(2, 2), {"rim": Rim(("left",), (1.0, 0.0, 0.0)[:dim])}
    origin = np.array([1.0, 0.0, 0.0][:dim])
    sheets = [
        plate(name, shape, 0.02, Material(1e5, 500.0), dim=dim, rims=rims, origin=origin)
        for name in ("plate", "lid")
    ]
    return [
        part("a", (0.5, 0.0), O=(0, 0), P=(1, 0)),
        part("b", (1.0, 0.5), P=(1, 0), Q=(1, 1)),
        beam,
        *sheets,
    ]


def every_joint(dim: int) -> list[joints.Joint]:
    """Joints with axes of every type and kind of end, all satisfied in the reference."""
    axis = {} if dim == 2 else {"axis": SPATIAL_AXIS}
    normal = {} if dim == 2 else {"axis": (0.0, 0.0, 1.0)}
    along = (1.0, 2.0, -0.5)[:dim]
    both: list[joints.Joint] = [
        joints.Revolute("hinge to ground", A0, **axis),
        joints.Revolute("hinge at a point", A1, (1.0, 0.0, 0.0)[:dim], **axis),
        joints.Revolute("hinge of bodies", A1, B1, **axis),
        joints.Revolute("hinge of a beam", BEAM, A1, **normal),
        joints.Revolute("hinge of a rim", A1, RIM, **axis),
        joints.Weld("weld of bodies", A1, B1),
        joints.Weld("weld to ground", B2),
        joints.Weld("weld of a rim", RIM, A1),
        joints.Weld("weld of a beam", A1, BEAM),
        joints.Weld("weld of a beam and a rim", BEAM, RIM),
        joints.Weld("weld of a beam to ground", BEAM),
        joints.Weld("weld of a rim to ground", RIM),
        joints.Weld("weld of rims", RIM, OTHER),
        joints.Prismatic("prismatic", B2, along),
        joints.Prismatic("prismatic of bodies", B2, along, A0),
        joints.Prismatic("prismatic of a rim", RIM, along),
        joints.Slider("slider on a body", B2, along, A0),
        joints.Slider("slider of a rim", RIM, along),
        joints.DrivenAngle("driven rim", RIM, swing, **axis),
        joints.DrivenAngle("driven angle of bodies", B1, swing, **axis, to=A1),
        joints.DrivenPosition("driven rim position", RIM, (swing,) * dim),
        joints.Gear("gear", A1, B1, (12, 30), **axis),
        joints.Gear("gear with inside teeth", A1, RIM, (3, -7), **axis),
        joints.Edge("edge", "plate", ("right", "top")),
        joints.Edge("edge with slopes", "plate", ("right",), "x", "xy"),
        joints.RimNodes("rim nodes", "plate", ("right", "top"), (1.2, 0.3, 0.0)[:dim]),
        joints.RimNodes("rim nodes about a body", "plate", ("right",), A1),
    ]
    if dim == 2:
        return [*both, joints.Gear("planetary gear", A1, B1, (12, 30), RIM)]
    return [
        *both,
        joints.Revolute("hinge along a beam", BEAM, A1, (0.8, 0.6, 0.0)),
        joints.Universal("universal", A1, (0, 0, 1), (1, 1, 0), B1),
        joints.Universal("universal to ground", A1, (0, 0, 1), (1, 1, 0)),
        joints.Cylindrical("cylindrical", B2, SPATIAL_AXIS),
        joints.Cylindrical("cylindrical of bodies", B2, SPATIAL_AXIS, A1),
    ]
