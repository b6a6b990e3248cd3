r"""Plates: meshes of cases, free plates in motion, manufactured solutions for the membrane and the
shell law.

Manufactured: r* = X + d g(X) g(Y), g = sin^2(pi x) e^x, solves the equations of a clamped unit
square under the dead force

    f_b = int n1* . N_b,1 + n2* . N_b,2 dA,   n1* = P1 - P11,1 - P12,2/2,   n2* = P2 - P22,2 - P12,1/2,   P = dW/d(r,1 ... r,12)

(derivatives of P by Chebyshev interpolation). ||r_h - r*|| ~ h^(p + 1), with bending h^min(p + 1, 2
p - 2) (Strang and Fix, An Analysis of the Finite Element Method, 1973), and h^2 for ANCF plates,
whose slopes agree at nodes only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.polynomial import chebyshev

from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.bodies.plate import local_table, plate
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    energies,
    integrate,
    outputs,
    solve_statics,
)
from fmbs_skfem.shapes import ancf_plate, fvs_plate, nurbs, skfem_surface
from fmbs_skfem.shapes import surface as surfaces
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import At, Motion, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.measures import probes

from .beams import TIGHT, law_stress
from .dynamics import center_of, momenta
from .registry import CheckedNumber, case, farthest, order, refined

KINDS = ("ancf", "nurbs", "bfs", "argyris")
ALL = ("left", "right", "bottom", "top")
SIDES = {"left": "xi1_min", "right": "xi1_max", "bottom": "xi2_min", "top": "xi2_max"}
CORNERS = {"a": "corner_00", "b": "corner_10", "c": "corner_11", "d": "corner_01"}
Groups = dict[str, np.ndarray]


def grid(
    n1: int, n2: int, length: float, width: float
) -> tuple[np.ndarray, np.ndarray, Groups, Groups]:
    """Points (k, 2), quads (e, 4), edge groups (i, 2) and corner groups (1,) of a rectangle."""
    points = np.stack(
        np.meshgrid(np.linspace(0, length, n1 + 1), np.linspace(0, width, n2 + 1), indexing="ij"),
        -1,
    )
    ids = np.arange((n1 + 1) * (n2 + 1)).reshape(n1 + 1, n2 + 1)
    quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], -1).reshape(-1, 4)
    rows = {"left": ids[0], "right": ids[-1], "bottom": ids[:, 0], "top": ids[:, -1]}
    corners = {"a": ids[0, 0], "b": ids[-1, 0], "c": ids[-1, -1], "d": ids[0, -1]}
    edges = {name: np.column_stack([row[:-1], row[1:]]) for name, row in rows.items()}
    return (
        points.reshape(-1, 2),
        quads,
        edges,
        {name: np.array([corner]) for name, corner in corners.items()},
    )


def rectangle(
    kind: str, n1: int, n2: int, length: float = 1.0, width: float = 1.0, skew: float = 0.0
) -> Surface:
    """A rectangle with edges `left`, `right`, `bottom`, `top` and corners `a` to `d`; `skew` moves
    inner nodes at random.
    """
    points, quads, edges, corners = grid(n1, n2, length, width)
    rng = np.random.default_rng(7)
    if kind == "nurbs":
        patch, control = nurbs.rectangle(length, width, n1, n2, origin=(0.0, 0.0))
        control[2:-2, 2:-2] += skew * length / n1 * rng.uniform(-1, 1, control[2:-2, 2:-2].shape)
        shape = nurbs.surface(patch, control)
        edges = {name: shape.edges[side] for name, side in SIDES.items()}
        return replace(
            shape,
            edges=edges,
            points={name: shape.points[corner] for name, corner in CORNERS.items()},
        )
    inside = np.setdiff1d(
        np.arange(len(points)), np.concatenate([pairs.ravel() for pairs in edges.values()])
    )
    points[inside] += skew * length / n1 * rng.uniform(-1, 1, (len(inside), 2))
    if kind in ("ancf", "fvs"):
        return {"ancf": ancf_plate, "fvs": fvs_plate}[kind].surface(
            points, quads, (), corners, edges
        )
    if kind == "bfs":
        return skfem_surface.bfs(points, quads, corners, edges)
    return skfem_surface.argyris(
        points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), corners, edges
    )


# ------------------------------------------------------------------------------------------------ manufactured solutions
FINE = 7  #: Gauss points a direction of the manufactured load
DEGREE = 28  #: of the Chebyshev interpolation
SHIFT = {2: (0.02, -0.015), 3: (0.003, -0.002, 0.04)}  #: d [m] of the membrane and of the shell
THICKNESS = 0.05  #: [m]
MATERIAL = Material(1e3, 1.0, 0.3)


def hump(x: np.ndarray) -> np.ndarray:
    """g = sin^2(pi x) e^x with g' and g'', (3, ...)."""
    a, square, double, level = (
        np.exp(x),
        np.sin(np.pi * x) ** 2,
        np.sin(2 * np.pi * x),
        np.cos(2 * np.pi * x),
    )
    return np.asarray(
        a
        * np.stack(
            [square, square + np.pi * double, square + 2 * np.pi * double + 2 * np.pi**2 * level]
        )
    )


def pushed(x: np.ndarray, dim: int) -> np.ndarray:
    """r* and its derivatives 1, 2, 11, 22, 12 (6, dim, ...) at reference points x (2, ...)."""
    g, h = hump(x[0]), hump(x[1])
    field = np.stack([g[0] * h[0], g[1] * h[0], g[0] * h[1], g[2] * h[0], g[0] * h[2], g[1] * h[1]])
    found = field[:, None] * np.reshape(SHIFT[dim], (dim, *[1] * (x.ndim - 1)))
    found[0, :2] += x
    found[1, 0] += 1.0
    found[2, 1] += 1.0
    return np.asarray(found)


def forces_of(x: np.ndarray, dim: int, section: np.ndarray) -> np.ndarray:
    """n1*, n2* (2, dim, ...) of `pushed` at x (2, ...); `section` (i,) of the flat plate without
    its weight.
    """
    law = Law.MEMBRANE if dim == 2 else Law.SHELL
    vectors = law.vectors

    def stress(at: np.ndarray) -> np.ndarray:
        flat = at.reshape(2, 1, -1)
        gradients = pushed(flat, dim)[1 : 1 + vectors].reshape(vectors * dim, *flat.shape[1:])
        rows = np.broadcast_to(
            np.append(section, 1.0)[:, None, None], (len(section) + 1, *flat.shape[1:])
        )
        return law_stress(law, gradients, rows).reshape(vectors, dim, *at.shape[1:])

    found = stress(x)[:2]
    if dim == 2:
        return found
    nodes = chebyshev.chebpts1(DEGREE + 1)
    inverse = np.linalg.inv(chebyshev.chebvander(nodes, DEGREE))
    grid_points = 0.5 * (np.stack(np.meshgrid(nodes, nodes, indexing="ij")) + 1.0)
    c11, c22, c12 = (
        np.einsum("ai,bj,cij->abc", inverse, inverse, P) for P in stress(grid_points)[2:]
    )

    def slope(coefficients: np.ndarray, axis: int) -> np.ndarray:
        s, t = 2 * x - 1
        return np.asarray(chebyshev.chebval2d(s, t, 2 * chebyshev.chebder(coefficients, axis=axis)))

    return np.stack(
        [
            found[0] - slope(c11, 0) - 0.5 * slope(c12, 1),
            found[1] - slope(c22, 1) - 0.5 * slope(c12, 0),
        ]
    )


def manufactured(kind: str, cells: int, dim: int) -> float:
    """Error of the clamped square under the load of `pushed`: the mean-square distance from r* [m]."""
    shape = rectangle(kind, cells, cells)
    part = plate("plate", shape, THICKNESS, MATERIAL, dim=dim)
    assert part.cells is not None
    table = surfaces.tabulate(shape, FINE)
    local, area, _ = local_table(table.values, table.weights, part.reference[shape.nodes])
    x = np.einsum("epb,ebc->cep", table.values[:, :, 0], part.reference[shape.nodes])[:2]
    force = forces_of(x, dim, part.cells.section[:-1, 0, 0])
    load = np.zeros_like(part.reference)
    np.add.at(
        load,
        shape.nodes,
        np.einsum("ep,kcep,epkb->ebc", area, force, local[:, :, :2], optimize=True),
    )
    system = assemble(
        [part], [joints.Edge(side, "plate", (side,), slope="z" if dim == 3 else "") for side in ALL]
    )
    system = eliminate(replace(system, loads=replace(system.loads, constant=load.ravel())))
    found = system.lift(solve_statics(system, 4, TIGHT).x[-1]).reshape(-1, dim)[shape.nodes]
    gap = np.einsum("epb,ebc->cep", table.values[:, :, 0], found) - pushed(x, dim)[0]
    return float(np.sqrt((area * (gap**2).sum(axis=0)).sum()))


ORDERS = {  # kind: cells of the two meshes, orders with the membrane law (dimension 2) and with the shell law
    "ancf": ((10, 20), {2: 4, 3: 2}),
    "nurbs": ((10, 20), {2: 4, 3: 4}),
    "bfs": ((6, 12), {2: 4, 3: 4}),
    "argyris": ((3, 6), {2: 6, 3: 6}),
}
STRANG = (
    "r* chosen; Strang and Fix (1973), ISBN 978-0961408886; ANCF: 2, slopes agree at nodes only"
)


def plate_orders(dim: int) -> list[CheckedNumber]:
    """Observed order of every interpolation."""
    return [
        refined(kind, meshes, partial(manufactured, kind, dim=dim), of[dim], 0.1)
        for kind, (meshes, of) in ORDERS.items()
    ]


MANUFACTURED_CASES = {
    "manufactured-membrane": (
        2,
        "A clamped square deformed in its plane into a given shape, membrane law.",
    ),
    "manufactured-shell": (
        3,
        "A clamped square deformed in space into a given shape, Kirchhoff-Love shell law.",
    ),
}
for name, (dim, about) in MANUFACTURED_CASES.items():
    case(name, group="manufactured", source=STRANG, about=about)(partial(plate_orders, dim))


# ------------------------------------------------------------------------------------------------------------ free plate
PLATE = {  # t: corners (0, 0), (1, 0), (1, 1) and the centre
    0.1: (
        (0.20052173, -0.12466972, 0.061024663),
        (1.1296545, 0.18455766, -0.15781121),
        (0.85254129, 1.1109963, 0.1099047),
    ),
    0.3: (
        (0.6371613, -0.19456573, -0.092908884),
        (1.239753, 0.59805198, -0.15779223),
        (0.46763659, 1.1978335, 0.041496134),
    ),
    0.6: (
        (1.2447843, 0.18702916, -0.023937842),
        (0.90872907, 1.0967115, -0.24271978),
        (0.03027645, 0.84502258, 0.14945598),
    ),
}


def thrown_plate(kind: str, cells: int) -> tuple[System, Body]:
    """Square of 1 m, t = 0.01, E = 1e7, rho = 1000; velocity om x (xc, yc, 0) + (0.2, 0, 4 xc yc),
    om = (1, 0.5, 3).
    """
    shape = rectangle(kind, cells, cells)
    part = plate("plate", shape, 0.01, Material(1e7, 1000.0, 0.3))
    table = surfaces.tabulate(shape, 6)
    rows = surfaces.sample(
        shape,
        np.repeat(np.arange(len(shape.nodes)), table.points.shape[1]),
        table.points.reshape(-1, 2),
    )
    arm = np.column_stack([rows @ part.reference[:, :2] - 0.5, np.zeros(rows.shape[0])])
    field = np.cross([1.0, 0.5, 3.0], arm)
    field[:, 0] += 0.2
    field[:, 2] += 4 * arm[:, 0] * arm[:, 1]
    v0 = np.linalg.lstsq(rows.toarray(), field, rcond=1e-12)[0]
    system = assemble([part], outputs={name: probes.Position(At("plate", name)) for name in "abc"})
    return replace(system, v0=v0.ravel()), part


@case(
    "flying-plate",
    group="dynamics",
    source="Exact invariants; positions by an independent Kirchhoff-Love solver (recomputed, to 1 cm)",
)
def flying_plate() -> list[CheckedNumber]:
    """A free square plate thrown with spin and twist: momenta, centre, energy, corners over 0.6 s."""
    system, part = thrown_plate("nurbs", 6)
    h = 5e-4
    motion = integrate(system, GeneralizedAlpha(h), 0.6, Newton(tolerance=1e-11))
    linear, spin = momenta(motion, part)
    total, columns, at = energies(motion), outputs(motion), [round(t / h) for t in PLATE]
    corners = np.stack(
        [np.column_stack([columns[f"{name}_{axis}"][at] for axis in "xyz"]) for name in "abc"],
        axis=1,
    )
    centre = center_of(motion, part)
    path = np.column_stack(
        [0.5 + 0.2 * motion.times, np.full(len(centre), 0.5), np.zeros(len(centre))]
    )
    return [
        CheckedNumber(
            "kinetic energy at the start", 8.776388888889, float(total[0, 0]), 1e-10, "J"
        ),
        farthest("linear momentum", [2.0, 0.0, 0.0], linear, 1e-10, "N s"),
        farthest("angular momentum", [5 / 6, 5 / 12, 4.0], spin, 1e-5, "N m s"),
        farthest("energy", 8.776388888889, total[:, 3], 1e-3, "J"),
        farthest("centre of mass", path, centre, 1e-8, "m"),
        farthest("corners", list(PLATE.values()), corners, 5e-3, "m"),
    ]


@case(
    "spinning-plate",
    group="dynamics",
    source="Conservation of momentum, angular momentum and energy",
)
def spinning_plate() -> list[CheckedNumber]:
    """A free plate with 20 rad/s about its normal and 8 rad/s across, 3.4 turns, without numerical
    damping; ANCF and NURBS.
    """
    found: list[CheckedNumber] = []
    for kind in ("ancf", "nurbs"):
        part = plate("plate", rectangle(kind, 3, 3, 1.0, 0.5), 0.02, Material(2e9, 1000.0, 0.3))
        system = assemble([part], initial={"plate": Motion((1.0, -2.0, 0.5), (8.0, 1.0, 20.0))})
        steps = (1e-3, 5e-4)
        motions = [
            integrate(system, GeneralizedAlpha(h, 1.0), 1.0, Newton(tolerance=1e-12)) for h in steps
        ]
        linear, spin = momenta(motions[1], part)
        kept: tuple[tuple[str, Callable[[Trajectory], np.ndarray]], ...] = (
            ("angular momentum", lambda motion, part=part: momenta(motion, part)[1]),  # type: ignore[misc]
            ("energy", lambda motion: energies(motion)[:, 3:]),
        )
        found.append(farthest(f"linear momentum, {kind}", linear[0], linear, 1e-12, "N s"))
        found.append(farthest(f"angular momentum, {kind}", spin[0], spin, 5e-5, "N m s"))
        for name, value in kept:
            drifts = [float(np.abs(values - values[0]).max()) for values in map(value, motions)]
            found.append(order(f"order of {name}, {kind}", steps, drifts, 2.0, 0.05))
    return found
