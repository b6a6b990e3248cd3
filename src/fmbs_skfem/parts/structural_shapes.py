r"""Shapes of a free body that follow from its mass and stiffness alone: what joints, loads and
inertia can bend it to.

    K v = w^2 M v,    (K + s M) u_1 = p,    (K + s M) u_2 = M u_1,    s = w_1^2                                             (1)

p are unit forces at places and along their vectors, which moments and clamps use, and fields M x_j
that grow with the distance, as the pull of a spin does. All have the same strain energy, u^T K u =
1, so that soft shapes are large. A training that was slow or had no moments leaves them out,
however little is left of its states.

Source: Rayleigh-Ritz by moment matching: T. J. Su, R. R. Craig, J. Guidance 14 (1991) 260-267, doi
10.2514/3.20636.
"""

from __future__ import annotations

import numpy as np

from ..bodies.body import Body
from ..core.algebra import saddle
from ..core.errors import InputError
from ..dynamics.near_state.linear import Linear, linearise
from ..dynamics.near_state.modes import real_modes
from ..systems import assemble, free_motions

MODES = 10  #: elastic vibration modes of the free body
STIFF = 1e-9  #: energy of a shape over that of the stiffest one, up to which nothing resists it


def columns(part: Body, rows: np.ndarray) -> np.ndarray:
    """Shapes (b, j) of a full body in every component, for rows (i, b) at its places; none where
    its reference is limp.

        u^T K u = 1

    Every shape has this strain energy, and a column for each of its components. No columns as well
    where the body has no modes. Source: Su and Craig 1991, doi 10.2514/3.20636.
    """
    system = assemble([part], pictures=False)
    try:
        free_motions.refuse_limp(part.name, system)
        linear = linearise(system)
        rigid = part.dim * (part.dim + 1) // 2
        modes = real_modes(linear, MODES + rigid)
    except InputError:
        return np.zeros((len(part.reference), 0))
    first = float(modes.squares[min(rigid, len(modes.squares) - 1)])
    shapes = [modes.shapes[:, rigid:], *pushed(linear, forces(part, rows), first)]
    found = np.hstack(shapes)
    energy = np.einsum("nj,nj->j", found, linear.stiffness @ found)
    size = energy / np.maximum(np.einsum("nj,nj->j", found, linear.mass @ found), 1e-300)
    kept = size > STIFF * size.max(initial=0.0)
    found = found[:, kept] / np.sqrt(energy[kept])
    return found.reshape(len(part.reference), part.dim, -1).reshape(len(part.reference), -1)


def forces(part: Body, rows: np.ndarray) -> np.ndarray:
    """Unit forces (b c, j) of (1) along every component."""
    along = np.vstack([rows, (part.mass @ part.reference).T])
    return np.kron(along, np.eye(part.dim)).T


def pushed(linear: Linear, forces: np.ndarray, shift: float) -> list[np.ndarray]:
    """u_1 and u_2 of (1) (n, j)."""
    inverse = saddle.constrained(linear.stiffness + shift * linear.mass, linear.rows)
    if inverse is None:
        return []
    first = np.stack([inverse(force) for force in forces.T], axis=1)
    second = np.stack([inverse(force) for force in (linear.mass @ first).T], axis=1)
    return [first, second]
