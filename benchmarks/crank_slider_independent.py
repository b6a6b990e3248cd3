r"""Example 3, the crank-slider of thin plates, by a second solver that shares no code with
fmbs_skfem; ours beside it.

    python benchmarks/crank_slider_independent.py [--quick] [--json] [--write]

Plane stress, St. Venant-Kirchhoff, total Lagrangian, on isoparametric 9-node quads of scikit-fem
(nodes in the plane are numbers z = x + iy, the middle nodes of curved sides lie on the exact
circles):

    E = (F^T F - I)/2,   S = E_Y t/(1 - nu^2) [(1 - nu) E + nu tr(E) I],   f = int F S : dF,   z_rim = c + a (X - C),   |a| = 1

A rim follows its frame (c, a), two complex numbers, in positions; every node between them is free.
Frames are massless, the torque does the work M Im(conj(a) da), joints are linear rows on c, the
slider is 0.5 kg on the linkage's c_C. With m z'' + f = Q + G^T l

    generalized-alpha:  (1 - am) a1 + am a0 = (1 - af) z1'' + af z0''   (M. Arnold, O. Bruels, Multibody Syst. Dyn. 18, 2007,
    doi:10.1007/s11044-007-9084-0), Newton with one factorisation of bh m + K a body at the reference shape, turned with the body

and nine multipliers by a Schur complement on the eight numbers of each body's two frames. What is
varied beside it: mesh, step, rho_inf, plane strain, straight sides instead of arcs, rims that are
rigid only in the mean, a rigid layer of cells around the rims, rigid plates, and flanks that are
common tangents of the ends instead of joining their highest points: by that the crank gains 8.6e-4
of its area and 1.2e-6 kg m2 of its inertia about A.

Model: Y. Hou, C. Liu, H. Hu, doi:10.1016/j.cma.2019.112690, with the dimensions of
examples/crank_slider.yaml.
"""

from __future__ import annotations

import argparse
import json
import runpy
import shutil
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import block_diag, coo_array, csc_array, csr_array
from scipy.sparse.linalg import splu

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
SAMPLING = 2e-5  #: instants at which the largest speed is looked for [s]
PAIRS = ((0, 0), (1, 1), (0, 1))


# ------------------------------------------------------------------------------------------------------------------ model
@dataclass(frozen=True)
class End:
    """One end of a link: a hole in a circular end."""

    x: float  #: [m]
    outer: float  #: radius of the end [m]
    hole: float  #: radius of the hole [m]


@dataclass(frozen=True)
class Cuts:
    """Cells of half a ring up to the flank's cut, along the flank, around the end; across the ring;
    along the web.
    """

    row: int = 3
    flank: int = 3
    end: int = 5
    ring: int = 4
    web: int = 6

    def finer(self, factor: float) -> Cuts:
        return Cuts(
            *(
                max(1, round(factor * n))
                for n in (self.row, self.flank, self.end, self.ring, self.web)
            )
        )


@dataclass(frozen=True)
class Model:
    """Numbers of the scene, and what is varied."""

    young: float = 70e9  #: [Pa]
    poisson: float = 0.3
    density: float = 2700.0  #: [kg/m3]
    thickness: float = 0.01  #: [m]
    slider: float = 0.5  #: [kg]
    torque: float = 15.0  #: [N m]
    refinement: float = 1.0  #: of the numbers of cells a direction
    strain: bool = False  #: plane strain instead of plane stress
    straight: bool = False  #: sides without curvature
    #: flanks are common tangents of the ends instead of joining their highest points
    tangent: bool = False
    mean: bool = False  #: frames are means of rims, which may deform
    layer: float = 1.0  #: up to this multiple of the hole's radius the plate is rigid


CRANK = (End(0.0, 0.040, 0.015), End(0.1, 0.035, 0.010)), Cuts()
LINKAGE = (End(0.1, 0.035, 0.010), End(0.3, 0.035, 0.010)), Cuts(web=14)


# ------------------------------------------------------------------------------------------------------------------- mesh
@dataclass(frozen=True)
class Flank:
    """The upper straight side x cos(normal) + y sin(normal) = offset, seen from an end's centre; it
    meets the end at `contact`.
    """

    normal: float  #: [rad]
    offset: float  #: [m]
    contact: float  #: polar angle [rad]

    def mirrored(self, length: float) -> Flank:
        """The same side as the other end sees it, with its web on the right too."""
        return Flank(
            np.pi - self.normal, self.offset - length * np.cos(self.normal), np.pi - self.contact
        )


def flank_of(ends: tuple[End, End], tangent: bool) -> Flank:
    """The line between the highest points of both ends, or their common tangent."""
    left, right = ends
    fall, length = left.outer - right.outer, right.x - left.x
    if tangent:
        normal = float(np.arccos(fall / length))
        return Flank(normal, left.outer, normal)
    normal = float(np.arctan2(length, fall))
    return Flank(normal, left.outer * np.sin(normal), 0.5 * np.pi)


def half_outline(end: End, flank: Flank, cuts: Cuts) -> np.ndarray:
    """Points of the upper half of the outline around an end at 0: on the cut x = R, on the flank,
    on the circle.
    """
    height = (flank.offset - end.outer * np.cos(flank.normal)) / np.sin(flank.normal)
    cut = end.outer + 1j * np.linspace(0.0, height, cuts.row + 1)
    side = np.linspace(np.angle(cut[-1]), flank.contact, cuts.flank + 1)[1:-1]
    arc = np.linspace(flank.contact, np.pi, cuts.end + 1)
    straight = flank.offset / np.cos(side - flank.normal) * np.exp(1j * side)
    return np.concatenate([cut, straight, end.outer * np.exp(1j * arc)])


def ring(end: End, flank: Flank, cuts: Cuts) -> np.ndarray:
    """Points (around, across) of a ring as if the web lay on its right, first and last the same;
    rays from rim to outline.
    """
    outline = half_outline(end, flank, cuts)[:, None]
    across = np.linspace(0.0, 1.0, cuts.ring + 1) ** 1.3
    rim = end.hole * outline / np.abs(outline)
    upper = rim + (outline - rim) * across
    return np.concatenate([upper, upper[-2::-1].conj()])


def blocks(ends: tuple[End, End], cuts: Cuts, tangent: bool) -> Iterator[np.ndarray]:
    """Structured blocks of points: two rings, the web between."""
    left, right = ends
    flank = flank_of(ends, tangent)
    first = left.x + ring(left, flank, cuts)
    second = right.x - ring(right, flank.mirrored(right.x - left.x), cuts).conj()
    up = np.arange(-cuts.row, cuts.row + 1)
    s = np.linspace(0.0, 1.0, cuts.web + 1)[:, None]
    yield from (first, second, (1.0 - s) * first[:-1][up, -1] + s * second[:-1][up, -1])


def curved(ends: tuple[End, End], cuts: Cuts, model: Model) -> Any:
    """MeshQuad2 of a link; middle nodes of sides on a circle of the border are moved onto it,
    centres of cells with them.
    """
    from skfem import MeshQuad, MeshQuad2

    points, cells, count = [], [], 0
    for grid in blocks(ends, cuts.finer(model.refinement), model.tangent):
        at = count + np.arange(grid.size).reshape(grid.shape)
        cells.append(np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]]).reshape(4, -1))
        points.append(grid.ravel())
        count += grid.size
    flat, quads = np.concatenate(points), np.concatenate(cells, axis=1)
    _, kept, same = np.unique(
        np.rint(np.stack([flat.real, flat.imag]) * 1e9) + 0.0,
        axis=1,
        return_index=True,
        return_inverse=True,
    )
    flat, quads = flat[kept], same.ravel()[quads]
    x = flat[quads]
    back = np.imag((x[1] - x[0]).conj() * (x[3] - x[0])) < 0
    quads[:, back] = quads[::-1, back]
    mesh = MeshQuad2.from_mesh(MeshQuad(np.stack([flat.real, flat.imag]), quads))
    return mesh if model.straight else replace(mesh, doflocs=on_arcs(mesh, ends))


def on_arcs(mesh: Any, ends: tuple[End, End]) -> np.ndarray:
    """Places (2, n) of the nodes with curved sides: x -> c + R (x - c)/|x - c|; centre = sides / 2
    - corners / 4.
    """
    basis = lagrange(mesh)
    z = places(basis)
    border = mesh.boundary_facets()
    for end in ends:
        for radius in (end.hole, end.outer):
            on = np.abs(np.abs(mesh.p[0] + 1j * mesh.p[1] - end.x) - radius) < 1e-9
            sides = border[on[mesh.facets[:, border]].all(axis=0)]
            middle = basis.get_dofs(facets=sides).all(["u"])
            middle = middle[np.isin(middle, basis.facet_dofs)]
            z[middle] = end.x + radius * (z[middle] - end.x) / np.abs(z[middle] - end.x)
    own = z[basis.element_dofs]
    z[basis.element_dofs[8]] = own[4:8].sum(axis=0) / 2 - own[:4].sum(axis=0) / 4
    out = mesh.doflocs.copy()
    nodes = mesh.dofs.element_dofs
    out[:, nodes.ravel()] = np.stack([own.real, own.imag]).reshape(2, -1)
    out[:, nodes[8]] = np.stack([z.real, z.imag])[:, basis.element_dofs[8]]
    return out


def lagrange(mesh: Any) -> Any:
    """Tabulated 9-node shape functions, 3 x 3 points a cell."""
    from skfem import Basis, ElementQuad2

    return Basis(mesh, ElementQuad2(), intorder=5)


def places(basis: Any) -> np.ndarray:
    """z (n,) of the nodes."""
    return np.asarray(basis.doflocs[0] + 1j * basis.doflocs[1])


# ----------------------------------------------------------------------------------------------------------------- bodies
@dataclass(frozen=True)
class Part:
    """A link with the coordinates w: pairs (Re, Im) of free nodes, then c, a of both frames; a mean
    frame has only nodes.
    """

    start: np.ndarray  #: (n,) w of the reference shape
    frames: csr_array  #: (8, n), c and a of both frames from w
    gather: csr_array  #: (18 e, n), cells' nodes from w
    gradient: np.ndarray  #: (e, 18, 9), point and direction by shape function [1/m]
    stiffness: tuple[float, float, float]  #: E11 from E11, E11 from E22, E12 from E12 [N/m]
    weight: np.ndarray  #: (e, p) area [m2]
    mass: csr_array  #: (n, n) [kg]

    def turn(self, w: np.ndarray) -> complex:
        """Direction of the line between both frames, one at the start."""
        c = (self.frames @ w).view(complex)[[0, 2]]
        return complex((c[1] - c[0]) / abs(c[1] - c[0]))


def doubled(S: csr_array) -> csr_array:
    """Complex numbers as pairs of real ones: x + iy -> [[x, -y], [y, x]]."""
    at = S.tocoo()
    i, j, z = 2 * at.row, 2 * at.col, at.data.astype(complex)
    rows, columns = np.concatenate([i, i, i + 1, i + 1]), np.concatenate([j, j + 1, j, j + 1])
    data = np.concatenate([z.real, -z.imag, z.imag, z.real])
    keep = data != 0
    return csr_array(
        coo_array((data[keep], (rows[keep], columns[keep])), shape=(2 * S.shape[0], 2 * S.shape[1]))
    )


def slaved(
    z: np.ndarray, rims: list[np.ndarray], ends: tuple[End, End]
) -> tuple[csr_array, csr_array, np.ndarray]:
    """Nodes from free nodes and frames (n, m), frames from those (4, m), and those at the reference
    (m,): complex.
    """
    free = np.setdiff1d(np.arange(len(z)), np.concatenate(rims))
    blocks = [
        coo_array((np.ones(len(free)), (free, np.arange(len(free)))), shape=(len(z), len(free) + 4))
    ]
    for k, (rim, end) in enumerate(zip(rims, ends, strict=True)):
        for column, values in ((0, np.ones(len(rim))), (1, z[rim] - end.x)):
            at = np.full(len(rim), len(free) + 2 * k + column)
            blocks.append(coo_array((values, (rim, at)), shape=blocks[0].shape))
    frames = coo_array(
        (np.ones(4), (np.arange(4), len(free) + np.arange(4))), shape=(4, len(free) + 4)
    )
    return (
        csr_array(sum(blocks[1:], blocks[0])),
        csr_array(frames),
        np.concatenate([z[free], [ends[0].x, 1.0, ends[1].x, 1.0]]),
    )


def averaged(
    z: np.ndarray, rims: list[np.ndarray], ends: tuple[End, End]
) -> tuple[csr_array, csr_array, np.ndarray]:
    """The same for rims that may deform: the frame nearest to the rim, min sum |z - c - a (X -
    C)|^2.
    """
    rows = []
    for rim, end in zip(rims, ends, strict=True):
        fit = np.linalg.pinv(np.column_stack([np.ones(len(rim)), z[rim] - end.x]))
        rows += [(rim, values) for values in fit]
    data = [
        coo_array((values, (np.full(len(rim), i), rim)), shape=(4, len(z)))
        for i, (rim, values) in enumerate(rows)
    ]
    identity = coo_array((np.ones(len(z)), (np.arange(len(z)), np.arange(len(z)))))
    return csr_array(identity), csr_array(sum(data[1:], data[0])), z.astype(complex)


def part(ends: tuple[End, End], cuts: Cuts, model: Model) -> Part:
    """A link with its tables."""
    from skfem import Basis, BilinearForm, ElementQuad2

    mesh = curved(ends, cuts, model)
    basis = lagrange(mesh)
    z = places(basis)
    rims = [np.flatnonzero(np.abs(z - end.x) < end.hole * model.layer * (1 + 1e-9)) for end in ends]
    S, frames, start = (averaged if model.mean else slaved)(z, rims, ends)
    weigh = BilinearForm(lambda u, v, _: model.density * model.thickness * u * v)
    mass = csr_array(weigh.assemble(Basis(mesh, ElementQuad2(), intorder=7)))
    spread, nodes = doubled(S), basis.element_dofs.T.ravel()
    gradient = np.stack([shape[0].grad for shape in basis.basis]).transpose(2, 3, 1, 0)
    E, nu = model.young, model.poisson
    if model.strain:
        E, nu = E / (1 - nu**2), nu / (1 - nu)
    A = E * model.thickness / (1 - nu**2)
    return Part(
        start.view(float),
        doubled(frames),
        csr_array(spread[(2 * nodes[:, None] + [0, 1]).ravel()]),
        np.ascontiguousarray(gradient.reshape(len(gradient), -1, 9)),
        (A, A * nu, A * (1 - nu)),
        np.asarray(basis.dx),
        csr_array(spread.T @ doubled(mass) @ spread),
    )


def strains(body: Part, w: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """F (e, p, 2 directions, 2 components), and E11, E22, E12 (e, p) of Green and Lagrange."""
    u = (body.gather @ w).reshape(-1, 9, 2)
    F = (body.gradient @ u).reshape(len(u), -1, 2, 2)
    E = [
        0.5 * (F[:, :, i, 0] * F[:, :, j, 0] + F[:, :, i, 1] * F[:, :, j, 1] - (i == j))
        for i, j in PAIRS
    ]
    return F, E


def stresses(body: Part, E: list[np.ndarray]) -> list[np.ndarray]:
    """Forces S11, S22, S12 (e, p) times area [N m]."""
    A, B, G = body.stiffness
    return [
        body.weight * (A * E[0] + B * E[1]),
        body.weight * (A * E[1] + B * E[0]),
        body.weight * (G * E[2]),
    ]


def force(body: Part, w: np.ndarray) -> np.ndarray:
    """Elastic force (n,) = dW/dw."""
    F, E = strains(body, w)
    S11, S22, S12 = (s[..., None] for s in stresses(body, E))
    P = np.stack([S11 * F[:, :, 0] + S12 * F[:, :, 1], S12 * F[:, :, 0] + S22 * F[:, :, 1]], axis=2)
    cells = body.gradient.transpose(0, 2, 1) @ P.reshape(len(P), -1, 2)
    return np.asarray(body.gather.T @ cells.ravel())


def tangent(body: Part) -> csr_array:
    """K = d2W/dw2 at the reference shape, B^T D B with the linear strains of plane elasticity."""
    A, C, G = body.stiffness
    e, N = len(body.gradient), body.gradient.reshape(len(body.gradient), -1, 2, 9)
    rows = np.zeros((*N.shape[:2], 3, 9, 2))
    rows[:, :, 0, :, 0] = rows[:, :, 2, :, 1] = N[:, :, 0]
    rows[:, :, 1, :, 1] = rows[:, :, 2, :, 0] = N[:, :, 1]
    B = rows.reshape(e, -1, 3, 18)
    D = np.array([[A, C, 0.0], [C, A, 0.0], [0.0, 0.0, G / 2]])
    cells = np.einsum("epib,ij,epjd,ep->ebd", B, D, B, body.weight, optimize=True)
    return csr_array(body.gather.T @ csr_array(block_diag(list(cells), format="csr")) @ body.gather)


def energy(body: Part, w: np.ndarray) -> float:
    """Elastic energy [J]."""
    _, E = strains(body, w)
    S = stresses(body, E)
    return float(0.5 * np.sum(S[0] * E[0] + S[1] * E[1] + 2.0 * S[2] * E[2]))


# ----------------------------------------------------------------------------------------------------------------- system
@dataclass(frozen=True)
class Solver:
    """W = bh m + K of both bodies at the reference shape, turned when it is used."""

    parts: tuple[Part, Part]
    masses: tuple[csr_array, csr_array]
    solves: tuple[Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]
    columns: tuple[np.ndarray, np.ndarray]  #: (n, 8), W^-1 P^T
    model: Model

    def rows(self, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gaps (m,) and their derivatives (m, 16) by c, a, c, a of the crank and the linkage."""
        G = np.zeros((5 if self.model.mean else 9, 16))
        G[[0, 1, 2, 3, 4], [0, 1, 4, 5, 13]] = 1.0
        G[[2, 3], [8, 9]] = -1.0
        gap = G @ frames
        for k, at in enumerate(range(2, 16, 4)) if not self.model.mean else ():
            G[5 + k, at : at + 2] = frames[at : at + 2]
            gap[5 + k] = 0.5 * (frames[at : at + 2] @ frames[at : at + 2] - 1.0)
        return gap, G

    def turned(self, k: int, w: np.ndarray, by: complex) -> np.ndarray:
        """W^-1 w of a body that has turned."""
        return np.asarray(
            (
                self.solves[k]((w.view(complex) * by.conjugate()).view(float)).view(complex) * by
            ).view(float)
        )


def solver(model: Model, bh: float) -> Solver:
    """Both links, the slider's mass on the linkage's second frame."""
    parts = part(*CRANK, model), part(*LINKAGE, model)
    slider = csr_array(parts[1].frames[4:6])
    masses = parts[0].mass, csr_array(parts[1].mass + model.slider * slider.T @ slider)
    solves, columns = [], []
    for body, mass in zip(parts, masses, strict=True):
        factors = splu(
            csc_array(bh * mass + tangent(body)),
            permc_spec="MMD_AT_PLUS_A",
            options={"SymmetricMode": True},
        )
        solves.append(factors.solve)
        columns.append(factors.solve(body.frames.T.toarray()))
    return Solver(parts, masses, (solves[0], solves[1]), (columns[0], columns[1]), model)


def halves(s: Solver, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The numbers of the crank and those of the linkage."""
    count = len(s.parts[0].start)
    return x[:count], x[count:]


def frames_of(s: Solver, x: np.ndarray) -> np.ndarray:
    """c and a of the crank's and the linkage's frames (16,)."""
    return np.concatenate([body.frames @ w for body, w in zip(s.parts, halves(s, x), strict=True)])


def correction(
    s: Solver, x: np.ndarray, r: np.ndarray, gap: np.ndarray, G: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """dx, dl of  W dx + P^T G^T dl = -r,  G P dx = -gap."""
    turns = [body.turn(w) for body, w in zip(s.parts, halves(s, x), strict=True)]
    free = np.concatenate([s.turned(k, half, turns[k]) for k, half in enumerate(halves(s, r))])
    small = np.zeros((16, 16))
    for k, turn in enumerate(turns):
        R = np.kron(np.eye(4), np.array([[turn.real, -turn.imag], [turn.imag, turn.real]]))
        small[8 * k : 8 * k + 8, 8 * k : 8 * k + 8] = R @ (s.parts[k].frames @ s.columns[k]) @ R.T
    dl = np.linalg.solve(G @ small @ G.T, gap - G @ frames_of(s, free))
    push = (G.T @ dl).view(complex).reshape(2, 4)
    own = [s.columns[k] @ (push[k] * turn.conjugate()).view(float) for k, turn in enumerate(turns)]
    held = np.concatenate(
        [(w.view(complex) * turn).view(float) for w, turn in zip(own, turns, strict=True)]
    )
    return -free - held, dl


def residual(
    s: Solver, x: np.ndarray, a: np.ndarray, multipliers: np.ndarray, G: np.ndarray
) -> np.ndarray:
    """m x'' + f(x) + P^T (G^T l - Q), with the torque M i a/|a|^2 on the crank's first frame."""
    push = G.T @ multipliers
    arm = (s.parts[0].frames[2:4] @ halves(s, x)[0]).view(complex)[0]
    pull = s.model.torque * 1j * arm / abs(arm) ** 2
    push[2:4] -= pull.real, pull.imag
    states = zip(s.parts, s.masses, halves(s, x), halves(s, a), push.reshape(2, 8), strict=True)
    return np.concatenate(
        [
            m @ acceleration + force(body, w) + body.frames.T @ p
            for body, m, w, acceleration, p in states
        ]
    )


# ------------------------------------------------------------------------------------------------------------------- time
@dataclass(frozen=True)
class Run:
    """Histories (s,)."""

    time: np.ndarray  #: [s]
    x_C: np.ndarray  #: [m]
    angle: np.ndarray  #: of the crank's first frame [rad]
    speed: np.ndarray  #: [rad/s]
    energy: np.ndarray  #: kinetic and elastic energy less the work of the torque [J]
    iterations: int


def coefficients(rho: float) -> tuple[float, float, float, float]:
    """am, af, gamma, beta."""
    am, af = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    gamma = 0.5 + af - am
    return am, af, gamma, 0.25 * (gamma + 0.5) ** 2


def solved(
    s: Solver, x: np.ndarray, a: np.ndarray, multipliers: np.ndarray, bh: float, tolerance: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Newton from a prediction x, x'' with dx'' = bh dx, until the next correction is expected
    below the tolerance.
    """
    last = np.inf
    for count in range(1, 30):
        gap, G = s.rows(frames_of(s, x))
        dx, dl = correction(s, x, residual(s, x, a, multipliers, G), gap, G)
        x, a, multipliers = x + dx, a + bh * dx, multipliers + dl
        size = float(np.abs(dx).max())
        if count > 1 and size * min(1.0, size / last) < tolerance:
            return x, a, multipliers, count
        last = size
    raise RuntimeError(f"no convergence: the last correction is {size:.1e}")


def integrate(
    model: Model,
    h: float,
    duration: float,
    rho: float = 0.8,
    every: int = 1,
    tolerance: float = 1e-13,
) -> Run:
    """The motion from rest, stored every so many steps; am a start of (m + K/bh) x''(0) = Q."""
    am, af, gamma, beta = coefficients(rho)
    bh = (1.0 - am) / (h**2 * beta * (1.0 - af))
    s = solver(model, bh)
    x = np.concatenate([body.start for body in s.parts])
    v = np.zeros_like(x)
    gap, G = s.rows(frames_of(s, x))
    dx, multipliers = correction(s, x, residual(s, x, v, np.zeros(len(gap)), G), 0.0 * gap, G)
    now = before = bh * dx
    a, rows, total, angle = now, [], 0, 0.0
    rows.append(sampled(s, x, v, 0.0))
    for step in range(1, round(duration / h) + 1):
        guess = 2.0 * now - before
        a1 = ((1.0 - af) * guess + af * now - am * a) / (1.0 - am)
        predicted = x + h * v + h**2 * ((0.5 - beta) * a + beta * a1)
        x, new, multipliers, count = solved(s, predicted, guess, multipliers, bh, tolerance)
        before, now, a0 = now, new, a
        a = ((1.0 - af) * now + af * before - am * a0) / (1.0 - am)
        v = v + h * ((1.0 - gamma) * a0 + gamma * a)
        arm = np.angle((s.parts[0].frames[2:4] @ halves(s, x)[0]).view(complex)[0])
        angle += float(np.remainder(arm - angle + np.pi, 2.0 * np.pi) - np.pi)
        total += count
        if step % every == 0:
            rows.append(sampled(s, x, v, angle))
    x_C, angles, speed, excess = np.array(rows).T
    return Run(every * h * np.arange(len(rows)), x_C, angles, speed, excess, total)


def sampled(
    s: Solver, x: np.ndarray, v: np.ndarray, angle: float
) -> tuple[float, float, float, float]:
    """x_C, angle, speed, energy that is not the torque's."""
    arm, rate = ((s.parts[0].frames[2:4] @ halves(s, y)[0]).view(complex)[0] for y in (x, v))
    speed = float((arm.conjugate() * rate).imag / abs(arm) ** 2)
    states = zip(s.parts, s.masses, halves(s, x), halves(s, v), strict=True)
    stored = sum(energy(body, w) + 0.5 * rate @ (m @ rate) for body, m, w, rate in states)
    return float(frames_of(s, x)[12]), angle, speed, float(stored) - s.model.torque * angle


# ------------------------------------------------------------------------------------------------------------------ rigid
def rigid(model: Model, times: np.ndarray) -> Run:
    """Rigid plates of the same mass: J(angle) angle'' + J'/2 angle'^2 = M with scipy's DOP853."""
    from scipy.integrate import solve_ivp

    arm, length = CRANK[0][1].x, LINKAGE[0][1].x - LINKAGE[0][0].x
    about_a = inertia(*CRANK, model)[1, 1]
    own = inertia(*LINKAGE, model) + model.slider * np.array([[1.0, length], [length, length**2]])

    def motion(angle: float) -> tuple[float, np.ndarray, np.ndarray]:
        """Angle of the linkage, and q', q'' by the crank's angle of q = (c_B, a of the linkage)."""
        tilt = -np.arcsin(arm * np.sin(angle) / length)
        first = -arm * np.cos(angle) / (length * np.cos(tilt))
        second = (arm * np.sin(angle) / length + np.sin(tilt) * first**2) / np.cos(tilt)
        pin, turn = arm * np.exp(1j * angle), np.exp(1j * tilt)
        return (
            tilt,
            np.array([1j * pin, 1j * first * turn]),
            np.array([-pin, (1j * second - first**2) * turn]),
        )

    def rate(_: float, y: np.ndarray) -> list[float]:
        _, first, second = motion(y[0])
        J, slope = about_a + (first.conj() @ own @ first).real, (first.conj() @ own @ second).real
        return [y[1], (model.torque - slope * y[1] ** 2) / J]

    found = solve_ivp(rate, (0.0, times[-1]), [0.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-12).y
    x_C = [arm * np.cos(angle) + length * np.cos(motion(angle)[0]) for angle in found[0]]
    return Run(times, np.array(x_C), found[0], found[1], 0.0 * times, 0)


def inertia(ends: tuple[End, End], cuts: Cuts, model: Model) -> np.ndarray:
    """Mass and its first and second moments about the first hole: [[m, s], [s, J]]."""
    basis = lagrange(curved(ends, cuts, model))
    x, y = np.asarray(basis.global_coordinates())
    x = x - ends[0].x
    heavy = model.density * model.thickness * np.asarray(basis.dx)
    first = np.sum(heavy * x)
    return np.array([[heavy.sum(), first], [first, np.sum(heavy * (x**2 + y**2))]])


# ----------------------------------------------------------------------------------------------------------------- figures
@dataclass(frozen=True)
class Figures:
    """What a run says at its end, and its largest speed at instants 2e-5 s apart."""

    name: str
    step: float  #: [s]
    x_C: float  #: [m]
    angle: float  #: [rad]
    speed: float  #: [rpm]
    top_speed: float  #: [rpm]
    top_time: float  #: [s]


def figures(name: str, step: float, run: Run) -> Figures:
    """Key numbers of a run."""
    rpm = run.speed * 30.0 / np.pi
    top = int(rpm.argmax())
    return Figures(
        name, step, *map(float, (run.x_C[-1], run.angle[-1], rpm[-1], rpm[top], run.time[top]))
    )


def every(step: float) -> int:
    """Steps between two samples."""
    return max(1, round(SAMPLING / step))


def independent(name: str, model: Model, step: float, duration: float, rho: float = 0.8) -> Figures:
    """A run of this solver."""
    return figures(name, step, integrate(model, step, duration, rho, every(step)))


def ours(scene: str, step: float, duration: float, tangent: bool = False) -> Figures:
    """A run of fmbs_skfem; with `tangent` on a coarse crank whose flanks touch its ends as
    tangents.
    """
    from fmbs_skfem import dynamics, scenes, systems
    from fmbs_skfem.scenes import build
    from fmbs_skfem.shapes import plate_meshes

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(
            ROOT / "meshes", folder / "meshes", ignore=shutil.ignore_patterns("__pycache__")
        )
        shutil.copytree(
            ROOT / "examples", folder / "examples", ignore=shutil.ignore_patterns("__pycache__")
        )
        if tangent:
            links = runpy.run_path(str(ROOT / "meshes" / "build_plates.py"))
            crank, cuts = links["LINKS"]["plate_crank_coarse.msh"]
            plate_meshes.write(
                links["link"](replace(crank, tangent=True), cuts),
                folder / "meshes" / "plate_crank_coarse.msh",
            )
        system = systems.eliminate(build.system(scenes.read(folder / "examples" / f"{scene}.yaml")))
    scheme = dynamics.GeneralizedAlpha(step, 0.8)
    motion = dynamics.integrate(
        system, scheme, duration, dynamics.Newton(tolerance=1e-12), every=every(step)
    )
    found = dynamics.outputs(motion)
    run = Run(
        motion.times,
        found["x_C"],
        found["crank_angle"],
        found["crank_speed"],
        0.0 * motion.times,
        0,
    )
    return figures(f"fmbs_skfem, {scene}.yaml" + (f", {OTHER}" if tangent else ""), step, run)


OTHER = "flanks tangent to both ends"
VARIANTS: dict[str, Model] = {
    "plane strain": Model(strain=True),
    "E 3.5 % larger": Model(young=1.035 * 70e9),
    "t 3.5 % larger": Model(thickness=1.035 * 0.01),
    "rims rigid in the mean only": Model(mean=True),
    "rigid up to 1.3 radii of the holes": Model(layer=1.3),
    "straight sides for arcs": Model(straight=True),
    OTHER: Model(tangent=True),
}


def both(step: float, duration: float) -> list[Figures]:
    """One step: two meshes of this solver, and ours; then flanks that touch the ends as tangents."""
    cells = {
        n: sum(curved(*link, Model(refinement=n)).nelements for link in (CRANK, LINKAGE))
        for n in (1, 2)
    }
    own = [
        independent(f"independent, {cells[n]} cells", Model(refinement=n), step, duration)
        for n in (1, 2)
    ]
    other = independent(f"{OTHER}, {cells[1]} cells", VARIANTS[OTHER], step, duration)
    return [
        *own,
        ours("crank_slider_coarse", step, duration),
        other,
        ours("crank_slider_coarse", step, duration, tangent=True),
    ]


def steps(step: float, duration: float, known: list[Figures]) -> list[Figures]:
    """Four times and twice the step beside the known runs of the coarse meshes, and the limits for
    h = 0.
    """
    mine = [independent(known[0].name, Model(), n * step, duration) for n in (4, 2)] + [known[0]]
    other = [ours("crank_slider_coarse", n * step, duration) for n in (4, 2)] + [known[2]]
    return [*mine, limit(*mine[1:]), *other, limit(*other[1:])]


def limit(coarse: Figures, fine: Figures) -> Figures:
    """fine + (fine - coarse)/3 for a method of second order and half the step."""
    x_C, angle, speed, top = (
        getattr(fine, key) + (getattr(fine, key) - getattr(coarse, key)) / 3.0
        for key in ("x_C", "angle", "speed", "top_speed")
    )
    return Figures(f"{fine.name}, limit", 0.0, x_C, angle, speed, top, fine.top_time)


def variants(step: float, duration: float) -> list[Figures]:
    """What else might have been meant, and the rigid mechanism."""
    times = np.arange(0.0, duration + 0.5 * SAMPLING, SAMPLING)
    rows = [independent("as it is", Model(), step, duration)]
    rows += [independent("rho_inf 0.5", Model(), step, duration, 0.5)]
    rows += [independent(name, model, step, duration) for name, model in VARIANTS.items()]
    rows += [figures("rigid plates", 0.0, rigid(Model(refinement=2), times))]
    return [
        *rows,
        figures(f"rigid plates, {OTHER}", 0.0, rigid(Model(refinement=2, tangent=True), times)),
    ]


def table(rows: list[Figures], base: Figures) -> str:
    """Markdown, with differences from a base."""
    head = (
        "run",
        "h [s]",
        "x_C [m]",
        "angle [rad]",
        "speed [rpm]",
        "largest [rpm]",
        "at [s]",
        "x_C - base [m]",
        "angle - base [rad]",
    )
    lines = ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    for row in rows:
        apart = (
            f"{row.x_C - base.x_C:+.1e} | {row.angle - base.angle:+.1e}"
            if row is not base
            else "base | base"
        )
        values = f"{row.x_C:.7f} | {row.angle:.6f} | {row.speed:.2f} | {row.top_speed:.2f} | {row.top_time:.5f} | {apart}"
        lines.append(f"| {row.name} | {row.step:g} | {values} |")
    return "\n".join(lines)


def summary(same: list[Figures]) -> str:
    """Who agrees with whom; x_C of the last run is carried over to the finer mesh by what that
    changes in the first.
    """
    coarse, fine, mine, other, touching = same
    x_C = other.x_C + fine.x_C - coarse.x_C
    agreed = f"Both codes differ by {abs(mine.x_C - fine.x_C):.1e} m in x_C, {abs(mine.angle - fine.angle):.1e} rad in {fine.angle:.1f}."
    asked = f"With {OTHER}: x_C = {other.x_C:.7f} m, {x_C:.5f} m less the error of the mesh; {other.top_speed:.1f} rpm."
    here = f"fmbs_skfem with the same flanks: x_C = {touching.x_C:.7f} m, {touching.top_speed:.1f} rpm."
    return f"{agreed} {asked} {here}"


def page(found: dict[str, list[Figures]], duration: float) -> str:
    """What the runs say, and the three tables."""
    same, finer, other = found["both"], found["steps"], found["variants"]
    parts = [
        f"# Crank-slider by an independent solver, {duration:g} s from rest",
        summary(same),
        "Both codes with the same step and rho_inf = 0.8; the base is this solver's finer mesh.",
        table(same, same[1]),
        "Steps on coarse meshes; h = 0: Richardson's limit from the two smallest steps; the base is the independent one.",
        table(finer, finer[3]),
        "What else might have been meant: four times the step, coarse mesh; the rigid mechanism on the finer mesh, exact in time.",
        table(other, other[0]),
    ]
    return "\n\n".join(parts) + "\n"


def main(arguments: list[str] | None = None) -> dict[str, list[Figures]]:
    """Print the tables, or JSON; write both into benchmarks/results if asked."""
    parser = argparse.ArgumentParser(description="Example 3 by an independent solver")
    parser.add_argument(
        "--quick",
        action="store_true",
        help="0.02 s with a step of 4e-5 s instead of 0.2 s with 1e-5 s",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument(
        "--write", action="store_true", help="write crank_slider_independent.md and .json"
    )
    options = parser.parse_args(arguments)
    duration, step = (0.02, 4e-5) if options.quick else (0.2, 1e-5)
    same = both(step, duration)
    found = {
        "both": same,
        "steps": steps(step, duration, same),
        "variants": variants(4.0 * step, duration),
    }
    data = json.dumps({key: [asdict(row) for row in rows] for key, rows in found.items()}, indent=2)
    print(data if options.json else page(found, duration))
    if options.write:
        RESULTS.mkdir(parents=True, exist_ok=True)
        (RESULTS / "crank_slider_independent.json").write_text(data + "\n", encoding="utf-8")
        (RESULTS / "crank_slider_independent.md").write_text(
            page(found, duration), encoding="utf-8"
        )
    return found


if __name__ == "__main__":
    main()
