"""Sides of NURBS patches that lie on one another with other functions, in part, or with a gap: they
move as one line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Material
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice, Remark
from fmbs_skfem.dynamics import solve_statics
from fmbs_skfem.shapes import nurbs, surface
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.system import System

from .test_plate import turn

Patches = Mapping[str, tuple[nurbs.Patch, np.ndarray]]
MATERIAL = Material(young_modulus=7e10, density=2700.0, poisson_ratio=0.3)
T = 0.01
D = 7e10 * T**3 / 12.0 / 0.91
#: deflection of a hinged unit square under 1 Pa, Timoshenko and Woinowsky-Krieger, table 8
NAVIER = 0.00406235266 / D


def part(
    x: float, y: float, length: float, width: float, cells1: int, cells2: int
) -> tuple[nurbs.Patch, np.ndarray]:
    return nurbs.rectangle(length, width, cells1, cells2, 3, origin=(x, y, 0.0))


def weighted(x: float, length: float, cells: int) -> tuple[nurbs.Patch, np.ndarray]:
    """A rectangle of height 1 whose weights change along y, which moves the points of its straight
    sides.
    """
    patch, control = nurbs.rectangle(length, 1.0, 1, 1, 2, origin=(x, 0.0, 0.0))
    return nurbs.refine(
        replace(patch, weights=np.ones((3, 3)) * [1.0, 1.3, 2.0]), control, cells, 2 * cells, 3
    )


LEFT = part(0.0, 0.0, 0.5, 1.0, 4, 8)
UNIT_SQUARES: dict[str, Patches] = {
    "other knots": {"A": LEFT, "B": part(0.5, 0.0, 0.5, 1.0, 4, 7)},
    "one against two": {
        "A": LEFT,
        "B": part(0.5, 0.0, 0.5, 0.43, 4, 4),
        "C": part(0.5, 0.43, 0.5, 0.57, 4, 5),
    },
    "halves of edges": {
        "A": part(0.0, 0.0, 0.5, 0.63, 4, 5),
        "D": part(0.0, 0.63, 0.5, 0.37, 4, 4),
        "B": part(0.5, 0.0, 0.5, 0.43, 4, 4),
        "C": part(0.5, 0.43, 0.5, 0.57, 4, 5),
    },
    "other weights": {"A": LEFT, "B": weighted(0.5, 0.5, 4)},
    "a gap": {"A": LEFT, "B": part(0.5 + 1e-6, 0.0, 0.5 - 1e-6, 1.0, 4, 8)},
    "a gap, other knots": {"A": LEFT, "B": part(0.5 + 1e-6, 2e-6, 0.5 - 1e-6, 1.0, 4, 7)},
}


def shape_of(patches: Patches, **options: bool) -> Surface:
    return nurbs.surface(
        {name: patch for name, (patch, _) in patches.items()},
        {name: x for name, (_, x) in patches.items()},
        **options,
    )


def border(shape: Surface) -> tuple[str, ...]:
    """Sides of patches that are on the border of the unit square."""
    found = []
    for name, rows in shape.edges.items():
        cell, side = rows.T
        middle = (
            surface.sample(
                shape, cell, surface.side_points(shape.parent, side, np.full(len(side), 0.5))
            )
            @ shape.reference
        )
        if (np.abs(middle[:, :2] - 0.5).max(axis=1) > 0.499).all():
            found.append(name)
    return tuple(found)


def deflection(shape: Surface) -> float:
    """Of the middle of a hinged unit square under 1 Pa [m]."""
    body = plate("s", shape, T, MATERIAL)
    held, pull = (
        joints.Edge("e", "s", border(shape), "xyz", ""),
        loads.SurfaceLoad("q", "s", (0.0, 0.0, -1.0)),
    )
    system = eliminate(assemble([body], [held], [pull]))
    moved = coordinates(system, solve_statics(system, 1).x[-1])
    if body.spread is not None:
        moved = body.spread @ moved
    where = nurbs.place(
        shape, 1.0, 0.5 / float(shape.reference[shape.space.numbers["A"]][..., 1].max()), "A"
    )
    return -float((surface.sample(shape, np.array(where[:1]), np.array([where[1:]])) @ moved)[0, 2])


def coordinates(system: System, x: np.ndarray) -> np.ndarray:
    return np.asarray(system.lift.matrix @ x + system.lift.offset).reshape(-1, system.dim)


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Remark")
@pytest.mark.parametrize("kind", UNIT_SQUARES)
def test_a_plate_of_patches_bends_as_one(kind: str) -> None:
    """Navier's solution to 4e-4, as of patches with the same functions; sides that were left apart
    bent 1.75 times as much.
    """
    assert_allclose(deflection(shape_of(UNIT_SQUARES[kind])), NAVIER, rtol=4e-4)


@pytest.mark.parametrize(
    "kind", ["other knots", "one against two", "halves of edges", "other weights"]
)
def test_a_seam_passes_a_constant_stress_on(kind: str) -> None:
    """A plane square pulled along x and y: displacements are linear (integrals of rational
    functions to 3e-6).
    """
    patches = {
        name: (patch, control[..., :2]) for name, (patch, control) in UNIT_SQUARES[kind].items()
    }
    shape = shape_of(patches)
    body = plate("s", shape, T, MATERIAL, dim=2)
    assert body.spread is not None
    left = [name for name in border(shape) if name.endswith("xi1_min")]
    low = [name for name in border(shape) if name.endswith("xi2_min")]
    held = [
        joints.Edge("left", "s", tuple(left), "x", ""),
        joints.Edge("low", "s", tuple(low), "y", ""),
    ]
    right = tuple(name for name in border(shape) if name.endswith("xi1_max"))
    system = eliminate(assemble([body], held, [loads.EdgeLoad("f", "s", right, (100.0, 0.0))]))
    moved = coordinates(system, solve_statics(system, 1).x[-1]) - body.reference
    strain = 100.0 / (MATERIAL.young_modulus * T)
    linear = strain * body.reference * [1.0, -0.3]
    assert_allclose(moved, linear, rtol=0.0, atol=1e-5 * strain)


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Remark")
@pytest.mark.parametrize("kind", UNIT_SQUARES)
def test_rigid_motions_cost_nothing(kind: str) -> None:
    """The springs against folding, of the body turned and moved, beside those of a fold of 0.001
    about the seam.
    """
    body = plate("s", shape_of(UNIT_SQUARES[kind]), T, MATERIAL)
    assert body.stiffness is not None
    fold = body.reference + 1e-3 * np.outer(
        np.abs(body.reference[:, 0] - 0.5 * body.constant), [0.0, 0.0, 1.0]
    )
    moved = body.reference @ turn(3) + np.outer(body.constant, [3.0, 1.0, -2.0])
    forces = [np.abs(body.stiffness @ q).max() for q in (fold, body.reference, moved)]
    assert max(forces[1:]) < 1e-9 * forces[0]


RADIUS, LENGTH, WALL = 0.05, 0.4, 0.001


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Remark")
@pytest.mark.parametrize("gap", [0.0, 1e-6])
def test_a_tube_of_panels_twists_as_one(gap: float) -> None:
    """Bredt's twist of a closed tube, less (t/R)^2/3 for its wall; left apart, panels twist 3.5
    times as far and more.
    """
    angle = 2.0 * np.pi / 3.0
    panels = {
        f"p{k}": nurbs.cylinder_panel(RADIUS, LENGTH, k * angle, (k + 1) * angle, 4, 4 + k)
        for k in range(3)
    }
    panels["p1"] = panels["p1"][0], panels["p1"][1] + gap * np.array([0.3, 0.2, 0.1])
    shape = shape_of(panels)
    rims = {
        end: Rim(tuple(f"{name}.xi2_{end}" for name in panels), slopes=False)
        for end in ("min", "max")
    }
    body = plate("s", shape, WALL, MATERIAL, rims=rims)
    parts = [joints.Weld("w", At("s", "min"))], [loads.Torque("T", At("s", "max"), (0.0, 1.0, 0.0))]
    system = eliminate(assemble([body], *parts))
    x = coordinates(system, solve_statics(system, 1).x[-1])[body.frames["max"] + 1]
    G, J = MATERIAL.young_modulus / 2.6, 2.0 * np.pi * RADIUS**3 * WALL
    exact = LENGTH / (G * J) * (1.0 - (WALL / RADIUS) ** 2 / 3.0)
    assert_allclose(abs(np.arctan2(x[2], x[0])), exact, rtol=1e-5)


def test_gaps_are_told() -> None:
    with pytest.warns(
        Remark,
        match=r"'A\.xi1_max' and 'B\.xi1_min' of NURBS patches are 1e-06 m apart and were joined",
    ):
        shape_of(UNIT_SQUARES["a gap"])
    wide = {"A": LEFT, "B": part(0.50005, 0.0, 0.5, 1.0, 4, 8)}
    with pytest.warns(
        Notice, match=r"run 5e-05 m apart and are not joined; close the gap, or say 'join: false'"
    ):
        apart = shape_of(wide)
    with pytest.raises(
        InputError,
        match=r"body 's': expected one piece, got 2 parts: 32 cells \(A\); 32 cells \(B\); close the gaps",
    ):
        plate("s", apart, T, MATERIAL)


def test_patches_in_two_pieces() -> None:
    """Refused, but for those that a rim holds together and those that were asked for."""
    far = {"A": LEFT, "B": part(0.6, 0.0, 0.5, 1.0, 4, 8)}
    with pytest.raises(InputError, match="expected one piece"):
        plate("s", shape_of(far), T, MATERIAL)
    plate(
        "s", shape_of(far), T, MATERIAL, rims={"hub": Rim(("A.xi1_max", "B.xi1_min"), slopes=True)}
    )
    plate("s", shape_of(far, join=False), T, MATERIAL)


def test_sides_of_a_seam_are_no_edges() -> None:
    shape = shape_of(UNIT_SQUARES["one against two"])
    held = joints.Edge("e", "s", ("C.xi1_min",))
    with pytest.raises(
        InputError, match=r"expected an edge, got 'C\.xi1_min', which is joined to 'A\.xi1_max'"
    ):
        assemble([plate("s", shape, T, MATERIAL)], [held])
