r"""Fields of solids on their boundary, and how far their stresses are known.

    s*_n = s(mean of F over the faces at node n),    error_n = max_f sqrt(mean |s_f - s*|^2)   of the faces f at n

with |s| the norm of the tensor. Of problems with a known solution near a singular point the error of
the 12 largest stresses was 0.3 to 2.3 times that. Components refer to the axes of the mesh, which
turn with the material, see `bodies.solids.solid_law`.
"""

from __future__ import annotations

import numpy as np

from ..bodies.solids import solid_law
from ..systems.system import Skin
from .frames import Array, Indices
from .surfaces import places


def means(gradients: Array, place: Indices) -> Array:
    """Gradients (3, x, c) by their means over points of one place (x,)."""
    counts = np.bincount(place)
    found = np.empty_like(gradients)
    for k in range(gradients.shape[0]):
        for c in range(gradients.shape[2]):
            found[k, :, c] = (np.bincount(place, gradients[k, :, c]) / counts)[place]
    return found


def stresses(skin: Skin, gradients: Array) -> Array:
    """Cauchy stresses (6, x) [Pa] of gradients (3, x, c)."""
    u = np.ascontiguousarray(gradients.transpose(0, 2, 1).reshape(9, 1, -1))
    return solid_law.stresses(skin.law, skin.section[:-1], u)[:, 0]


def fields(skin: Skin, gradients: Array, rate: Array, reference: Array) -> dict[str, Array]:
    """Fields (x,) or (x, 3) at one instant, of gradients (1 + 3, x, c), the velocity (x, c), and the
    reference (x, 3) [m].
    """
    F = means(gradients[1:], places(reference))
    stress = stresses(skin, F)
    strain = solid_law.principal(solid_law.strains(F.transpose(0, 2, 1).reshape(9, -1)))
    return {
        "velocity": rate,
        "strain": np.where(strain[0] > -strain[2], strain[0], strain[2]),
        "von_mises": solid_law.von_mises(stress),
        "principal": solid_law.principal(stress).T,
        "stress_normal": stress[:3].T,
        "stress_shear": stress[3:].T,
    }


def errors(skin: Skin, gradients: Array, reference: Array) -> tuple[Array, Array]:
    """Errors (x,) of the stresses at points, and these (6, x) [Pa], of gradients (1 + 3, x, c) and the
    reference (x, 3).
    """
    place = places(reference)
    smooth, raw = (stresses(skin, F) for F in (means(gradients[1:], place), gradients[1:]))
    apart = tensor_size(raw - smooth) ** 2
    each = np.sqrt(apart.reshape(-1, skin.points).mean(axis=1))
    found = np.zeros(int(place.max()) + 1)
    np.maximum.at(found, place, np.repeat(each, skin.points))
    return found[place], smooth


def tensor_size(stress: Array) -> Array:
    """Norms (x,) of tensors xx, yy, zz, xy, yz, zx (6, x)."""
    return np.asarray(np.sqrt((stress[:3] ** 2).sum(axis=0) + 2.0 * (stress[3:] ** 2).sum(axis=0)))
