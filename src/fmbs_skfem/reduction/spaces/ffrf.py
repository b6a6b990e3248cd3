r"""Floating frame of reference with linear modes, as a comparator.

    r(s, t) = c + s e + sum_i phi_i(s) m_i,    |e| = 1,    m_i . e = 0,    V = 1/2 sum_i omega_i^2 |m_i|^2

c and e are the origin and the axis of a frame that follows the start of a straight beam, phi_i its
clamped linear bending modes (normalised by mass) and m_i their amplitudes normal to e. In these
coordinates r is linear, the mass matrix is constant and the constraints are quadratic, so the
floating frame is a change of coordinates and a few constraint rows. It has no axial deformation and
no geometric stiffness of the modes: centrifugal stiffening is missing, which is why it fails in
fast spin-up.

Source: A. A. Shabana, Dynamics of Multibody Systems, 4th ed., Cambridge 2013, ch. 5, doi
10.1017/CBO9781107337213.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag
from scipy.sparse import csr_array

from ...bodies.body import Cells
from ...core.errors import InputError, say
from ...core.values.arguments import checked
from ...dynamics.near_state.modes import dense_modes
from ...systems.affine import Affine
from ...systems.assembly import terms_of
from ...systems.places import TermCollector
from ...systems.system import System, change_coordinates
from .component import require_body_coordinates


@checked
def reduce_floating(system: System, modes: int = 10) -> System:
    """Floating-frame model of a full system (with all multipliers) of straight beams, with `modes`
    bending modes a body.

    Unknowns of a beam are c, e and the amplitudes m_i, c letters each (`System.components` says
    where). Its stiffness is diag(omega_i^2), its constraints those of the system and

        |e|^2 = 1,    m_i . e = 0

    InputError for a beam that is not straight.
    """
    require_body_coordinates("reduce_floating", system)
    if modes < 1:
        raise InputError(say("reduce_floating: modes", "1 or more", modes))
    dim = system.dim
    cells = {e.name: e.gather for e in system.elastic}
    blocks = []
    springs = []
    spans = []
    terms = terms_of(system.constraints)
    at = 0
    before = len(system.probes.offset)
    for name, first, last in system.coordinates:
        part = cells.get(name)
        if part is not None:
            fields, squares = floating_fields(system, name, part, modes)
            frame_rows(terms, name, before + at + dim, dim, len(squares))
            blocks.append(np.kron(fields, np.eye(dim)))
            springs.append(np.concatenate([np.zeros(2 * dim), np.repeat(squares, dim)]))
        else:
            blocks.append(np.eye(last - first))
            springs.append(np.zeros(last - first))
        spans.append((name, at, at + blocks[-1].shape[1]))
        at += blocks[-1].shape[1]
    reduced = change_coordinates(system, block_diag(*blocks), np.zeros(system.size))
    probes = Affine(
        np.vstack([np.asarray(reduced.probes.matrix), np.eye(at)]),
        np.append(reduced.probes.offset, np.zeros(at)),
    )
    return replace(
        reduced,
        elastic=(),
        stiffness=np.diag(np.concatenate(springs)),
        probes=probes,
        constraints=terms.arrays(),
        components=tuple(spans),
        full=None,
    )


def floating_fields(
    system: System, name: str, cells: Cells, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Scalar fields (b, 2 + i): 1, arc length, bending modes; squares of the frequencies omega^2
    (i,).

    InputError for a body whose reference line is curved.
    """
    first, last = next((a, b) for body, a, b in system.coordinates if body == name)
    dim = system.dim
    samples = next(line.samples for line in system.lines if line.name == name)[
        ::dim, first:last:dim
    ].toarray()
    points = len(samples) // 3
    position = samples[:points] @ system.lift(system.x0)[first:last].reshape(-1, dim)
    axis = (position[-1] - position[0]) / np.linalg.norm(position[-1] - position[0])
    along = (position - position[0]) @ axis
    if np.abs(position - position[0] - np.outer(along, axis)).max() > 1e-9 * along[-1]:
        raise InputError(
            say(f"body '{name}'", "a straight reference line for a floating frame", "a curved one")
        )
    zero = np.zeros(points)
    fields = [np.concatenate([zero + 1, zero, zero]), np.concatenate([along, zero + 1, zero])]
    unit, arc = (np.linalg.lstsq(samples, field, rcond=None)[0] for field in fields)
    squares, shapes = bending_modes(system, cells, first, last, samples[[0, points]], count)
    return np.column_stack([unit, arc, shapes]), squares


def bending_modes(
    system: System, cells: Cells, first: int, last: int, start: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Bending modes clamped at the start: omega^2 (i,), shapes v (b, i); `start` (2, b) reads value
    and slope.

        K v = omega^2 M v,    v^T M v = 1
    """
    dim = cells.dim
    mass = csr_array(system.mass)[first:last:dim, first:last:dim].toarray()
    nodes = (cells.nodes - first) // dim
    local = np.einsum(
        "pbe,pde,pe->ebd", cells.table[1], cells.table[1], cells.section[1] * cells.section[3]
    )
    K = np.zeros_like(mass)
    np.add.at(K, (nodes.T[:, :, None], nodes.T[:, None, :]), local)
    return dense_modes(K, mass, start, min(count, len(K) - len(start)))


def frame_rows(terms: TermCollector, name: str, e: int, dim: int, modes: int) -> None:
    """Constraints of a floating frame and its amplitudes.

        |e|^2 = 1,    m_i . e = 0

    The frame axis is probe row `e`, the amplitudes stand behind it.
    """
    terms.row(name, "frame", *[(0.5, -1, e + c, e + c) for c in range(dim)], (-0.5, -1, -1, -1))
    for i in range(modes):
        m = e + (i + 1) * dim
        terms.row(name, f"mode {i + 1}", *[(1.0, -1, m + c, e + c) for c in range(dim)])
